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
"""Type of an option that states a number of synthetic people or clips."""
Seconds = Annotated[float, bounded(above=0, at_most=3600)]
FrameRate = Annotated[float, bounded(above=0, at_most=2000)]
"""Type of an option that states a frame rate, Hz."""


class Locomotion(StrEnum):
    """Kind of walking: on a treadmill or overground, or detected from the motion."""

    auto = "auto"
    overground = "overground"
    treadmill = "treadmill"


class HorizontalPath(StrEnum):
    """Model of a walker's horizontal path, which is subtracted from the walk."""

    cubic = "cubic"
    moving_average = "moving_average"


class Missing(StrEnum):
    """Treatment of joints that were not measured in a walk."""

    estimate = "estimate"
    """Missing joints are estimated from the measured joints, marked as estimates, and excluded from errors."""
    drop = "drop"
    """A joint that is missing in any of the walks is excluded from all walks."""


class Skeleton(Options):
    """Options of the mapping from the points in a user's files to the joints of the skeleton."""

    mapping: str = "walker15"  # a shipped mapping, auto, or a file.yaml
    missing: Missing = Missing.estimate


class Heading(StrEnum):
    """Definition of the walking direction, which is rotated to +y."""

    steps = "steps"
    """Main horizontal direction of the vector from the right to the left ankle."""
    path = "path"
    """Direction of the path; for a walk on a treadmill, the direction that the hips face."""


class SyntheticPerformances(Options):
    """Options of synthetic bending to the floor, with known timing of each performance [mozerov2006 section 4]."""

    performances: Number = 40  # number of performances
    subjects: Number = 20  # number of people
    frames_mean: Annotated[float, bounded(above=0, at_most=100_000)] = 100.0  # mean length, frames
    frame_rate_hz: FrameRate = 30.0  # of the recordings
    rate_spread: NonNegative = 0.3  # standard deviation of the logarithm of the rate
    marker_noise_mm: NonNegative = 0.5  # standard deviation of each coordinate
    limit: CountOrAll = 0  # largest number of performances; 0: all


class SyntheticClips(Options):
    """Options of synthetic clips of three kinds: walking, bending, and smooth random joint angles (park2011)."""

    clips: Number = 24  # number of clips; half of them are in figure 3c
    seconds: Seconds = 6.8  # length of each, s
    frame_rate_hz: FrameRate = 30.0  # of the recordings
    bandwidth: Count = 10  # number of cosines of the smooth joint angles, over the whole clip
    limit: CountOrAll = 0  # largest number of clips; 0: all


class Steady(Options):
    """Criteria for a steady walk, and for a walk that two harmonics describe well."""

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
    """True if the true phase of each frame is known, as for synthetic performances."""
    of_user: ClassVar[bool] = False
    """True for files of the user, whose figures do not show published values by default."""
    credit: ClassVar[str] = ""
    """Source and licence of the data, which captions repeat if the data require it."""
    in_light_archives: ClassVar[bool] = True
    """True if the licence allows figures of the data in light archives, which contain no recorded motion."""

    name: str  # name of the data set and of its results folder
    walkers: CountOrAll = 0  # largest number of people; 0: all

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        require_bounds("data", self)

    def require(self, corpus: Corpus) -> None:
        """Raise InvalidInput, with ``data`` as location, if the data set has no clips of the given kind."""

    @abstractmethod
    def request(self, corpus: Corpus, skeleton: Skeleton, seed: int, workers: int) -> Request:
        """Return the request for the clips of one kind, which the ingest stage computes.

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
    """Options of the synthetic walkers: number, duration and marker noise."""

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
