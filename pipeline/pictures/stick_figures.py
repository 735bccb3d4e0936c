"""Stick figures: bones as lines, and joints that were not measured as rings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from pipeline.palette import hex_colour

Bones = Sequence[tuple[int, int]]

RING_SIZE = 3.0
"""Diameter, points, of the rings at joints that were not measured."""


def add_bones(axes: Axes, postures: np.ndarray, bones: Bones, *, colour: str, width: float) -> None:
    """Add the bones of postures (…, J, 2), in data units, to axes; the limits of the axes do not change."""
    strips = postures[..., np.asarray(bones), :].reshape(-1, 2, 2)
    lines = LineCollection(list(strips), colors=hex_colour(colour), linewidths=width, capstyle="round")
    axes.add_collection(lines, autolim=False)


def add_rings(axes: Axes, postures: np.ndarray, joints: np.ndarray, *, colour: str, width: float) -> None:
    """Add rings to postures (…, J, 2) at the joints that the mask (J,) marks as not measured."""
    places = postures[..., joints, :].reshape(-1, 2)
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
