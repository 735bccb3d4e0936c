"""Types of motion clips, recorded or synthetic, from which figures are computed.

The kinds are walks (zhang2004, zhang2007), performances of an action (mozerov2006) and varied motion (park2011).  A
data set has a corpus for each kind.  Every clip has a row in the report, kept or rejected, with the reason.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Clips:
    """Usable clips, concatenated along the time axis, and a report on all clips.

    Attributes
    ----------
    positions : (sum of T, 15, 3)
        Millimetres.
    first : (W + 1,) int
        First frame of each clip, and the total number of frames.
    frame_rate_hz, leg_length_mm : (W,)
    person, clip, source : (W,) text
    report : list of dict
        A row per clip, kept or rejected, with the reason.
    report_columns : list of str
        Columns of the report in order.
    inputs : dict
        sha256 of each recording, by clip.
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
        """Return the positions (T, 15, 3), mm, of one clip."""
        return self.positions[self.first[number] : self.first[number + 1]]


@dataclass(frozen=True, kw_only=True)
class Walks(Clips):
    """Steady walks, converted to treadmill walking.

    Attributes
    ----------
    frequency_hz, residual_share, stature_mm : (W,)
        Fundamental frequency; share of the variance not explained by two harmonics; height of the head above the
        lower ankle.
    estimated : (W, 15) bool
        Joints without markers, estimated from the other joints.
    dropped : (15,) bool
        Joints that are left out for all walkers.
    """

    frequency_hz: np.ndarray
    residual_share: np.ndarray
    stature_mm: np.ndarray
    estimated: np.ndarray
    dropped: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Performances(Clips):
    """Performances of the same action.

    Attributes
    ----------
    phase : (sum of T,), optional
        True phase of the action at each frame, 0 to 1, if it is known.
    moving_phase : (2,), optional
        First and last phase of the movement.
    """

    phase: np.ndarray | None = None
    moving_phase: np.ndarray | None = None


@dataclass(frozen=True, kw_only=True)
class VariedClips(Clips):
    """Clips of varied motion of any kind.

    Attributes
    ----------
    action : (W,) text
    """

    action: np.ndarray


@dataclass(frozen=True)
class Corpus:
    """Kind of clips: walks, performances or varied clips.

    Attributes
    ----------
    name : str
        ``"walks"``, ``"performances"`` or ``"clips"``: the option of a data set for this kind.
    words : str
        Plural noun for messages.
    sample : str
        Name of the array of clip names in ``arrays.npz``.
    result : type
        Class of the clips.
    world : str
        Description of the world frame in recordings.
    """

    name: str
    words: str
    sample: str
    result: type[Clips]
    world: str


WALKS = Corpus(
    "walks",
    "walks",
    sample="walker",
    result=Walks,
    world="World: right-handed, metres, z up, the walk along +y, +x to the walker's right; walkers are lifted from "
    "the tables' origin, the mean pelvis, to stand on the ground.\n"
    "View angle 0 is the frontal view, -90 the left profile, +90 the right profile; image right is the walker's "
    "right at 0, so a video taken from the front has to be mirrored.",
)
"""Kind of clips that zhang2004 and zhang2007 need: walks."""

PERFORMANCES = Corpus(
    "performances",
    "performances of one action",
    sample="performance",
    result=Performances,
    world="World: right-handed, metres, z up; actors stand over the origin, facing +y at the first frame.",
)
"""Kind of clips that mozerov2006 needs: performances of the same action."""

VARIED = Corpus(
    "clips",
    "varied motion",
    sample="clip_name",
    result=VariedClips,
    world="World: right-handed, metres, z up, as recorded.",
)
"""Kind of clips that park2011 needs: varied motion."""


Reducer: TypeAlias = Callable[[np.ndarray, float, float], Any]
"""Function that represents a walk, from positions (T, 15, 3), mm, frame rate, Hz, and stride frequency, Hz.

Only the function's result is stored.
"""


@dataclass(frozen=True)
class Request:
    """Request for the clips of a data set, from which the ingest stage computes them.

    Attributes
    ----------
    options : dict
        Values that the result depends on.
    make : callable
        Function that returns the clips.
    source : str
        Name of the module of `make`.
    streaming : callable, optional
        Function that returns the walks without positions, and the result of a reducer for each walk.
    """

    options: dict[str, Any]
    make: Callable[[], Clips]
    source: str
    streaming: Callable[[Reducer], tuple[Walks, list[Any]]] | None = None
