"""Data set of the BioMotion Lab: average walker, walkers along its attribute axes, mean woman and mean man.

The walkers are averages of many people, and no person can be held out of an average.  Figures that learn from people
therefore reject this data set.  The files are listed in ``data/sources.csv``, like all recordings, and are never
distributed with the project.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np

from pipeline import fetch
from pipeline.clips import varied
from pipeline.clips.kinds import VARIED, Corpus, Request, VariedClips
from pipeline.clips.options import Data, Skeleton
from pipeline.clips.usable import RawClip, report_row
from pipeline.formats import fourier_walks
from pipeline.formats.fourier_walks import AverageWalker, FourierWalk
from pipeline.ingestion.corpus import file_digest, listing_table, mirror_folders
from pipeline.validation import CountOrAll, InvalidInput, bounded

SOURCE = "author"
"""Name of the source of average walkers in reports on clips."""
AVERAGE = ("author/bmwalker.js", "author/bmwalker.json")
"""Paths of the average walker in the table of recordings; both files contain the same numbers.

The first available file is read.
"""
MEANS = ("author/walkers.mat",)
"""Path, in the table of recordings, of the file with the mean woman and the mean man."""
MEAN_PEOPLE = {"F": "mean_woman", "M": "mean_man"}
"""Name of the mean woman and of the mean man, by the name of the matrix in the file."""

RATE_HZ, SECONDS = 120.0, 6.8
"""Frame rate (Hz) and duration (s) of the clips; the duration is the same as for synthetic clips."""


@dataclass(frozen=True)
class ListedFile:
    """File of the table of recordings that is available on this machine.

    Attributes
    ----------
    path : Path
    sha256, terms : str
        Digest and licence terms from the table.
    """

    path: Path
    sha256: str
    terms: str


def find(
    paths: Sequence[str], *, table: str = "data/sources.csv", raw: str = "data/raw", mirror: str = ""
) -> ListedFile:
    """Return the first available of several files in the table of recordings, after verifying its sha256.

    Parameters
    ----------
    paths : sequence of str
        Paths in the table: `AVERAGE` or `MEANS`.
    table, raw, mirror : str
        Options of recorded data.

    Raises
    ------
    InvalidInput
        If no file is listed or available, or the digest of a file differs from the table.
    """
    listing = listing_table(table)
    rows = {row["path"]: row for row in fetch.read_sources(listing)}
    for row in (rows[path] for path in paths if path in rows):
        path = fetch.resolve(row, raw=Path(raw), mirror=mirror_folders(mirror))
        if path is None:
            continue
        if (received := file_digest(path)) != row["sha256"]:
            raise InvalidInput(
                "the file differs from the table of recordings: run `make data` to fetch it again",
                row["path"],
                f"sha256 {row['sha256'][:12]}…",
                f"{received[:12]}…",
                code="another_file",
            )
        return ListedFile(path, row["sha256"], row.get("terms", ""))
    raise InvalidInput(
        "the average walkers of the BioMotion Lab are not available on this machine: run `make data ARGS=author`"
        " to fetch them, or name their folder in data.mirror= or MOCAP_MIRROR",
        paths[0],
        code="not_fetched",
    )


def find_here(paths: Sequence[str], data: object) -> ListedFile:
    """Return the first available of several listed files, from the folders that a data set names or from a mirror."""
    named = {name: getattr(data, name) for name in ("raw", "mirror") if getattr(data, name, "")}
    return find(paths, **{"mirror": os.environ.get("MOCAP_MIRROR", ""), **named})


class AuthorData(Data):
    """Data set of walkers that are averages over many people, published by the BioMotion Lab."""

    in_light_archives: ClassVar[bool] = False
    credit: ClassVar[str] = (
        f"Sources: {fourier_walks.SOURCE}; walkers.mat of Jiangtang/Matrix-Computations, no terms stated."
    )

    table: str = "data/sources.csv"  # table of all files: source, subject, action, address, sha256
    raw: str = "data/raw"  # folder of downloaded files
    mirror: str = ""  # folders with copies of these files, separated by :, for files that raw lacks
    axis_value: Annotated[float, bounded(above=0, at_most=fourier_walks.MAX_VALUE)] = (
        3.0  # value of the walkers on each axis, on both sides of the average walker
    )
    limit: CountOrAll = 0  # largest number of clips; 0: all

    def require(self, corpus: Corpus) -> None:
        """Raise InvalidInput for figures that learn from people or compare people."""
        if corpus is not VARIED:
            raise InvalidInput(
                f"this figure needs {corpus.words} of several people, but the data set {self.name} has averages of many"
                " people, from which no person can be held out",
                "data",
                code="no_clips_of_this_kind",
                data=self.name,
                kind=corpus.name,
            )

    def request(self, corpus: Corpus, skeleton: Skeleton, seed: int, workers: int) -> Request:
        """Return the request from which the ingest stage makes clips of the average walkers."""
        self.require(corpus)
        where = {"table": self.table, "raw": self.raw, "mirror": self.mirror}
        average, means = find(AVERAGE, **where), find(MEANS, **where)
        options = {
            "author": {"average": average.sha256, "means": means.sha256},
            "axis_value": self.axis_value,
            "limit": self.limit,
        }

        def make() -> VariedClips:
            walks = walkers(
                fourier_walks.average_walker(average.path),
                fourier_walks.mean_walkers(means.path),
                self.axis_value,
            )
            selected = dict(list(walks.items())[: self.limit or None])
            digests = {name: (means if name in MEAN_PEOPLE.values() else average).sha256 for name in selected}
            return clips(selected, digests)

        return Request(options, make, __name__)


def walkers(
    average: AverageWalker, means: Mapping[str, FourierWalk], axis_value: float
) -> dict[str, FourierWalk]:
    """Return walks by name: the average walker, the mean woman, the mean man, and two walkers along each axis."""
    walks = {"average": average.at()}
    walks |= {MEAN_PEOPLE[name]: walk for name, walk in means.items() if name in MEAN_PEOPLE}
    for axis in average.axes:
        for value in (axis_value, -axis_value):
            walks[f"{axis}{value:+g}"] = average.at(**{axis: value})
    return walks


def clips(walks: Mapping[str, FourierWalk], digests: Mapping[str, str]) -> VariedClips:
    """Return clips of walkers on a treadmill who face +y; `digests` has the digest of each walker's file."""
    times = np.arange(round(SECONDS * RATE_HZ) + 1) / RATE_HZ
    prepared = []
    for name, walk in walks.items():
        person = name if name in MEAN_PEOPLE.values() else "average"
        row = report_row(varied.REPORT_COLUMNS, clip=name, person=person, source=SOURCE, action="walking")
        prepared.append(
            varied.longest_stretch(RawClip(row, fourier_walks.in_world(walk.positions(times)), RATE_HZ))
        )
    return varied.varied_of(prepared, digests)
