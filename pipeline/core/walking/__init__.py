"""From a recording to a walker: the steady stretch of a clip and its treadmill equivalent (zhang2007 section 2)."""

from pipeline.core.walking.steady import (
    STANDING_MM,
    TREADMILL_MM_S,
    Stretch,
    facing,
    set_origin,
    steady_stretch,
    treadmill_equivalent,
)

__all__ = [
    "STANDING_MM",
    "TREADMILL_MM_S",
    "Stretch",
    "facing",
    "set_origin",
    "steady_stretch",
    "treadmill_equivalent",
]
