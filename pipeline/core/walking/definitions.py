"""Alternative definitions of a walker's height, origin, pelvis and sternum, which the papers leave open.

Hips and knees are joint centres.  Pelvis and sternum differ between laboratories.  The average walker that the
laboratory of zhang2007 published has the pelvis some 106 mm above the hips and the sternum some 36 mm below the
shoulders, for a height of 1500 mm.  Every mapping that ships has the pelvis midway between the hips.  The sternum is
midway between jugular notch and C7, the notch alone or the base of the neck, as the markers allow.

Positions are (T, 15, 3) in WALKER15 order, mm, z up.
"""

from __future__ import annotations

import numpy as np

from pipeline.skeleton import ANKLES, LEFT_LEG, PELVIS, RIGHT_LEG, WALKER15
from pipeline.validation import require_choice

PELVIS_ABOVE_HIPS, STERNUM_BELOW_SHOULDERS = 106.0 / 1500.0, 36.0 / 1500.0
"""Height of the pelvis above the hips, and of the sternum below the shoulders, relative to body height."""

HEAD, STERNUM = WALKER15.index("head"), WALKER15.index("sternum")
HIPS = [LEFT_LEG[0], RIGHT_LEG[0]]
SHOULDERS = [WALKER15.index("left_shoulder"), WALKER15.index("right_shoulder")]


def stature(positions: np.ndarray) -> float:
    """Return the height of the head centre above the lowest ankle, mm, as a measure of stature."""
    ankles = positions[:, ANKLES, 2]
    return np.nanmean(positions[:, HEAD, 2]) - np.nanpercentile(ankles, 2)


def set_origin(positions: np.ndarray, *, origin: str) -> np.ndarray:
    """Return the positions relative to an origin: the mean pelvis, or the point on the floor below it."""
    require_choice("origin", origin, ("pelvis_mean", "floor"))
    centre = positions[:, PELVIS].mean(axis=0)
    if origin == "floor":
        centre[2] = np.percentile(positions[:, ANKLES, 2], 2)
    return positions - centre


def redefine(positions: np.ndarray, *, pelvis: str = "measured", sternum: str = "measured") -> np.ndarray:
    """Return the positions (T, 15, 3), mm, of a walk with pelvis and sternum moved to another definition.

    Parameters
    ----------
    positions : (T, 15, 3)
        Upright walk, mm, z up, any heading.
    pelvis : {"measured", "hips", "above"}
        The mapping's point; the midpoint of the hips; `PELVIS_ABOVE_HIPS` of the height above that midpoint.
    sternum : {"measured", "below_shoulders"}
        The mapping's point; `STERNUM_BELOW_SHOULDERS` of the height below the midpoint of the shoulders.

    Raises
    ------
    InvalidInput
        If a definition is unknown.

    Examples
    --------
    >>> standing = np.zeros((1, 15, 3))
    >>> standing[:, HEAD, 2], standing[:, HIPS, 2], standing[:, SHOULDERS, 2] = 1500.0, 800.0, 1300.0
    >>> moved = redefine(standing, pelvis="above", sternum="below_shoulders")
    >>> moved[0, [PELVIS, STERNUM], 2].tolist()
    [906.0, 1264.0]
    """
    require_choice("pelvis", pelvis, ("measured", "hips", "above"))
    require_choice("sternum", sternum, ("measured", "below_shoulders"))
    moved = np.array(positions, float)
    if pelvis != "measured":
        moved[:, PELVIS] = positions[:, HIPS].mean(axis=1)
    if pelvis == "above":
        moved[:, PELVIS, 2] += PELVIS_ABOVE_HIPS * stature(positions)
    if sternum == "below_shoulders":
        moved[:, STERNUM] = positions[:, SHOULDERS].mean(axis=1)
        moved[:, STERNUM, 2] -= STERNUM_BELOW_SHOULDERS * stature(positions)
    return moved
