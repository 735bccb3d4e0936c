"""Data sets: where clips of each kind come from.

A data set names a corpus for each kind of clips; `Data.request` turns its options into the request for one of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path, PurePosixPath
from types import ModuleType
from typing import Any

from pipeline import mappings
from pipeline.clips import performances, varied, walks
from pipeline.clips.kinds import WALKS, Clips, Corpus, Request
from pipeline.clips.options import Data, Missing, Skeleton, Steady, SyntheticPeople
from pipeline.ingestion import recorded
from pipeline.ingestion.author import AuthorData
from pipeline.ingestion.corpus import (
    Clip,
    Listing,
    folder_clips,
    listed_clips,
    listing_table,
    mirror_folders,
)
from pipeline.skeleton.source_mapping import UpAxis
from pipeline.validation import CountOrAll, InvalidInput, NonNegative, Options


class SyntheticData(SyntheticPeople):
    """Synthetic people."""

    def request(self, corpus: Corpus, skeleton: Skeleton, seed: int, workers: int) -> Request:
        """Return the request for synthetic people."""
        others = ("performances", "clips", "populations")
        alone = {name: value for name, value in vars(self).items() if name not in others}
        makers: dict[str, tuple[dict[str, Any], Callable[[], Clips], ModuleType]] = {
            "walks": ({"data": alone}, lambda: walks.synthetic_walks(self, seed, workers), walks),
            "performances": (
                {"performances": self.performances},
                lambda: performances.synthetic_performances(self.performances, seed),
                performances,
            ),
            "clips": ({"clips": self.clips}, lambda: varied.synthetic_clips(self.clips, seed), varied),
        }
        options, make, source = makers[corpus.name]
        letting_go = partial(walks.walks_let_go, self, seed, workers) if corpus is WALKS else None
        return Request({**options, "seed": seed}, make, source.__name__, letting_go)


class Cut(StrEnum):
    """Which part of a recording is one performance."""

    whole = "whole"
    """The recording."""
    cycles = "cycles"
    """The middle cycle of a steady walk."""


class NamedClips(Options):
    """Which recordings hold clips of one kind."""

    sources: list[str] = []  # of the table; * stands for all
    action: str = ""  # beginning of the table's action, or the whole of it
    limit: CountOrAll = 0  # at most so many clips, of walks so many people; 0: all


class RecordedPerformances(NamedClips):
    """Which recordings hold performances of one action."""

    cut: Cut = Cut.whole


class Recordings(Data):
    """Options of every data set of recordings."""

    steady: Steady = Steady()
    performances: RecordedPerformances = RecordedPerformances()
    clips: NamedClips = NamedClips()

    def named(self, corpus: Corpus) -> NamedClips:
        """Return which recordings hold clips of one kind."""
        found: NamedClips = getattr(self, corpus.name)
        return found

    @property
    def walks(self) -> NamedClips:
        """Which recordings hold walks."""
        return NamedClips(limit=self.walkers)

    def choose(self, corpus: Corpus, clips: list[Clip]) -> list[Clip]:
        """Return the clips of so many people, of walks, or so many clips, people taking turns, as are asked for."""
        return (first_people if corpus is WALKS else in_turn)(clips, self.named(corpus).limit)

    def request_for(self, corpus: Corpus, clips: Sequence[Clip], workers: int, missing: Missing) -> Request:
        """Return the request for these recordings; `missing` is for walks, of the other kinds all joints are needed."""
        steady, wanted = self.steady, self.performances
        cycles = wanted.cut is Cut.cycles
        makers: dict[str, tuple[dict[str, Any], Callable[[], Clips]]] = {
            "walks": (
                {"steady": steady, "missing": missing.value},
                lambda: recorded.recorded_walks(clips, steady, workers, missing),
            ),
            "performances": (
                {"performances": wanted, "steady": steady},
                lambda: recorded.recorded_performances(clips, steady, workers, cycles=cycles),
            ),
            "clips": (
                {"gap_s": steady.gap_s},
                lambda: recorded.recorded_clips(clips, steady.gap_s, workers),
            ),
        }
        options, make = makers[corpus.name]
        return Request({**options, "clips": [clip.identity for clip in clips]}, make, recorded.__name__)


class RecordedData(Recordings):
    """Public recordings listed in `data/sources.csv`."""

    sources: list[str]  # of walks; * stands for all
    action: str = "walk"  # of walks, as the table has it
    table: str = "data/sources.csv"  # of all files: source, subject, action, address, sha256
    raw: str = "data/raw"  # folder of downloaded files
    mirror: str = ""  # folders that hold the same files, with : between them; read where raw lacks one
    folders: list[str] = []  # of your own walks: a further source each
    person: str = (
        "^([^_.]+)"  # in folders: regular expression on the file's name; its first group names the person
    )
    skeletons: list[str] = []  # mappings of the table's skeleton column
    same_person: list[list[str]] = []  # subjects that are one person

    @property
    def walks(self) -> NamedClips:
        """Which recordings hold walks."""
        return NamedClips(sources=self.sources, action=self.action, limit=self.walkers)

    @property
    def listing(self) -> Path:
        """Return the table of recordings."""
        return listing_table(self.table)

    @property
    def mirrors(self) -> list[Path]:
        """Return the folders of the mirror."""
        return mirror_folders(self.mirror)

    def require(self, corpus: Corpus) -> None:
        """Raise InvalidInput if no source is named for this kind of clips."""
        if not self.named(corpus).sources:
            raise InvalidInput(
                f"the data set {self.name} holds no {corpus.words}",
                "data",
                code="no_clips_of_this_kind",
                data=self.name,
                kind=corpus.name,
            )

    def request(self, corpus: Corpus, skeleton: Skeleton, seed: int, workers: int) -> Request:
        """Return the request for the recordings of the table, those that are not on this machine last."""
        self.require(corpus)
        known = {name: mappings.shipped()[name] for name in self.skeletons}
        listing = Listing(self.listing, Path(self.raw), self.mirrors, known, self.same_person)
        named = self.named(corpus)
        present, absent = listed_clips(listing, named.sources, named.action)
        if corpus is WALKS:
            for folder in self.folders:  # each a source
                name = Path(folder).resolve().name
                present += [
                    replace(clip, name=f"{name}/{clip.name}", person=f"{name}/{clip.person}")
                    for clip in folder_clips(folder, "**/*", self.person, source=name)
                ]
        return self.request_for(corpus, self.choose(corpus, present) + absent, workers, skeleton.missing)


BY_FOLDER = "^(.+?)/"
"""Pattern of `FolderData.person`, if each folder is a person's."""
WHOSE = f"'{BY_FOLDER}' if each folder is a person's, '([^/_.]+)[^/]*$' if they are of one person"
"""What `FolderData.person` can be, where files have one name."""


class FolderData(Recordings):
    """The user's own files."""

    path: str = ""  # folder of files
    pattern: str = "**/*"  # of their names, below the folder
    person: str = "^([^_.]+)"  # regular expression on the file's name; its first group names the person
    frame_rate_hz: NonNegative = (
        0.0  # for files that do not say (AMC: 120, CSV without time); 0: the file's own
    )
    units: str = ""  # for files that do not say: mm, cm, m, in
    subject: str = (
        ""  # who, in files of several people: the beginning of the points' names, or a number from 1
    )
    up: UpAxis = (
        UpAxis.auto
    )  # axis that points up: x, y, z, -x, -y, -z; auto: the one along which joints stand

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
            up=self.up,
        )
        known: dict[str, str] = {}
        for clip in (
            clips if self.person == FolderData.person else ()
        ):  # which would take them for one person's
            if (first := known.setdefault(PurePosixPath(clip.name).name, clip.name)) != clip.name:
                raise InvalidInput(
                    "files of one name in several folders: whose they are is not known",
                    "data.person",
                    WHOSE,
                    f"{first}, {clip.name}",
                    code="unclear_person",
                    clips=[first, clip.name],
                )
        return self.request_for(corpus, self.choose(corpus, clips), workers, skeleton.missing)


def in_turn(clips: list[Clip], limit: int) -> list[Clip]:
    """Return at most `limit` clips, one from each person in turn, in the order given; all if the limit is 0."""
    if limit <= 0 or limit >= len(clips):
        return clips
    people = [clip.person for clip in clips]
    by_turn = sorted(range(len(clips)), key=lambda k: people[:k].count(people[k]))
    return [clips[k] for k in sorted(by_turn[:limit])]


def first_people(clips: list[Clip], limit: int) -> list[Clip]:
    """Return the clips of the first `limit` people; all if the limit is 0."""
    people = list(dict.fromkeys(clip.person for clip in clips))
    chosen = people[: limit if limit > 0 else None]
    return [clip for clip in clips if clip.person in chosen]


DATA_SETS = {
    "synthetic": SyntheticData,
    "recorded": RecordedData,
    "folder": FolderData,
    "author": AuthorData,
}
"""What the data sets of ``conf/data`` extend."""
