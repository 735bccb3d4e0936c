"""Average walkers of the second author's laboratory: the average walker, walkers along its axes, mean woman and man.

They are averages of many people, so that nobody can be left out of them: no figure that learns from people is made of
them.  The files are listed in ``data/sources.csv`` as all recordings are; they are never part of the project.
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
AVERAGE = ("author/bmwalker.js", "author/bmwalker.json")
"""Files of the table with the average walker, the same numbers in both; the first that is there is read."""
MEANS = ("author/walkers.mat",)
"""File with the mean woman and the mean man."""
MEAN_PEOPLE = {"F": "mean_woman", "M": "mean_man"}

RATE_HZ, SECONDS = 120.0, 6.8
"""Sampling of clips, and their length as of synthetic ones."""


@dataclass(frozen=True)
class ListedFile:
    """A file of the table that is on this machine, as listed.

    Attributes
    ----------
    path : Path
    sha256, terms : str
        As the table has them.
    """

    path: Path
    sha256: str
    terms: str


def find(
    among: Sequence[str], *, table: str = "data/sources.csv", raw: str = "data/raw", mirror: str = ""
) -> ListedFile:
    """Return the first of some files of the table that is on this machine, verified by its sha256.

    Parameters
    ----------
    among : sequence of str
        Paths as the table has them: `AVERAGE` or `MEANS`.
    table, raw, mirror : str
        As the options of recorded data.

    Raises
    ------
    InvalidInput
        If none is listed or on this machine, or one has another content than the table says.
    """
    listing = listing_table(table)
    rows = {row["path"]: row for row in fetch.read_sources(listing)}
    for row in (rows[path] for path in among if path in rows):
        path = fetch.resolve(row, raw=Path(raw), mirror=mirror_folders(mirror))
        if path is None:
            continue
        if (received := file_digest(path)) != row["sha256"]:
            raise InvalidInput(
                "the file is not the one that the table lists (`make data` fetches it again)",
                row["path"],
                f"sha256 {row['sha256'][:12]}…",
                f"{received[:12]}…",
                code="another_file",
            )
        return ListedFile(path, row["sha256"], row.get("terms", ""))
    raise InvalidInput(
        "the average walker of the second author's laboratory is not on this machine",
        among[0],
        "`make data ARGS=author` to fetch it, or MOCAP_MIRROR (data.mirror=) naming a folder that has it",
        code="not_fetched",
    )


def find_here(among: Sequence[str], data: object) -> ListedFile:
    """Return one of the files as `find` does, where a data set reads its own: folders of the mirror if it names any."""
    named = {name: getattr(data, name) for name in ("raw", "mirror") if getattr(data, name, "")}
    return find(among, **{"mirror": os.environ.get("MOCAP_MIRROR", ""), **named})


class AuthorData(Data):
    """Averages of many people that the second author's laboratory has published."""

    in_light_archives: ClassVar[bool] = False
    credit: ClassVar[str] = (
        f"Sources: {fourier_walks.SOURCE}; walkers.mat of Jiangtang/Matrix-Computations, no terms stated."
    )

    table: str = "data/sources.csv"  # of all files: source, subject, action, address, sha256
    raw: str = "data/raw"  # folder of downloaded files
    mirror: str = ""  # folders that hold the same files, with : between them; read where raw lacks one
    axis_value: Annotated[float, bounded(above=0, at_most=fourier_walks.MAX_VALUE)] = (
        3.0  # of walkers along each axis, on both sides of the average walker
    )
    limit: CountOrAll = 0  # at most so many clips; 0: all

    def require(self, corpus: Corpus) -> None:
        """Raise InvalidInput for figures that learn from people, or compare them."""
        if corpus is not VARIED:
            raise InvalidInput(
                f"this figure needs many people's {corpus.words}, and the data set {self.name} holds averages of many"
                " people, of whom nobody can be left out",
                "data",
                code="no_clips_of_this_kind",
                data=self.name,
                kind=corpus.name,
            )

    def request(self, corpus: Corpus, skeleton: Skeleton, seed: int, workers: int) -> Request:
        """Return the request for clips of the walkers."""
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
            chosen = dict(list(walks.items())[: self.limit or None])
            digests = {name: (means if name in MEAN_PEOPLE.values() else average).sha256 for name in chosen}
            return clips(chosen, digests)

        return Request(options, make, __name__)


def walkers(
    average: AverageWalker, means: Mapping[str, FourierWalk], axis_value: float
) -> dict[str, FourierWalk]:
    """Return the average walker, the mean woman and man, and two walkers along each axis, by name."""
    found = {"average": average.at()}
    found |= {MEAN_PEOPLE[name]: walk for name, walk in means.items() if name in MEAN_PEOPLE}
    for axis in average.axes:
        for value in (axis_value, -axis_value):
            found[f"{axis}{value:+g}"] = average.at(**{axis: value})
    return found


def clips(walks: Mapping[str, FourierWalk], digests: Mapping[str, str]) -> VariedClips:
    """Return walkers walking on the spot, forwards along +y, as clips; `digests` are those of their files."""
    times = np.arange(round(SECONDS * RATE_HZ) + 1) / RATE_HZ
    made = []
    for name, walk in walks.items():
        person = name if name in MEAN_PEOPLE.values() else "average"
        row = report_row(varied.REPORT_COLUMNS, clip=name, person=person, source=SOURCE, action="walking")
        made.append(
            varied.longest_stretch(RawClip(row, fourier_walks.in_world(walk.positions(times)), RATE_HZ))
        )
    return varied.varied_of(made, digests)
