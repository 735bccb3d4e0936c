"""How the figures of every study name and place people in recordings, and name intervals in captions."""

from __future__ import annotations

import re

import numpy as np

from pipeline.studies.captions import PERCENT

ANKLE_HEIGHT_MM = 80.0
"""Of the joint above the sole, about; only for showing people on the ground."""


def entity_name(name: str) -> str:
    """Return the name of a clip as the path of a recording's entity can hold it."""
    return re.sub(r"\W", "_", name)


def interval_words(count: int, *, of: str = "mean", over: str = "people", bands: str = "Bands") -> str:
    """Return the sentence of a caption that says what a band around a mean or median is.

    Parameters
    ----------
    count : int
        People or clips that were drawn again; one alone has no interval.
    of, over : str
        The statistic, and what is drawn, in the plural.
    bands : str
        Which ones, as a caption calls them.

    Examples
    --------
    >>> interval_words(12, of="median", over="clips")
    'Bands: 95 % interval of the median over 12 clips.'
    """
    if count < 2:
        return f"No interval of the {of}: all is of one {'person' if over == 'people' else over[:-1]}."
    return f"{bands}: {PERCENT} interval of the {of} over {count} {over}."


def lift(motion: np.ndarray) -> np.ndarray:
    """Return what to add to a motion (T, 15, 3) so that its lower ankle stands on the ground, (3,) mm."""
    return np.array([0.0, 0.0, ANKLE_HEIGHT_MM - motion[..., 2].min()])
