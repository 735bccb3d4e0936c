"""Data sets: where clips of each kind come from.

A data set names a corpus for each kind of clips; `Data.request` turns its options into the request for one of them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import ClassVar

from pipeline import mappings
from pipeline.clips.corpus import Clip, Listing, first_people, folder_clips, in_turn, listed_clips
from pipeline.clips.kinds import Corpus, Request
from pipeline.resources import DATA
from pipeline.validation import InvalidInput, require_range


class Cut(StrEnum):
    """Which part of a recording is one performance."""

    whole = "whole"
    """The recording."""
    cycles = "cycles"
    """The middle cycle of a steady walk."""


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


@dataclass(kw_only=True)
class Skeleton:
    """How the points of the user's files become joints."""

    mapping: str = "walker15"  # one that ships, auto, or a file.yaml
    missing: Missing = Missing.estimate


class Heading(StrEnum):
    """Which direction of a walk becomes +y."""

    steps = "steps"
    """That of the steps: the main horizontal axis of the left minus the right ankle."""
    path = "path"
    """That of the path; on a treadmill, where the hips face."""


@dataclass(kw_only=True)
class NamedClips:
    """Which recordings hold clips of one kind."""

    sources: list[str] = field(default_factory=list)
    action: str = ""  # beginning of the table's action, or the whole of it
    limit: int = 0  # at most so many clips; 0: all

    def choose(self, clips: list[Clip]) -> list[Clip]:
        """Return at most `limit` clips, people taking turns."""
        return in_turn(clips, self.limit)


@dataclass(kw_only=True)
class NamedWalks(NamedClips):
    """Which recordings hold walks; the limit is one of people."""

    def choose(self, clips: list[Clip]) -> list[Clip]:
        """Return the clips of the first `limit` people."""
        return first_people(clips, self.limit)


@dataclass(kw_only=True)
class RecordedPerformances(NamedClips):
    """Which recordings hold performances of one action."""

    cut: Cut = Cut.whole


@dataclass(kw_only=True)
class SyntheticPerformances:
    """Bending to the floor, each performance with its own, known rate [mozerov2006 section 4]."""

    performances: int = 40
    subjects: int = 5
    frames_mean: float = 100.0
    frame_rate_hz: float = 30.0
    rate_spread: float = 0.3
    marker_noise_mm: float = 0.5
    limit: int = 0  # at most so many performances; 0: all


@dataclass(kw_only=True)
class SyntheticClips:
    """Walking, bending and bodies of smooth angles in turn: motion with a known answer (park2011)."""

    clips: int = 12
    seconds: float = 6.8
    frame_rate_hz: float = 30.0
    bandwidth: int = 10  # cosines of the angles of the smooth bodies, over the whole clip
    limit: int = 0  # at most so many clips; 0: all


@dataclass(kw_only=True)
class Steady:
    """Criteria of steady walking, and of a usable Fourier series of it."""

    locomotion: Locomotion = Locomotion.auto
    path: HorizontalPath = HorizontalPath.cubic
    heading: Heading = Heading.steps
    speed_band: float = 0.35  # relative to the median speed; narrower bands are tried first
    turn_deg_s: float = 45.0
    cycles: float = 1.0
    gap_s: float = 0.1  # longer gaps end a stretch, shorter ones are bridged
    fundamental_share: float = 0.6
    residual_share: float = 0.15
    frequency_ratio: float = 1.6  # to the population's median, at equal Froude number


@dataclass(kw_only=True)
class Data(ABC):
    """Where clips come from."""

    knows_true_course: ClassVar[bool] = False
    """Whether the true phase of the performances is known."""

    name: str
    walkers: int = 0  # at most so many people; 0: all

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        require_range("data.walkers", self.walkers, at_least=0)

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


@dataclass(kw_only=True)
class SyntheticData(Data):
    """Synthetic people."""

    knows_true_course: ClassVar[bool] = True

    population: int = 80
    populations: int = 0  # further populations, which give results their intervals; 0: none
    male_share: float = 0.4  # the papers' 32 men of 80
    duration_s: float = 8.0
    frame_rate_hz: float = 120.0
    marker_noise_mm: float = 0.5
    heading: Heading = Heading.steps  # of walks
    offsets: float = (
        1.0  # factor on how far people are assumed to differ by constant offsets of their joint angles
    )
    performances: SyntheticPerformances = field(default_factory=SyntheticPerformances)
    clips: SyntheticClips = field(default_factory=SyntheticClips)

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        require_range("data.population", self.population, at_least=1, at_most=10_000)
        require_range("data.populations", self.populations, at_least=0, at_most=1000)
        require_range("data.offsets", self.offsets, at_least=0, at_most=100)
        require_range("data.duration_s", self.duration_s, above=0, at_most=3600)
        require_range("data.frame_rate_hz", self.frame_rate_hz, above=0, at_most=2000)
        require_range("data.clips.clips", self.clips.clips, at_least=1, at_most=10_000)
        require_range("data.clips.seconds", self.clips.seconds, above=0, at_most=3600)
        require_range("data.clips.frame_rate_hz", self.clips.frame_rate_hz, above=0, at_most=2000)
        bends = self.performances
        require_range("data.performances.performances", bends.performances, at_least=1, at_most=10_000)
        require_range("data.performances.frames_mean", bends.frames_mean, above=0, at_most=100_000)

    def request(self, corpus: Corpus, skeleton: Skeleton, seed: int, workers: int) -> Request:
        """Return the request for synthetic people."""
        return corpus.synthetic(self, seed, workers)


@dataclass(kw_only=True)
class Recordings(Data):
    """Options of every data set of recordings."""

    steady: Steady = field(default_factory=Steady)
    performances: RecordedPerformances = field(default_factory=RecordedPerformances)
    clips: NamedClips = field(default_factory=NamedClips)

    def named(self, corpus: Corpus) -> NamedClips:
        """Return which recordings hold clips of one kind."""
        return {"walks": self.walks, "performances": self.performances, "clips": self.clips}[corpus.name]

    @property
    def walks(self) -> NamedWalks:
        """Which recordings hold walks."""
        return NamedWalks(limit=self.walkers)


@dataclass(kw_only=True)
class RecordedData(Recordings):
    """Public recordings listed in `data/sources.csv`."""

    sources: list[str]  # of walks
    action: str = "walk"
    table: str = "data/sources.csv"
    raw: str = "data/raw"
    mirror: str = ""  # a folder that holds the same files; read where raw lacks one
    skeletons: list[str] = field(default_factory=list)  # mappings of the table's skeleton column
    same_person: list[list[str]] = field(default_factory=list)  # subjects that are one person

    @property
    def walks(self) -> NamedWalks:
        """Which recordings hold walks."""
        return NamedWalks(sources=self.sources, action=self.action, limit=self.walkers)

    @property
    def listing(self) -> Path:
        """Return the table of recordings: the one named, or where there is none, the one of the package."""
        named = Path(self.table)
        return named if named.is_file() or named.parent != Path("data") else DATA / named.name

    def require(self, corpus: Corpus) -> None:
        """Raise InvalidInput if no source is named for this kind of clips."""
        if not self.named(corpus).sources:
            raise InvalidInput(f"the data set {self.name} holds no {corpus.words}", where="data")

    def request(self, corpus: Corpus, skeleton: Skeleton, seed: int, workers: int) -> Request:
        """Return the request for the recordings of the table, those that are not on this machine last."""
        self.require(corpus)
        mirror = Path(self.mirror) if self.mirror else None
        known = {name: mappings.shipped()[name] for name in self.skeletons}
        listing = Listing(self.listing, Path(self.raw), mirror, known, self.same_person)
        named = self.named(corpus)
        present, absent = listed_clips(listing, named.sources, named.action)
        return corpus.recorded(self, named.choose(present) + absent, workers, skeleton.missing.value)


@dataclass(kw_only=True)
class FolderData(Recordings):
    """The user's own files."""

    path: str = ""
    pattern: str = "**/*"
    person: str = "^([^_.]+)"  # regular expression on the file's name; its first group names the person
    frame_rate_hz: float = 0.0  # for files that do not say (AMC: 120, CSV without time); 0: the file's own
    units: str = ""  # for files that do not say: mm, cm, m, in
    subject: str = (
        ""  # who, in files of several people: the beginning of the points' names, or a number from 1
    )

    def request(self, corpus: Corpus, skeleton: Skeleton, seed: int, workers: int) -> Request:
        """Return the request for the files below the folder."""
        clips = folder_clips(
            self.path,
            self.pattern,
            self.person,
            skeleton=mappings.chosen(skeleton.mapping),
            frame_rate_hz=self.frame_rate_hz,
            units=self.units,
            subject=self.subject,
        )
        return corpus.recorded(self, self.named(corpus).choose(clips), workers, skeleton.missing.value)
