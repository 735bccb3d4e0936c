"""Options of clips: steady walking, synthetic people, and what every data set can be asked for."""

from __future__ import annotations

from abc import ABC, abstractmethod
from enum import StrEnum
from typing import Annotated, ClassVar

from pipeline.clips.kinds import Corpus, Request
from pipeline.validation import (
    Count,
    CountOrAll,
    NonNegative,
    Options,
    Positive,
    Share,
    bounded,
    require_bounds,
)

Number = Annotated[int, bounded(at_least=1, at_most=10_000)]
"""Of people or clips that are made."""
Seconds = Annotated[float, bounded(above=0, at_most=3600)]
FrameRate = Annotated[float, bounded(above=0, at_most=2000)]
"""Hz."""


class Locomotion(StrEnum):
    """Where people walked."""

    auto = "auto"
    overground = "overground"
    treadmill = "treadmill"


class HorizontalPath(StrEnum):
    """Model of the horizontal path that is subtracted from a walk."""

    cubic = "cubic"
    moving_average = "moving_average"


class Missing(StrEnum):
    """What becomes of joints that the markers do not give."""

    estimate = "estimate"
    """They are estimated from the others, flagged, and left out of errors."""
    drop = "drop"
    """They are left out everywhere, for all walkers."""


class Skeleton(Options):
    """How the points of the user's files become joints."""

    mapping: str = "walker15"  # one that ships, auto, or a file.yaml
    missing: Missing = Missing.estimate


class Heading(StrEnum):
    """Which direction of a walk becomes +y."""

    steps = "steps"
    """That of the steps: the main horizontal axis of the left minus the right ankle."""
    path = "path"
    """That of the path; on a treadmill, where the hips face."""


class SyntheticPerformances(Options):
    """Bending to the floor, each performance with its own, known rate [mozerov2006 section 4]."""

    performances: Number = 40  # number of performances
    subjects: Number = 20  # number of people
    frames_mean: Annotated[float, bounded(above=0, at_most=100_000)] = 100.0  # mean length, frames
    frame_rate_hz: FrameRate = 30.0  # of the recordings
    rate_spread: NonNegative = 0.3  # standard deviation of the logarithm of the rate
    marker_noise_mm: NonNegative = 0.5  # standard deviation of each coordinate
    limit: CountOrAll = 0  # at most so many performances; 0: all


class SyntheticClips(Options):
    """Walking, bending and bodies of smooth angles in turn: motion with a known answer (park2011)."""

    clips: Number = 24  # number of clips; half of them are in figure 3c
    seconds: Seconds = 6.8  # length of each, s
    frame_rate_hz: FrameRate = 30.0  # of the recordings
    bandwidth: Count = 10  # cosines of the angles of the smooth bodies, over the whole clip
    limit: CountOrAll = 0  # at most so many clips; 0: all


class Steady(Options):
    """Criteria of steady walking, and of a usable Fourier series of it."""

    locomotion: Locomotion = Locomotion.auto
    path: HorizontalPath = HorizontalPath.cubic
    heading: Heading = Heading.steps
    speed_band: Positive = 0.35  # relative to the median speed; narrower bands are tried first
    turn_deg_s: Positive = 45.0  # a walk that turns faster is not steady
    cycles: NonNegative = 1.0  # least length, gait cycles
    gap_s: NonNegative = 0.1  # longer gaps end a stretch, shorter ones are bridged
    fundamental_share: Share = 0.6  # least share of the variance in the fundamental
    residual_share: Share = 0.15  # largest share of the variance beyond two harmonics
    frequency_ratio: Annotated[float, bounded(at_least=1)] = (
        1.6  # to the population's median, at equal Froude number
    )


class Data(Options, ABC):
    """Where clips come from."""

    knows_true_course: ClassVar[bool] = False
    """Whether the true phase of the performances is known."""
    credit: ClassVar[str] = ""
    """Source and terms, which captions state where the data require it."""
    in_light_archives: ClassVar[bool] = True
    """Whether light archives hold figures of the data: not if its terms do not allow it."""

    name: str  # of the data set and of its folder of results
    walkers: CountOrAll = 0  # at most so many people; 0: all

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        require_bounds("data", self)

    def require(self, corpus: Corpus) -> None:
        """Raise InvalidInput, with ``data`` as its `where`, if this data set holds no clips of this kind."""

    @abstractmethod
    def request(self, corpus: Corpus, skeleton: Skeleton, seed: int, workers: int) -> Request:
        """Return the request for the clips of one kind.

        Parameters
        ----------
        corpus : Corpus
        skeleton : Skeleton
            How points become joints, for files that have no mapping of their own.
        seed, workers : int

        Raises
        ------
        InvalidInput
            If there are none, or their recordings are not on this machine.
        """


class SyntheticPeople(Data):
    """Synthetic people: how many, for how long."""

    knows_true_course: ClassVar[bool] = True

    population: Number = 80  # number of people
    populations: Annotated[int, bounded(at_least=0, at_most=1000)] = 0  # further ones, for intervals; 0: none
    male_share: Share = 0.4  # the papers' 32 men of 80
    duration_s: Seconds = 8.0  # of each walk
    frame_rate_hz: FrameRate = 120.0  # of the recordings
    marker_noise_mm: NonNegative = 0.5  # standard deviation of each coordinate
    heading: Heading = Heading.steps  # of walks
    offsets: Annotated[float, bounded(at_least=0, at_most=5)] = (
        1.0  # factor on how far offsets of joint angles differ
    )
    performances: SyntheticPerformances = SyntheticPerformances()
    clips: SyntheticClips = SyntheticClips()
