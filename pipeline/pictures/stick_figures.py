"""Stick figures: bones as lines, checked against their joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from pipeline.palette import hex_colour
from pipeline.validation import InvalidInput, require_finite, require_shape

Bones = Sequence[tuple[int, int]]

RING_SIZE = 3.0
"""Diameter of the rings of joints that nobody measured, points."""


def bone_pairs(where: str, bones: Bones, joints: int) -> np.ndarray:
    """Return the bones as (B, 2) int.

    Raises
    ------
    InvalidInput
        If they are not pairs of joints.
    """
    pairs = np.asarray(bones)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or pairs.min() < 0 or pairs.max() >= joints:
        raise InvalidInput("bones that are not pairs of joints", where=where, expected=f"0…{joints - 1}")
    return pairs


def postures_array(where: str, positions: Any, shape: Sequence[int | str]) -> np.ndarray:
    """Return postures as finite floats of a shape such as ``("n", "J", 2)``, mm, the last axis right and up.

    Raises
    ------
    InvalidInput
        If the shape differs, an axis is empty, or a number is not finite.
    """
    array = require_finite(where, require_shape(where, positions, shape)).astype(float)
    if 0 in array.shape:
        raise InvalidInput("no postures", where=where, received=f"shape {array.shape}")
    return array


def add_bones(axes: Axes, postures: np.ndarray, bones: Bones, *, colour: str, width: float) -> None:
    """Add the bones of postures (…, J, 2) to axes, in their data units; the limits of the axes stay."""
    strips = np.asarray(postures)[..., np.asarray(bones), :].reshape(-1, 2, 2)
    lines = LineCollection(list(strips), colors=hex_colour(colour), linewidths=width, capstyle="round")
    axes.add_collection(lines, autolim=False)


def add_rings(axes: Axes, postures: np.ndarray, joints: np.ndarray, *, colour: str, width: float) -> None:
    """Add rings to some of the joints (J,) bool of postures (…, J, 2): those that nobody measured."""
    places = np.asarray(postures)[..., joints, :].reshape(-1, 2)
    axes.plot(
        *places.T,
        linestyle="none",
        marker="o",
        markersize=RING_SIZE,
        markerfacecolor="white",
        markeredgecolor=hex_colour(colour),
        markeredgewidth=width,
        scalex=False,
        scaley=False,
    )
