"""Data sets: sources of the walks, performances and varied clips.

`Data.request` turns the options of a data set into the request for a corpus, the clips of one kind.
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
    """Data set of synthetic people."""

    def request(self, corpus: Corpus, skeleton: Skeleton, seed: int, workers: int) -> Request:
        """Return the request from which the ingest stage makes clips of synthetic people."""
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
        streaming = partial(walks.streamed_walks, self, seed, workers) if corpus is WALKS else None
        return Request({**options, "seed": seed}, make, source.__name__, streaming)


class Cut(StrEnum):
    """Part of a recording that becomes a performance."""

    whole = "whole"
    """The complete recording."""
    cycles = "cycles"
    """The middle cycle of a steady walk."""


class NamedClips(Options):
    """Selection of recordings for one kind of clips."""

    sources: list[str] = []  # sources in the table; * for all
    action: str = ""  # action in the table, complete or up to a colon
    limit: CountOrAll = 0  # largest number of clips, or of people for walks; 0: all


class RecordedPerformances(NamedClips):
    """Selection of recordings for performances of an action."""

    cut: Cut = Cut.whole


class Recordings(Data):
    """Options that all data sets of recordings share."""

    steady: Steady = Steady()
    performances: RecordedPerformances = RecordedPerformances()
    clips: NamedClips = NamedClips()

    def named(self, corpus: Corpus) -> NamedClips:
        """Return the selection of recordings for one kind of clips."""
        selection: NamedClips = getattr(self, corpus.name)
        return selection

    @property
    def walks(self) -> NamedClips:
        """Selection of the recordings of walks."""
        return NamedClips(limit=self.walkers)

    def choose(self, corpus: Corpus, clips: list[Clip]) -> list[Clip]:
        """Select clips up to the limit: all walks of the first people, or other clips of people in alternation."""
        return (first_people if corpus is WALKS else in_turn)(clips, self.named(corpus).limit)

    def request_for(self, corpus: Corpus, clips: Sequence[Clip], workers: int, missing: Missing) -> Request:
        """Return the request from which the ingest stage makes clips of these recordings.

        `missing` applies to walks; other kinds of clips need all joints.
        """
        steady, selection = self.steady, self.performances
        cycles = selection.cut is Cut.cycles
        makers: dict[str, tuple[dict[str, Any], Callable[[], Clips]]] = {
            "walks": (
                {"steady": steady, "missing": missing.value},
                lambda: recorded.recorded_walks(clips, steady, workers, missing),
            ),
            "performances": (
                {"performances": selection, "steady": steady},
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
    """Data set of the public recordings listed in `data/sources.csv`."""

    sources: list[str]  # sources of walks in the table; * for all
    action: str = "walk"  # action of walks in the table
    table: str = "data/sources.csv"  # table of all files: source, subject, action, address, sha256
    raw: str = "data/raw"  # folder of downloaded files
    mirror: str = ""  # folders with copies of these files, separated by :, for files that raw lacks
    folders: list[str] = []  # folders of your own walks; each is a further source
    person: str = (
        "^([^_.]+)"  # for folders: regular expression for the file name; its first group is the person
    )
    skeletons: list[str] = []  # mappings in the skeleton column of the table
    same_person: list[list[str]] = []  # groups of subjects that are the same person

    @property
    def walks(self) -> NamedClips:
        """Selection of the recordings of walks."""
        return NamedClips(sources=self.sources, action=self.action, limit=self.walkers)

    @property
    def listing(self) -> Path:
        """Path of the table of recordings."""
        return listing_table(self.table)

    @property
    def mirrors(self) -> list[Path]:
        """Folders with copies of the recordings."""
        return mirror_folders(self.mirror)

    def require(self, corpus: Corpus) -> None:
        """Raise InvalidInput if no source is selected for this kind of clips."""
        if not self.named(corpus).sources:
            raise InvalidInput(
                f"the data set {self.name} has no {corpus.words}",
                "data",
                code="no_clips_of_this_kind",
                data=self.name,
                kind=corpus.name,
            )

    def request(self, corpus: Corpus, skeleton: Skeleton, seed: int, workers: int) -> Request:
        """Return the request for clips of the recordings in the table; unavailable recordings come last."""
        self.require(corpus)
        skeletons = {name: mappings.shipped()[name] for name in self.skeletons}
        listing = Listing(self.listing, Path(self.raw), self.mirrors, skeletons, self.same_person)
        named = self.named(corpus)
        present, absent = listed_clips(listing, named.sources, named.action)
        if corpus is WALKS:
            for folder in self.folders:  # each folder is a source
                name = Path(folder).resolve().name
                present += [
                    replace(clip, name=f"{name}/{clip.name}", person=f"{name}/{clip.person}")
                    for clip in folder_clips(folder, "**/*", self.person, source=name)
                ]
        return self.request_for(corpus, self.choose(corpus, present) + absent, workers, skeleton.missing)


BY_FOLDER = "^(.+?)/"
"""Pattern for the option `data.person` if each person has a folder."""
WHOSE = f"'{BY_FOLDER}' if each folder is of one person, '([^/_.]+)[^/]*$' if all files are of one person"
"""Advice on the option `data.person` if several folders have files with the same name."""


class FolderData(Recordings):
    """Data set of the user's own files."""

    of_user = True

    path: str = ""  # folder of files
    pattern: str = "**/*"  # pattern of the file names, below the folder
    person: str = "^([^_.]+)"  # regular expression for the file name; its first group is the person
    frame_rate_hz: NonNegative = (
        0.0  # for files that do not state it (AMC: 120, CSV without time); 0: not given
    )
    units: str = ""  # for files that do not state it: mm, cm, m, in
    subject: str = ""  # person in files with several people: prefix of the point names, or a number from 1
    up: UpAxis = UpAxis.auto  # axis that points up: x, y, z, -x, -y, -z; auto: inferred from the upright body

    def request(self, corpus: Corpus, skeleton: Skeleton, seed: int, workers: int) -> Request:
        """Return the request for clips of the files in the folder and its subfolders."""
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
        first_by_name: dict[str, str] = {}
        for clip in (
            clips if self.person == FolderData.person else ()
        ):  # the default pattern would assign them to the same person
            if (first := first_by_name.setdefault(PurePosixPath(clip.name).name, clip.name)) != clip.name:
                raise InvalidInput(
                    "several folders have files with the same name: the person is unclear",
                    "data.person",
                    WHOSE,
                    f"{first}, {clip.name}",
                    code="unclear_person",
                    clips=[first, clip.name],
                )
        return self.request_for(corpus, self.choose(corpus, clips), workers, skeleton.missing)


def in_turn(clips: list[Clip], limit: int) -> list[Clip]:
    """Select at most `limit` clips from alternating people, in the original order; all clips if the limit is 0."""
    if limit <= 0 or limit >= len(clips):
        return clips
    people = [clip.person for clip in clips]
    by_turn = sorted(range(len(clips)), key=lambda k: people[:k].count(people[k]))
    return [clips[k] for k in sorted(by_turn[:limit])]


def first_people(clips: list[Clip], limit: int) -> list[Clip]:
    """Select all clips of the first `limit` people; all clips if the limit is 0."""
    people = list(dict.fromkeys(clip.person for clip in clips))
    selected = people[: limit if limit > 0 else None]
    return [clip for clip in clips if clip.person in selected]


DATA_SETS = {
    "synthetic": SyntheticData,
    "recorded": RecordedData,
    "folder": FolderData,
    "author": AuthorData,
}
"""Classes, by name, that the data sets in ``conf/data`` configure."""
