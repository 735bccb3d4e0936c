"""What is no chart, as plain values: views of a recording and their arrangement, postures and matrices of a picture.

Here is neither matplotlib nor rerun: `pipeline.recordings` and `pipeline.pictures` show what is described here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.validation import InvalidInput


@dataclass(frozen=True, kw_only=True)
class View:
    """One view: its title, the entity of its origin, and the entities it shows (by default all below the origin)."""

    name: str
    origin: str
    contents: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Space3D(View):
    """Skeletons in space, framed; with `shown`, all other entities start hidden, and these are framed.

    They are seen from the direction in which `eye_mm` lies from `target_mm`, from so far that they fill the view, whose
    width over height in the layout is about `aspect`: bodies side by side fill a wide view.
    """

    origin: str = "world"
    shown: tuple[str, ...] = ()
    eye_mm: tuple[float, float, float] = (2000.0, 1750.0, 1300.0)
    target_mm: tuple[float, float, float] = (0.0, 0.0, 850.0)
    aspect: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Image2D(View):
    """Skeletons in an image, upright; `shown` as in `Space3D`.

    With `beside`, a view of the same bodies in space that is as high in the layout, both have one scale.
    """

    origin: str = "image"
    shown: tuple[str, ...] = ()
    beside: Space3D | None = None


@dataclass(frozen=True, kw_only=True)
class Plot(View):
    """Curves over the recording's timeline; the range of ordinates defaults to that of the data with their bands.

    `headroom` is what to add above them for the legend, as a share of their height.
    """

    origin: str = "curves"
    y_range: tuple[float, float] | None = None
    headroom: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Bars(View):
    """A bar chart."""

    origin: str = "spectrum"


@dataclass(frozen=True, kw_only=True)
class Matrix(View):
    """A matrix as a coloured image, row 0 at the top."""

    origin: str = "matrices"


@dataclass(frozen=True, kw_only=True)
class Notes(View):
    """The description."""

    name: str = "about"
    origin: str = "about"


class Split:
    """Views and splits side by side: `Columns`, `Rows` or `Tabs`.

    Parameters
    ----------
    parts : View or Split
    shares : sequence of float, optional
        Share of the space of each part; equal by default.
    """

    def __init__(self, *parts: View | Split, shares: Sequence[float] | None = None) -> None:
        if shares is not None and len(shares) != len(parts):
            raise InvalidInput(
                "as many shares as parts", expected=len(parts), received=len(shares), code="other_length"
            )
        self.parts, self.shares = parts, shares


class Columns(Split):
    """Parts side by side."""


class Rows(Split):
    """Parts above one another."""


class Tabs(Split):
    """Parts of which one is seen at a time; the first is open at the start."""


@dataclass(frozen=True, kw_only=True)
class PostureRow:
    """Postures side by side, `original` and `reconstructed`, each (n, J, 2) in mm, the second axis up.

    Joints that nobody measured, `estimated` (J,) bool, are drawn hollow.
    """

    label: str
    original: np.ndarray
    reconstructed: np.ndarray
    estimated: np.ndarray | None = None


@dataclass(frozen=True, kw_only=True)
class SkeletonRow:
    """One posture (J, 2) with others (n, J, 2) over it, and some of them beside it, mm, the second axis up.

    Attributes
    ----------
    label : str
        Above the row.
    centre : (J, 2) float
    others : (n, J, 2) float
    beside : sequence of int
        Which of the others stand beside it, each over the posture.
    """

    label: str
    centre: np.ndarray
    others: np.ndarray
    beside: Sequence[int]


@dataclass(frozen=True, kw_only=True)
class MotionScene:
    """One motion before a camera.

    Attributes
    ----------
    image : (I, J, 2) float
        What the camera saw at I instants, right and up; NaN where it saw nothing.
    rows : sequence of (str, (I, J, 2), (I, J, 2), str)
        From the top: words, a reconstruction and the truth seen from aside, mm, the second axis up, and a colour.
    ground : (F, 2) float
        Path of the body from above.
    cameras : sequence of (str, str, (F, 2), (3, 2))
        Name, colour and path of each from above, and the triangle, from its middle place, of what it saw.
    """

    image: np.ndarray
    rows: Sequence[tuple[str, np.ndarray, np.ndarray, str]]
    ground: np.ndarray
    cameras: Sequence[tuple[str, str, np.ndarray, np.ndarray]]


@dataclass(frozen=True, kw_only=True)
class HeatMap:
    """A matrix over two axes of whole numbers.

    Attributes
    ----------
    values : (R, C) float
        One row to each ordinate; NaN is left white.
    x, y : (C,) and (R,) int
        Abscissae and ordinates of the cells, increasing by one.
    path : (C,) int
        Ordinate of the path at each abscissa.
    outline : (K, 2) float
        Corners of what is admissible, closed by itself.
    title, xlabel, ylabel, bar : str
        `bar` is beside the scale of colours.
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
