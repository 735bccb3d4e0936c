"""Interpolation of short gaps in a clip, before the search for steady walking."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline


@dataclass(frozen=True)
class BridgedClip:
    """A clip in which short gaps have been filled.

    Attributes
    ----------
    positions : (T, J, 3)
        mm.
    whole : (T,) bool
        Frames in which every joint is known.
    n_filled : int
        Number of interpolated values.
    """

    positions: np.ndarray
    whole: np.ndarray
    n_filled: int


def bridge_gaps(
    positions: np.ndarray, valid: np.ndarray, frame_rate_hz: float, *, gap_s: float
) -> BridgedClip:
    """Return the clip with gaps of at most `gap_s` seconds interpolated, but not extrapolated at the ends.

    Parameters
    ----------
    positions : (T, J, 3)
        mm.
    valid : (T, J) bool
        Where a joint was measured.
    frame_rate_hz, gap_s : float

    Notes
    -----
    By a cubic spline through the joint's measured frames.
    """
    filled = np.array(positions, float)
    usable = np.array(valid, bool)
    longest = int(np.floor(gap_s * frame_rate_hz + 1e-9))  # 0.29 s at 100 Hz is 29 frames
    count = 0
    for joint in range(filled.shape[1]):
        observed = np.flatnonzero(usable[:, joint])
        if len(observed) == len(filled) or len(observed) < 4:
            continue
        short = [
            g for g in np.flatnonzero(np.diff(observed) > 1) if observed[g + 1] - observed[g] - 1 <= longest
        ]
        if not short:
            continue
        spline = CubicSpline(observed, filled[observed, joint])
        for g in short:
            frames = np.arange(observed[g] + 1, observed[g + 1])
            filled[frames, joint] = spline(frames)
            usable[frames, joint] = True
            count += len(frames)
    return BridgedClip(filled, np.all(usable, axis=1), count)
