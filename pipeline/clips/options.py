"""Options of clips: steady walking, synthetic people, and the base class of data sets."""

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
"""Type of an option that is the number of synthetic people or clips."""
Seconds = Annotated[float, bounded(above=0, at_most=3600)]
FrameRate = Annotated[float, bounded(above=0, at_most=2000)]
"""Type of an option that is a frame rate, Hz."""


class Locomotion(StrEnum):
    """Kind of locomotion."""

    auto = "auto"
    overground = "overground"
    treadmill = "treadmill"


class HorizontalPath(StrEnum):
    """Model of the horizontal path that is subtracted from a walk."""

    cubic = "cubic"
    moving_average = "moving_average"


class Missing(StrEnum):
    """Treatment of joints that were not measured."""

    estimate = "estimate"
    """Missing joints are estimated from the measured joints, flagged, and excluded from errors."""
    drop = "drop"
    """A joint that is missing in any walk is left out of all walks."""


class Skeleton(Options):
    """Options of the mapping from the points in a user's files to joints."""

    mapping: str = "walker15"  # a shipped mapping, auto, or a file.yaml
    missing: Missing = Missing.estimate


class Heading(StrEnum):
    """Definition of the walking direction, which becomes +y."""

    steps = "steps"
    """Direction of the steps: the main horizontal axis of the vector from the right to the left ankle."""
    path = "path"
    """Direction of the path; for a walk on a treadmill, the direction that the hips face."""


class SyntheticPerformances(Options):
    """Options of synthetic bending to the floor, with a known rate of each performance [mozerov2006 section 4]."""

    performances: Number = 40  # number of performances
    subjects: Number = 20  # number of people
    frames_mean: Annotated[float, bounded(above=0, at_most=100_000)] = 100.0  # mean length, frames
    frame_rate_hz: FrameRate = 30.0  # of the recordings
    rate_spread: NonNegative = 0.3  # standard deviation of the logarithm of the rate
    marker_noise_mm: NonNegative = 0.5  # standard deviation of each coordinate
    limit: CountOrAll = 0  # largest number of performances; 0: all


class SyntheticClips(Options):
    """Options of synthetic clips: alternating walking, bending and smooth joint angles (park2011)."""

    clips: Number = 24  # number of clips; half of them are in figure 3c
    seconds: Seconds = 6.8  # length of each, s
    frame_rate_hz: FrameRate = 30.0  # of the recordings
    bandwidth: Count = 10  # number of cosines of the smooth joint angles, over the whole clip
    limit: CountOrAll = 0  # largest number of clips; 0: all


class Steady(Options):
    """Criteria of steady walking, and of a walk that a Fourier series describes well."""

    locomotion: Locomotion = Locomotion.auto
    path: HorizontalPath = HorizontalPath.cubic
    heading: Heading = Heading.steps
    speed_band: Positive = 0.35  # relative to the median speed; narrower bands are tried first
    turn_deg_s: Positive = 45.0  # a walk that turns faster is not steady
    cycles: NonNegative = 1.0  # smallest length, gait cycles
    gap_s: NonNegative = 0.1  # longer gaps end a stretch, shorter ones are bridged
    fundamental_share: Share = 0.6  # smallest share of the variance in the fundamental
    residual_share: Share = 0.15  # largest share of the variance beyond two harmonics
    frequency_ratio: Annotated[float, bounded(at_least=1)] = (
        1.6  # largest ratio to the population's median, at equal Froude number
    )


class Data(Options, ABC):
    """Base class of the options of a data set."""

    knows_true_course: ClassVar[bool] = False
    """True if the true phase of the performances is known."""
    of_user: ClassVar[bool] = False
    """True for the user's own files; their figures omit the values published in the paper by default."""
    credit: ClassVar[str] = ""
    """Source and licence; captions repeat the text if the data require it."""
    in_light_archives: ClassVar[bool] = True
    """True if the licence allows figures of the data in light archives."""

    name: str  # name of the data set and of its results folder
    walkers: CountOrAll = 0  # largest number of people; 0: all

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        require_bounds("data", self)

    def require(self, corpus: Corpus) -> None:
        """Raise InvalidInput, with ``data`` as location, if this data set has no clips of this kind."""

    @abstractmethod
    def request(self, corpus: Corpus, skeleton: Skeleton, seed: int, workers: int) -> Request:
        """Return the request for clips of one kind.

        Parameters
        ----------
        corpus : Corpus
        skeleton : Skeleton
            Mapping from points to joints, for files without a listed mapping.
        seed, workers : int

        Raises
        ------
        InvalidInput
            If there are no such clips, or the recordings are not available.
        """


class SyntheticPeople(Data):
    """Options of synthetic people: number, duration and noise."""

    knows_true_course: ClassVar[bool] = True

    population: Number = 80  # number of people
    populations: Annotated[int, bounded(at_least=0, at_most=1000)] = (
        0  # number of further populations, for intervals; 0: none
    )
    male_share: Share = 0.4  # share of men; the papers have 32 men of 80
    duration_s: Seconds = 8.0  # duration of each walk
    frame_rate_hz: FrameRate = 120.0  # of the recordings
    marker_noise_mm: NonNegative = 0.5  # standard deviation of each coordinate
    heading: Heading = Heading.steps  # heading of walks
    offsets: Annotated[float, bounded(at_least=0, at_most=5)] = (
        1.0  # factor on the standard deviations of the offsets of joint angles
    )
    performances: SyntheticPerformances = SyntheticPerformances()
    clips: SyntheticClips = SyntheticClips()
