"""Contents of figures other than charts, as plain values: views of recordings, postures and matrices.

This module uses neither matplotlib nor rerun: `pipeline.recordings` and `pipeline.pictures` draw these values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.validation import InvalidInput


@dataclass(frozen=True, kw_only=True)
class View:
    """View in a rerun recording: title, path of the origin, and entities shown (by default, all below the origin)."""

    name: str
    origin: str
    contents: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Space3D(View):
    """View of skeletons in 3D, framed so that they fill the view.

    With `focus`, only these entities are framed, and all others start hidden.  The camera looks from `eye_mm` in the
    direction of `target_mm`; its distance is computed.  The view's width over height in the layout is about `aspect`.
    """

    origin: str = "world"
    focus: tuple[str, ...] = ()
    eye_mm: tuple[float, float, float] = (2000.0, 1750.0, 1300.0)
    target_mm: tuple[float, float, float] = (0.0, 0.0, 850.0)
    aspect: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Image2D(View):
    """View of skeletons in an upright image; `focus` has the same meaning as in `Space3D`.

    The field `next_to` names a view in space of the same bodies and the same height in the layout.  Both views then
    have the same scale.
    """

    origin: str = "image"
    focus: tuple[str, ...] = ()
    next_to: Space3D | None = None


@dataclass(frozen=True, kw_only=True)
class Plot(View):
    """View of curves over the timeline of a recording; by default, the ordinate covers the data and bands.

    The legend has its own space above the curves.
    """

    origin: str = "curves"
    y_range: tuple[float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class Bars(View):
    """View that shows a bar chart."""

    origin: str = "spectrum"


@dataclass(frozen=True, kw_only=True)
class Matrix(View):
    """View of a matrix as a coloured image, with row 0 at the top."""

    origin: str = "matrices"


@dataclass(frozen=True, kw_only=True)
class Notes(View):
    """View of the text that describes a recording."""

    name: str = "about"
    origin: str = "about"


class Split:
    """Arrangement of views or of nested arrangements: base class of `Columns`, `Rows` and `Tabs`.

    Parameters
    ----------
    parts : View or Split
    shares : sequence of float, optional
        Fraction of the space for each part; equal by default.
    """

    def __init__(self, *parts: View | Split, shares: Sequence[float] | None = None) -> None:
        if shares is not None and len(shares) != len(parts):
            raise InvalidInput(
                "the number of shares of the space differs from the number of views",
                expected=len(parts),
                received=len(shares),
                code="other_length",
            )
        self.parts, self.shares = parts, shares


class Columns(Split):
    """Arrangement of views from left to right."""


class Rows(Split):
    """Arrangement of views from top to bottom."""


class Tabs(Split):
    """Arrangement of views in tabs; at the start, the first tab is open."""


@dataclass(frozen=True, kw_only=True)
class PostureRow:
    """Row of postures, `original` and `reconstructed`, each (n, J, 2), mm; the second coordinate points up.

    Joints that were not measured, `estimated` (J,) bool, are drawn hollow.
    """

    label: str
    original: np.ndarray
    reconstructed: np.ndarray
    estimated: np.ndarray | None = None


@dataclass(frozen=True, kw_only=True)
class SkeletonRow:
    """Row of skeletons: a central posture, followed by postures that are each drawn over the central one.

    All are in mm; the second coordinate points up.

    Attributes
    ----------
    label : str
        Label above the row.
    centre : (J, 2) float
        The posture.
    others : (n, J, 2) float
    """

    label: str
    centre: np.ndarray
    others: np.ndarray


@dataclass(frozen=True, kw_only=True)
class MotionScene:
    """Motion in front of a camera, with its image, its reconstructions and the ground truth.

    Attributes
    ----------
    image : (I, J, 2) float
        Image points at I instants, right and up; NaN where a point is not visible.
    rows : sequence of (str, (I, J, 2), (I, J, 2), str)
        Rows from the top: label, reconstruction and ground truth in a side view (mm, the second axis up), and colour.
    ground : (F, 2) float
        Path of the body from above.
    cameras : sequence of (str, str, (F, 2), (3, 2))
        Cameras from above: name, colour, path, and triangle of the field of view from the middle of the path.
    """

    image: np.ndarray
    rows: Sequence[tuple[str, np.ndarray, np.ndarray, str]]
    ground: np.ndarray
    cameras: Sequence[tuple[str, str, np.ndarray, np.ndarray]]


@dataclass(frozen=True, kw_only=True)
class HeatMap:
    """Matrix over two axes of whole numbers, drawn as a heat map.

    Attributes
    ----------
    values : (R, C) float
        Values, one row per ordinate; NaN is left white.
    x, y : (C,) and (R,) int
        Abscissae and ordinates of the cells, increasing by one.
    path : (C,) int
        Ordinate of the path at each abscissa.
    outline : (K, 2) float
        Corners of the admissible region; the polygon is closed automatically.
    title, xlabel, ylabel, bar : str
        Title and labels; `bar` is the label of the colour bar.
    path_label, outline_label : str
    """

    values: np.ndarray
    x: np.ndarray
    y: np.ndarray
    path: np.ndarray
    outline: np.ndarray
    title: str
    xlabel: str
    ylabel: str
    bar: str
    path_label: str
    outline_label: str
