"""Colours and looks of series, one palette for printed pictures and for recordings.

The hues are those of Okabe and Ito, told apart by colour-blind readers.  A colour is asked for by its name (``"blue"``)
or, better, by its role (``"map"``), so that a method has the same colour in every figure.  Pictures have a white ground
and recordings a dark one: only black ink is replaced there, by silver.
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
"""Name → hexadecimal red, green, blue; dark enough for thin lines on white first, the last two for a dark ground."""

CYCLE = ("black", "orange", "blue", "green", "purple", "amber", "sky", "grey")
"""Colours of series that are given none, in this order."""

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
"""Role → name of its colour."""

CONFIDENCES = {"green": "decided", "amber": "in_doubt", "red": "undecided"}
"""Verdict on a limb by the margin of its mirror, and its role."""

NAMES = (*COLOURS, *ROLES)
"""Everything that may be given as a colour."""

ON_DARK = {"black": "silver"}
"""Colours that a dark ground replaces."""


def colour_name(colour: str) -> str:
    """Return the name in `COLOURS` of a colour given by name or role.

    Raises
    ------
    KeyError
        If it is neither.

    Examples
    --------
    >>> colour_name("blue"), colour_name("original")
    ('blue', 'black')
    """
    name = ROLES.get(colour, colour)
    COLOURS[name]
    return name


def name_on_dark(colour: str) -> str:
    """Return the name of a colour given by name or role as a recording draws it, on its dark ground.

    Examples
    --------
    >>> name_on_dark("original"), name_on_dark("undecided")
    ('silver', 'orange')
    """
    name = colour_name(colour)
    return ON_DARK.get(name, name)


def hex_colour(colour: str) -> str:
    """Return a colour as ``"#RRGGBB"``, for a white ground.

    Examples
    --------
    >>> hex_colour("least_squares")
    '#D55E00'
    """
    return COLOURS[colour_name(colour)]


def rgb_colour(colour: str, *, dark_ground: bool = False) -> tuple[int, int, int]:
    """Return red, green and blue of a colour, 0 to 255.

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
    """How one series is named and drawn, in pictures and in recordings.

    Attributes
    ----------
    label : str
        For the legend; empty for none.
    colour : str
        A name or a role; empty for the next colour of `CYCLE`.
    line : str
        ``solid``, ``dashed``, ``dotted`` or ``points``; in pictures only.
    banded : bool
        Whether the band of the spread is drawn, if there is one.
    interval : bool
        Whether the interval of the line is drawn, if there is one.
    width : float
        Factor on the usual width of lines.
    opacity : float
        Of lines, 0 to 1; in pictures only.
    """

    label: str = ""
    colour: str = ""
    line: str = "solid"
    banded: bool = True
    interval: bool = True
    width: float = 1.0
    opacity: float = 1.0


Styles = Mapping[str, Style] | Style | None
"""Of each series, of all series alike, or none given."""


def style_keys(styles: Styles) -> tuple[str, ...]:
    """Return the series that have a style of their own, in order."""
    return tuple(styles) if isinstance(styles, Mapping) else ()


def style_of(styles: Styles, series: str) -> Style:
    """Return the style of a series; one that is given none is labelled with its name.

    Examples
    --------
    >>> style_of({"map": Style("approach II")}, "map").label, style_of(None, "baseline").label
    ('approach II', 'baseline')
    """
    if isinstance(styles, Style):
        return styles
    return (styles or {}).get(series, Style(label=series))
