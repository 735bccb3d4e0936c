"""Postures as 37 numbers: the height of the pelvis, and the direction cosines of twelve limbs (mozerov2006 section 2).

`postures` goes from joints to cosines, `joints` back with the `limb_lengths` of a body; `frames` says what cosines are
relative to, `kernels` is the compiled way back.

Symbols
-------
``u``        height of the pelvis over the floor, in leg lengths
``theta``    direction cosines of a limb: its unit direction in the frame of its parent
"""

from pipeline.core.posture.cosines import (
    FLOOR_PERCENTILE,
    FRAMES,
    HEADINGS,
    PARAMETERS,
    LimbLengths,
    floor_level,
    joints,
    joints_where_defined,
    limb_lengths,
    nearest_of_each,
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
    "joints_where_defined",
    "limb_lengths",
    "nearest_of_each",
    "postures",
]
