"""HTML player of moving points for notebooks, which needs no other files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

_PAGE = Path(__file__).with_name("player.html")
MAX_FRAMES, MAX_POINTS = 120, 100
"""Largest numbers of frames and of points in the player; longer recordings are thinned at equal steps."""
_AXES = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}
"""Indices of the sideways, forward and upward axes of a file, by the name of the upward axis."""


def player(positions: np.ndarray, seconds: float, up: str, bones: tuple[tuple[int, int], ...] = ()) -> str:
    """Return the HTML of a player in which the user can rotate moving points with the mouse.

    Parameters
    ----------
    positions : (T, P, 3)
        Millimetres; NaN where missing.
    seconds : float
        Duration.
    up : str
        Upward axis (``"z"``, ``"-y"``, …); otherwise the axis along which the points of a frame spread most.
    bones : tuple of (int, int)
        Pairs of points to join by lines.

    Examples
    --------
    >>> '"frames": [[[0, 1, 2]], [[0, 1, 3]]]' in player(np.array([[[0.0, 1, 2]], [[0.0, 1, 3]]]), 1.0, "z")
    True
    """
    frames = np.unique(np.linspace(0, len(positions) - 1, min(len(positions), MAX_FRAMES)).astype(int))
    points = np.arange(0, positions.shape[1], -(-positions.shape[1] // MAX_POINTS) or 1)
    selected = positions[np.ix_(frames, points)]
    if (axis := up.removeprefix("-")) not in _AXES:
        spread = np.ma.ptp(np.ma.masked_invalid(selected), axis=1).mean(axis=0)
        axis = "xyz"[int(spread.filled(0.0).argmax())]
    selected = selected[..., _AXES[axis]] * ([1, -1, -1] if up.startswith("-") else [1, 1, 1])
    content = {
        "frames": np.where(np.isnan(selected), -(2**30), selected).round().astype(int).tolist(),
        "bones": bones,
        "seconds": seconds,
    }
    return _PAGE.read_text("utf-8").replace("CONTENT", json.dumps(content))
