"""Postures by direction cosines: 37 numbers, and the joints that they stand for: mozerov2006 section 2."""

from pipeline.core.posture.cosines import (
    FLOOR_PERCENTILE,
    FRAMES,
    HEADINGS,
    PARAMETERS,
    LimbLengths,
    floor_level,
    joints,
    limb_lengths,
    postures,
)

__all__ = [
    "FLOOR_PERCENTILE",
    "FRAMES",
    "HEADINGS",
    "PARAMETERS",
    "LimbLengths",
    "floor_level",
    "joints",
    "limb_lengths",
    "postures",
]
