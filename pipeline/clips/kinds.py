"""Kinds of clips that a figure may be made of, and what the ingest stage hands on of them.

A data set names a corpus for each kind: walks (zhang2004, zhang2007), performances of one action (mozerov2006),
clips of varied motion (park2011).  How each becomes usable is in the module of its name.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.clips.corpus import Clip


@dataclass(frozen=True, kw_only=True)
class Clips:
    """Usable clips end to end, and the report on every clip, used or refused.

    Attributes
    ----------
    positions : (sum of T, 15, 3)
        Millimetres.
    first : (W + 1,) int
        Where each clip starts.
    frame_rate_hz, leg_length_mm : (W,)
    person, clip, source : (W,) text
    report : list of dict
        A row for every clip: what was cut, kept or refused, and why.
    report_columns : list of str
        Its columns in order.
    inputs : dict
        sha256 of each recording that was read, by clip.
    """

    positions: np.ndarray
    first: np.ndarray
    frame_rate_hz: np.ndarray
    leg_length_mm: np.ndarray
    person: np.ndarray
    clip: np.ndarray
    source: np.ndarray
    report: list[dict[str, Any]]
    report_columns: list[str]
    inputs: dict[str, str]

    def __len__(self) -> int:
        return len(self.first) - 1

    def motion(self, number: int) -> np.ndarray:
        """Return the positions of one clip, (T, 15, 3) mm."""
        return self.positions[self.first[number] : self.first[number + 1]]


@dataclass(frozen=True)
class Request:
    """What the ingest stage is asked for.

    Attributes
    ----------
    options : dict
        Everything that the result depends on.
    make : callable
        Makes the clips.
    """

    options: dict[str, Any]
    make: Callable[[], Clips]


class Corpus(ABC):
    """One kind of clips.

    Attributes
    ----------
    name : str
        ``"walks"``, ``"performances"`` or ``"clips"``: also the option of a data set that chooses them.
    words : str
        What a data set without any lacks.
    sample : str
        What names the samples in ``arrays.npz``.
    world : str
        How the world of a recording lies.
    """

    name: str
    words: str
    sample: str
    world: str

    @property
    @abstractmethod
    def result(self) -> type[Clips]:
        """Class of the clips."""

    @abstractmethod
    def synthetic(self, data: Any, seed: int, workers: int) -> Request:
        """Return the request for the embedded people."""

    @abstractmethod
    def recorded(self, data: Any, clips: Sequence[Clip], workers: int) -> Request:
        """Return the request for recordings."""


def packed_clips(
    rows: Sequence[dict[str, Any]], positions: Sequence[np.ndarray], rates_hz: Sequence[float]
) -> dict[str, np.ndarray]:
    """Return the array fields of `Clips` from the report's rows of the clips that are kept."""
    return {
        "positions": np.concatenate(positions),
        "first": np.concatenate([[0], np.cumsum([len(p) for p in positions])]),
        "frame_rate_hz": np.array(rates_hz),
        **{
            name: np.array([row[name] for row in rows])
            for name in ("person", "clip", "source", "leg_length_mm")
        },
    }
