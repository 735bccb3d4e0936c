"""Figure captions from templates, with numbers from tables and claims, and colours from the palette."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from pipeline import papers
from pipeline.palette import colour_name

PUBLISHED, BASELINE, COLOUR = "published_", "baseline_", "colour_"
"""Placeholder prefixes for a claim's published number, the value of its baseline, and the name of a colour."""


def filled_caption(text: str, number: Callable[[str], float]) -> str:
    """Return a caption with its placeholders filled in.

    ``{NAME:.0f}`` is our value of a claim or quantity, ``{published_NAME:g}`` the number that the paper prints,
    ``{baseline_NAME:.0f}`` the value of its baseline, and ``{colour_ROLE}`` the palette's name of the colour of a role.

    Parameters
    ----------
    text : str
    number : callable
        Our value of a claim or quantity by name, or of a baseline by prefix and name; NaN if the tables have none.

    Raises
    ------
    InvalidInput
        If there is no such claim or quantity.
    KeyError
        If there is no such role.

    Examples
    --------
    >>> filled_caption("{colour_undecided} limbs: {zhang2007_walkers:.0f} walkers", lambda name: 33.0)
    'orange limbs: 33 walkers'
    """
    values: dict[str, str | _Number] = {}
    for name in papers.placeholders(text):
        if name.startswith(COLOUR):
            values[name] = colour_name(name.removeprefix(COLOUR))
        elif name.startswith(PUBLISHED):
            values[name] = _Number(papers.published(name.removeprefix(PUBLISHED)))
        else:
            papers.quantity(name.removeprefix(BASELINE))  # a misspelt name is an error even without a number
            values[name] = _Number(number(name))
    return text.format_map(values)


@dataclass(frozen=True)
class _Number:
    """Number that is formatted as ``(no number here)`` if it is not finite."""

    value: float

    def __format__(self, specification: str) -> str:
        if not math.isfinite(self.value):
            return "(no number here)"
        return format(self.value, specification).replace("-", "−")
