"""Colours and styles of series: the same palette for printed pictures and for recordings.

The hues are those of Okabe and Ito, which colour-blind readers can distinguish.  A colour has a name (``"blue"``) and
may have roles (``"map"``); roles give a method the same colour in every figure.  Pictures have a white background and
recordings a dark one, on which silver replaces black.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

COLOURS = {
    "black": "#000000",
    "orange": "#D55E00",
    "blue": "#0072B2",
    "green": "#009E73",
    "purple": "#CC79A7",
    "amber": "#E69F00",
    "sky": "#56B4E9",
    "grey": "#7F7F7F",
    "yellow": "#F0E442",
    "silver": "#CDCDCD",
}
"""Red, green and blue in hexadecimal, by colour name; the last two are too light for thin lines on white."""

CYCLE = ("black", "orange", "blue", "green", "purple", "amber", "sky", "grey")
"""Names of the colours for series without a colour of their own, in order of use."""

ROLES = {
    "original": "black",
    "reconstruction": "blue",
    "least_squares": "orange",
    "map": "blue",
    "baseline": "grey",
    "reference": "grey",
    "published": "black",
    "optimal_path": "orange",
    "decided": "green",
    "in_doubt": "amber",
    "undecided": "orange",
}
"""Name of the colour for each role of a series, such as a method."""

CONFIDENCES = {"green": "decided", "amber": "in_doubt", "red": "undecided"}
"""Role for each confidence in the reconstruction of a limb.

The confidence depends on the margin over the mirror image of the limb.
"""

NAMES = (*COLOURS, *ROLES)
"""Valid names of a colour: names of colours and roles."""

ON_DARK = {"black": "silver"}
"""Colours that are replaced on a dark background, with their replacements."""


def colour_name(colour: str) -> str:
    """Return the name in `COLOURS` for the name of a colour or role.

    Raises
    ------
    KeyError
        If `colour` is neither a name nor a role.

    Examples
    --------
    >>> colour_name("blue"), colour_name("original")
    ('blue', 'black')
    """
    name = ROLES.get(colour, colour)
    COLOURS[name]
    return name


def name_on_dark(colour: str) -> str:
    """Return the colour name to use on a dark background for the name of a colour or role.

    Examples
    --------
    >>> name_on_dark("original"), name_on_dark("undecided")
    ('silver', 'orange')
    """
    name = colour_name(colour)
    return ON_DARK.get(name, name)


def hex_colour(colour: str) -> str:
    """Return the colour with a given name or role as ``"#RRGGBB"``, for a white background.

    Examples
    --------
    >>> hex_colour("least_squares")
    '#D55E00'
    """
    return COLOURS[colour_name(colour)]


def rgb_colour(colour: str, *, dark_ground: bool = False) -> tuple[int, int, int]:
    """Return red, green and blue (0 to 255) of the colour with a given name or role.

    Examples
    --------
    >>> rgb_colour("original"), rgb_colour("original", dark_ground=True)
    ((0, 0, 0), (205, 205, 205))
    """
    name = name_on_dark(colour) if dark_ground else colour_name(colour)
    red, green, blue = bytes.fromhex(COLOURS[name][1:])
    return red, green, blue


@dataclass(frozen=True)
class Style:
    """Label and line style of a series, in pictures and in recordings.

    Attributes
    ----------
    label : str
        Label in the legend; empty for no label.
    colour : str
        Name or role of a colour; empty for the next colour of `CYCLE`.
    line : str
        ``solid``, ``dashed``, ``dotted`` or ``points``; in pictures only.
    banded : bool
        Whether to draw the band of the spread, if the series has one.
    interval : bool
        Whether to draw the interval of the line, if the series has one.
    width : float
        Factor on the default line width.
    opacity : float
        Opacity of lines, 0 to 1; in pictures only.
    """

    label: str = ""
    colour: str = ""
    line: str = "solid"
    banded: bool = True
    interval: bool = True
    width: float = 1.0
    opacity: float = 1.0


Styles = Mapping[str, Style] | Style | None
"""Styles by series, or one style for all series, or None for default styles."""


def style_keys(styles: Styles) -> tuple[str, ...]:
    """Return the names of the series that have a style of their own, in order."""
    return tuple(styles) if isinstance(styles, Mapping) else ()


def style_of(styles: Styles, series: str) -> Style:
    """Return the style of a series; in the default style, the label is the name of the series.

    Examples
    --------
    >>> style_of({"map": Style("approach II")}, "map").label, style_of(None, "baseline").label
    ('approach II', 'baseline')
    """
    if isinstance(styles, Style):
        return styles
    return (styles or {}).get(series, Style(label=series))
