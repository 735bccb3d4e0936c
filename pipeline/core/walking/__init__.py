"""Extraction of a walk from a recording: gap filling, steady part, treadmill equivalent (zhang2007 section 2).

In the order of use: `bridge_gaps` fills the short gaps of a clip, `steady_stretch` finds the part
of steady walking, `treadmill_equivalent` takes the path and the heading out of that part,
`require_walk` rejects other motion, `unusual_cadence` doubts the frame rate, `redefine` moves the pelvis and the
sternum to other definitions, and `set_origin` puts it about the pelvis.  Positions are (T, 15, 3) in WALKER15
order, mm, z up.
"""

from pipeline.core.walking.definitions import redefine, set_origin, stature
from pipeline.core.walking.gates import require_walk, unusual_cadence
from pipeline.core.walking.steady import (
    STANDING_MM,
    TREADMILL_MM_S,
    Stretch,
    facing,
    longest_run,
    steady_stretch,
    step_heading,
    treadmill_equivalent,
    turn_about_vertical,
)
from pipeline.core.walking.usable_clip import (
    BridgedClip,
    bridge_gaps,
)
from pipeline.skeleton.joints import LEG_LENGTH_MM, leg_length

__all__ = [
    "LEG_LENGTH_MM",
    "STANDING_MM",
    "TREADMILL_MM_S",
    "BridgedClip",
    "Stretch",
    "bridge_gaps",
    "facing",
    "leg_length",
    "longest_run",
    "redefine",
    "require_walk",
    "set_origin",
    "stature",
    "steady_stretch",
    "step_heading",
    "treadmill_equivalent",
    "turn_about_vertical",
    "unusual_cadence",
]
