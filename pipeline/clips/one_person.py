"""Recordings under two names that may show one person, which leaves open how many people there are.

Verdicts rest on people, and a person under two names counts twice.  Copies that are equal point by point are refused
where recordings are read; here are those that were cut, shifted, resampled, mirrored, resized or made noisy.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.core.likeness import Likeness, limb_differences, posture_difference_mm

REMARK = "may be the person of"
"""Begins the remark on a recording that may show a person of another name."""

EQUAL_LIMBS = 0.1
"""Per cent: limbs that differ by less are one person's, or one skeleton's that several people were put on."""

LIKE_LIMBS, LIKE_POSTURES_MM = 2.0, 18.0
"""Per cent and mm: a recording that is as near as this in both may be a copy."""


def remarks(people: Sequence[str], clips: Sequence[str], shown: Sequence[Likeness]) -> list[str]:
    """Return a remark on each recording that may show a person of another name, and nothing on the others."""
    if not shown:
        return []
    limbs, names = np.stack([clip_likeness.limbs_mm for clip_likeness in shown]), np.array(list(people))
    return [_remark(number, names, clips, shown, limbs) for number in range(len(shown))]


def _remark(
    number: int, names: np.ndarray, clips: Sequence[str], shown: Sequence[Likeness], limbs: np.ndarray
) -> str:
    off = np.where(names == names[number], np.nan, limb_differences(limbs[number], limbs))
    near = [other for other in np.argsort(off, kind="stable") if off[other] < LIKE_LIMBS]
    for other in near:
        remark = f"{REMARK} {names[other]} in {clips[other]}: limbs differ by {off[other]:.2f} %"
        if off[other] < EQUAL_LIMBS:
            return remark
        apart_mm = posture_difference_mm(shown[number].postures_mm, shown[other].postures_mm)
        if apart_mm < LIKE_POSTURES_MM:
            return f"{remark}, postures by {apart_mm:.0f} mm"
    return ""
