"""Detection of recordings that may show the same person under different names.

Statistics count people, and a person with two names would count twice.  Exact copies are rejected when recordings are
read.  This module finds copies that were cut, shifted, resampled, mirrored, resized or made noisy.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.core.likeness import Likeness, limb_differences, posture_difference_mm

REMARK = "may be the person of"
"""First words of the remark on a recording that may show the same person as a recording under another name."""

EQUAL_LIMB_TOLERANCE = 0.1
"""Difference of limb lengths, per cent, below which two recordings are assumed to have the same skeleton.

The recordings are of the same person, or one skeleton was used for several people.
"""

MAX_LIMB_DIFFERENCE, MAX_POSTURE_DIFFERENCE_MM = 2.0, 18.0
"""Largest differences of limb lengths (per cent) and of postures (mm) for recordings of one person."""


def remarks(people: Sequence[str], clips: Sequence[str], likenesses: Sequence[Likeness]) -> list[str]:
    """Return a remark for each recording that may show a person with another name; otherwise an empty string."""
    if not likenesses:
        return []
    limbs, names = np.stack([clip_likeness.limbs_mm for clip_likeness in likenesses]), np.array(list(people))
    return [_remark(number, names, clips, likenesses, limbs) for number in range(len(likenesses))]


def _remark(
    number: int, names: np.ndarray, clips: Sequence[str], likenesses: Sequence[Likeness], limbs: np.ndarray
) -> str:
    difference = np.where(names == names[number], np.nan, limb_differences(limbs[number], limbs))
    near = [
        other for other in np.argsort(difference, kind="stable") if difference[other] < MAX_LIMB_DIFFERENCE
    ]
    for other in near:
        remark = f"{REMARK} {names[other]} in {clips[other]}: limbs differ by {difference[other]:.2f} %"
        if difference[other] < EQUAL_LIMB_TOLERANCE:
            return remark
        posture_mm = posture_difference_mm(likenesses[number].postures_mm, likenesses[other].postures_mm)
        if posture_mm < MAX_POSTURE_DIFFERENCE_MM:
            return f"{remark}, postures by {posture_mm:.0f} mm"
    return ""
