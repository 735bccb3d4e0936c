"""Tables whose rows are drawn again: how often every replicate counts each person, or each population.

A table with a column ``population`` holds several synthetic populations, and a replicate is one of them.  Otherwise one
with a column ``person`` is resampled by person, all rows of a person together, and one with neither but a column
``clip`` by whose clip it is, as ``table_ingest`` of its figure says, and by clip if it does not: limbs, trials and
cameras of a person together.  The table ``X_populations`` or ``X_people`` holds the
rows of ``X`` before they are averaged (`table`: ``table_populations``, ``table_people``), and takes its place in
replicates.  ``X_draws``, with a column ``draw``, is ``X`` of people drawn again, for numbers that do not follow from
rows of single people.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd

from pipeline.core import bootstrap
from pipeline.seeding import derive_generator

POPULATION, PERSON, DRAW, CLIP = "population", "person", "draw", "clip"

SD = "sd"
"""How `aggregate` makes a standard deviation."""

INGEST = "table_ingest"
"""Table of the clips that a figure rests on."""


MOST_LEFT_OUT = 500
"""Replicates with clusters left out; groups of equal size give the same acceleration as single clusters, on average."""

PERCENT = f"{100.0 * bootstrap.LEVEL:g} %"
"""Coverage of published intervals."""

OVER_PEOPLE = f"{PERCENT} intervals over people"


def interval_words(count: int, *, of: str = "mean", over: str = "people", bands: str = "Bands") -> str:
    """Return the sentence of a caption that says what a band around a mean or median is.

    Parameters
    ----------
    count : int
        People or clips that were drawn again; one alone has no interval.
    of, over : str
        The statistic, and what is drawn, in the plural.
    bands : str
        Which ones, as a caption calls them.

    Examples
    --------
    >>> interval_words(12, of="median", over="clips")
    'Bands: 95 % interval of the median over 12 clips.'
    """
    if count < 2:
        return f"No interval of the {of}: all is of one {'person' if over == 'people' else over[:-1]}."
    return f"{bands}: {PERCENT} interval of the {of} over {count} {over}."


@dataclass(frozen=True)
class Replicated:
    """A table in B replicates.

    Attributes
    ----------
    frame : DataFrame
        Rows that are drawn.
    cluster : (n,) int
        Cluster of each row.
    weights : (B, C)
        How often each replicate counts each cluster.
    published : DataFrame
        The table that it stands for, as it is published.
    """

    frame: pd.DataFrame
    cluster: np.ndarray
    weights: np.ndarray
    published: pd.DataFrame

    def drawn(self, replicate: int) -> pd.DataFrame:
        """Return the rows of one replicate, as often as it counts them."""
        times = self.weights[replicate, self.cluster].astype(int)
        return self.frame.iloc[np.repeat(np.arange(len(self.frame)), times)]


@dataclass(frozen=True)
class Replicates:
    """The tables of a claim in replicates that they share.

    Attributes
    ----------
    kind : str
        What is drawn: `POPULATION`, `DRAW`, `PERSON` or `CLIP`.
    tables : mapping
        Those without replicates of their own as they are.
    clusters : int
        People, or clips where it is not known whose they are; 0 of populations and draws.
    left_out : int
        So many replicates, the last ones, leave out a cluster each; of very many clusters, a group of them each.
    size : int
        Replicates.
    """

    kind: str
    tables: Mapping[str, Replicated | pd.DataFrame]
    clusters: int
    left_out: int
    size: int


def replicate(names: Iterable[str], tables: Mapping[str, pd.DataFrame], seed: int = 0) -> Replicates | None:
    """Return tables in replicates that they share.

    Parameters
    ----------
    names : iterable of str
        Tables of one claim.
    tables : mapping of str to DataFrame
        All tables.
    seed : int
        Of the draws.

    Returns
    -------
    Replicates or None
        None if no table has replicates, or those of two tables are of different kinds.
    """
    found = {name: _rows_behind(name, tables) for name in names}
    kinds = {kind for kind, _ in found.values() if kind}
    if len(kinds) != 1:
        return None
    (kind,) = kinds
    of_rows = {name: _labels(name, rows, kind, tables) for name, (k, rows) in found.items() if k}
    labels = pd.Index(sorted(set().union(*(names for _, names in of_rows.values()))))
    if len(labels) < 2:
        return None
    clusters = len(labels) if kind in (PERSON, CLIP) else 0
    left_out = min(clusters, MOST_LEFT_OUT)
    weights = _weights(clusters, seed) if clusters else np.eye(len(labels))
    made = {
        name: Replicated(rows, labels.get_indexer(of_rows[name][1])[of_rows[name][0]], weights, tables[name])
        if kind
        else rows
        for name, (kind, rows) in found.items()
    }
    return Replicates(kind, made, clusters, left_out, len(weights))


_INTERVALS = ContextVar("_INTERVALS", default=True)


@contextmanager
def without_intervals() -> Iterator[None]:
    """Make tables of which nobody reads the intervals: these are NaN."""
    before = _INTERVALS.set(False)
    try:
        yield
    finally:
        _INTERVALS.reset(before)


def interval_over_people(person: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the 95 % interval (…) of the mean over people, from values (R, …) of walks of persons (R,).

    All walks of a person are drawn together; NaN for a single person.
    """
    return interval_over_clusters(person, values, bootstrap.weighted_means)


_GROUPS_AT_A_TIME = 128

Statistic = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""`bootstrap.weighted_means` or `bootstrap.weighted_medians`."""


def interval_over_clusters(
    labels: np.ndarray, values: np.ndarray, statistic: Statistic
) -> tuple[np.ndarray, np.ndarray]:
    """Return the 95 % interval (…) of a mean or median over rows (R, …), drawn by people, or by clips.

    Parameters
    ----------
    labels : (R,)
        Person or clip of each row; all rows of one are drawn together.
    values : (R, …)
        In any unit.
    statistic : callable
        Value of each replicate, from values, cluster of each row and weights.

    Returns
    -------
    tuple of (…) float
        NaN where there is only one label, or one of the values is NaN.
    """
    names, cluster = np.unique(labels, return_inverse=True)
    if len(names) < 2 or not _INTERVALS.get():
        return np.full(values.shape[1:], np.nan), np.full(values.shape[1:], np.nan)
    low, high = bootstrap.percentile_interval(
        statistic(values, cluster, _weights(len(names))[: bootstrap.RESAMPLES])
    )
    unknown = np.isnan(values).any(axis=0)
    return np.where(unknown, np.nan, low), np.where(unknown, np.nan, high)


@lru_cache(maxsize=8)
def _weights(clusters: int, seed: int = 0) -> np.ndarray:
    """Return how often each replicate counts each cluster, (B + L, C), as floats: they are factors.

    The last ones, `MOST_LEFT_OUT` at most, are without each of the clusters, or of groups of them.
    """
    left_out = min(clusters, MOST_LEFT_OUT)
    weights = np.empty((bootstrap.RESAMPLES + left_out, clusters))
    weights[:-left_out] = bootstrap.resampling_weights(clusters, derive_generator(seed, "people"))
    weights[-left_out:] = np.arange(clusters) % left_out != np.arange(left_out)[:, None]
    return weights


def aggregate(
    rows: pd.DataFrame,
    by: Sequence[str],
    columns: Mapping[str, tuple[str, Any]],
    banded: Iterable[str],
    *,
    cluster: str = CLIP,
    count: str = "trials",
) -> pd.DataFrame:
    """Return a table over rows: how many there are, what is asked for of them, and intervals of means and medians.

    Parameters
    ----------
    rows : DataFrame
    by : sequence of str
        Columns that tell apart what is aggregated.
    columns : mapping of str to tuple
        Name → column that it is of, and how it is aggregated; `SD`: standard deviation, divisor n - 1, 0 of one value.
    banded : iterable of str
        Those means and medians that have 95 % intervals, ``<name>_low`` and ``<name>_high``: all rows of a clip, or
        person, are drawn together; NaN where there is only one.
    cluster, count : str
        Column of clips or persons, and name of the number of rows; empty for a table without it.
    """
    groups = rows.groupby(list(by))
    statistics = {"mean": bootstrap.weighted_means, "median": bootstrap.weighted_medians}
    bands: dict[str, Any] = {f"{name}_{end}": np.nan for name in banded for end in ("low", "high")}
    for how, statistic in statistics.items() if _INTERVALS.get() else ():
        if names := [name for name in banded if columns[name][1] == how]:
            ends = _ends(rows, groups.ngroup(), [columns[name][0] for name in names], cluster, statistic)
            for name, *of_groups in zip(names, *np.moveaxis(ends, -1, 1), strict=True):
                bands |= {f"{name}_low": of_groups[0], f"{name}_high": of_groups[1]}
    counted = {count: (by[0], "size")} if count else {}
    known = {name: (of, "std" if how == SD else how) for name, (of, how) in columns.items()}
    aggregated = groups.agg(**counted, **known)
    for name in (name for name, (_, how) in columns.items() if how == SD):
        aggregated[name] = aggregated[name].where(groups.size() > 1, 0.0)
    for name, of_groups in reversed(bands.items()):
        after = list(aggregated).index(name.rpartition("_")[0]) + 1
        aggregated.insert(after, name, of_groups)
    return aggregated.reset_index()


def _ends(
    rows: pd.DataFrame, group: pd.Series, names: list[str], cluster: str, statistic: Statistic
) -> np.ndarray:
    """Return the ends (2, G, K) of the intervals of K columns in each group of rows, numbered from 0."""
    values = rows[names].to_numpy(dtype=float)
    labels, _ = pd.factorize(rows[cluster], sort=True)
    number = group.fillna(-1).to_numpy(dtype=int)  # rows that lack a label are in no group
    count = np.bincount(number[number >= 0])
    in_groups = np.argsort(number, kind="stable")[len(rows) - count.sum() :]
    places = np.split(in_groups, np.cumsum(count))[: len(count)]
    # Groups of the same people, as nearly all are, are drawn together, a few at a time.
    alike: dict[bytes, list[int]] = defaultdict(list)
    for at, place in enumerate(places):
        alike[labels[place].tobytes()].append(at)
    ends = np.empty((2, len(places), len(names)))
    for of_same in alike.values():
        for start in range(0, len(of_same), _GROUPS_AT_A_TIME):
            some = of_same[start : start + _GROUPS_AT_A_TIME]
            drawn = np.stack([values[places[at]] for at in some], axis=1)
            ends[:, some] = interval_over_clusters(labels[places[some[0]]], drawn, statistic)
    return ends


def _labels(
    name: str, rows: pd.DataFrame, kind: str, tables: Mapping[str, pd.DataFrame]
) -> tuple[np.ndarray, list[str]]:
    """Return whose each row is, as numbers (n,) of labels, and the labels, some perhaps twice."""
    clips = tables.get(f"{name.split('/')[0]}/{INGEST}")
    codes, found = pd.factorize(rows[kind], use_na_sentinel=False)  # also of rows without one
    names = [str(label) for label in found]
    if kind == CLIP and clips is not None and {"clip", "person"} <= set(clips):
        person = dict(zip(clips["clip"].astype(str), clips["person"].astype(str), strict=True))
        names = [person.get(clip, clip) for clip in names]
    return codes, names


def _rows_behind(name: str, tables: Mapping[str, pd.DataFrame]) -> tuple[str, pd.DataFrame]:
    """Return the kind of the clusters of a table, empty if it has none, and the rows that are drawn."""
    stem = name if "/" in name else f"{name}/table"
    stem = stem.removesuffix("_people")
    for candidate in (f"{stem}_populations", f"{stem}_draws", f"{stem}_people", name):
        rows = tables.get(candidate)
        for kind in (POPULATION, DRAW, PERSON, CLIP):
            if rows is not None and kind in rows.columns and len(rows):
                return kind, rows
    return "", tables[name]
