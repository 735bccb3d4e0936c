"""Bootstrap replicates of tables, defined by the weight of each person, clip or population.

A table with a column ``population`` contains several synthetic populations, and a replicate is one of them.  A table
with a column ``person`` is resampled by person: all rows of a person stay together.  A table with only a column
``clip`` is resampled by the person of each clip, which ``table_ingest`` of its figure gives, otherwise by clip.

The table ``X_populations`` or ``X_people`` contains the rows of ``X`` before they are averaged (for `table`:
``table_populations``, ``table_people``), and replaces it in replicates.  ``X_draws``, with a column ``draw``, is ``X``
of resampled people, for numbers that do not follow from rows of single people.
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
"""Name of the standard deviation in calls of `aggregate`."""

INGEST = "table_ingest"
"""Name of the published table that lists the clips from which a figure was computed."""

MAX_LEFT_OUT = 500
"""Largest number of jackknife replicates; a replicate leaves out one cluster or a group of clusters.

With more clusters, each replicate leaves a group out; the acceleration is the same on average.
"""

PERCENT = f"{100.0 * bootstrap.LEVEL:g} %"
"""Confidence level of published intervals as text, with a per cent sign."""

OVER_PEOPLE = f"{PERCENT} intervals over people"


def interval_words(count: int, *, of: str = "mean", over: str = "people", bands: str = "Bands") -> str:
    """Return the sentence of a caption that explains the bands around a mean or a median.

    Parameters
    ----------
    count : int
        Number of people or clips that are resampled; a single one has no interval.
    of, over : str
        Statistic, and resampled units in the plural.
    bands : str
        Name of the bands in the caption.

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
    """Table with bootstrap weights for its rows in B replicates.

    Attributes
    ----------
    frame : DataFrame
        Rows that are resampled.
    cluster : (n,) int
        Cluster of each row.
    weights : (B, C)
        Number of times that each replicate contains each cluster.
    published : DataFrame
        Published form of the table.
    """

    frame: pd.DataFrame
    cluster: np.ndarray
    weights: np.ndarray
    published: pd.DataFrame

    def drawn(self, replicate: int) -> pd.DataFrame:
        """Return the rows of one bootstrap replicate; a row is repeated as often as its weight states."""
        times = self.weights[replicate, self.cluster].astype(int)
        return self.frame.iloc[np.repeat(np.arange(len(self.frame)), times)]


@dataclass(frozen=True)
class Replicates:
    """Tables that are resampled together, so that a replicate has the same people in all tables.

    Attributes
    ----------
    kind : str
        Resampled units: `POPULATION`, `DRAW`, `PERSON` or `CLIP`.
    tables : mapping
        Tables by name; a table without replicates is unchanged.
    clusters : int
        Number of people, or of clips if their people are unknown; 0 for populations and draws.
    left_out : int
        Number of replicates at the end that leave out a cluster each, or a group of clusters if there are very many.
    size : int
        Number of replicates.
    """

    kind: str
    tables: Mapping[str, Replicated | pd.DataFrame]
    clusters: int
    left_out: int
    size: int


def replicate(names: Iterable[str], tables: Mapping[str, pd.DataFrame], seed: int = 0) -> Replicates | None:
    """Return tables whose bootstrap replicates have the same people in all tables.

    Parameters
    ----------
    names : iterable of str
        Tables of one claim.
    tables : mapping of str to DataFrame
        All tables.
    seed : int
        Seed of the draws.

    Returns
    -------
    Replicates or None
        None if no table has replicates, or those of two tables are of different kinds.
    """
    sources = {name: _rows_behind(name, tables) for name in names}
    kinds = {kind for kind, _ in sources.values() if kind}
    if len(kinds) != 1:
        return None
    (kind,) = kinds
    of_rows = {name: _labels(name, rows, kind, tables) for name, (k, rows) in sources.items() if k}
    labels = pd.Index(sorted(set().union(*(names for _, names in of_rows.values()))))
    if len(labels) < 2:
        return None
    clusters = len(labels) if kind in (PERSON, CLIP) else 0
    left_out = min(clusters, MAX_LEFT_OUT)
    weights = _weights(clusters, seed) if clusters else np.eye(len(labels))
    replicated = {
        name: Replicated(rows, labels.get_indexer(of_rows[name][1])[of_rows[name][0]], weights, tables[name])
        if kind
        else rows
        for name, (kind, rows) in sources.items()
    }
    return Replicates(kind, replicated, clusters, left_out, len(weights))


_INTERVALS = ContextVar("_INTERVALS", default=True)


@contextmanager
def without_intervals() -> Iterator[None]:
    """Context manager in which all confidence intervals are NaN, to save time if no interval is read."""
    before = _INTERVALS.set(False)
    try:
        yield
    finally:
        _INTERVALS.reset(before)


def interval_over_people(person: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the 95 % confidence interval (…) of the mean over people, from values (R, …) of R walks.

    All walks of a person are drawn together; NaN for a single person.
    """
    return interval_over_clusters(person, values, bootstrap.weighted_means)


_GROUPS_AT_A_TIME = 128

Statistic = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Type of a function of values, clusters and weights that computes a statistic in each replicate."""


def interval_over_clusters(
    labels: np.ndarray, values: np.ndarray, statistic: Statistic
) -> tuple[np.ndarray, np.ndarray]:
    """Return the 95 % confidence interval (…) of a mean or median over rows (R, …), resampled by person or clip.

    Parameters
    ----------
    labels : (R,)
        Person or clip of each row; all rows of a person or clip are drawn together.
    values : (R, …)
        Values of the rows, in any unit.
    statistic : callable
        Function that returns the value of each replicate, from values, cluster of each row and weights.

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
    """Return the number of copies (B + L, C) of each cluster in each bootstrap and jackknife replicate.

    Each of the last L replicates, at most `MAX_LEFT_OUT`, leaves out a cluster or a group of clusters.
    """
    left_out = min(clusters, MAX_LEFT_OUT)
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
    """Return a table with a row for each group of rows: the number of rows, statistics of columns and 95 % intervals.

    Parameters
    ----------
    rows : DataFrame
    by : sequence of str
        Columns that define the groups.
    columns : mapping of str to tuple
        Name → column and its statistic; `SD`: standard deviation, divisor n - 1, 0 for a single value.
    banded : iterable of str
        Names of the means and medians with 95 % intervals, ``<name>_low`` and ``<name>_high``.  All rows of a clip or
        person are drawn together; NaN for a single clip or person.
    cluster, count : str
        Column of clips or persons, and name of the column with the number of rows; empty for none.
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
    aggregations = {name: (column, "std" if how == SD else how) for name, (column, how) in columns.items()}
    aggregated = groups.agg(**counted, **aggregations)
    for name in (name for name, (_, how) in columns.items() if how == SD):
        aggregated[name] = aggregated[name].where(groups.size() > 1, 0.0)
    for name, of_groups in reversed(bands.items()):
        after = list(aggregated).index(name.rpartition("_")[0]) + 1
        aggregated.insert(after, name, of_groups)
    return aggregated.reset_index()


def _ends(
    rows: pd.DataFrame, group: pd.Series, names: list[str], cluster: str, statistic: Statistic
) -> np.ndarray:
    """Return the limits (2, G, K) of confidence intervals for statistics of K columns in G groups of rows."""
    values = rows[names].to_numpy(dtype=float)
    labels, _ = pd.factorize(rows[cluster], sort=True)
    number = group.fillna(-1).to_numpy(dtype=int)  # rows that lack a label are in no group
    count = np.bincount(number[number >= 0])
    in_groups = np.argsort(number, kind="stable")[len(rows) - count.sum() :]
    group_rows = np.split(in_groups, np.cumsum(count))[: len(count)]
    # Groups of the same people (nearly all are) are drawn together, in batches.
    same_people: dict[bytes, list[int]] = defaultdict(list)
    for at, rows_of_group in enumerate(group_rows):
        same_people[labels[rows_of_group].tobytes()].append(at)
    ends = np.empty((2, len(group_rows), len(names)))
    for of_same in same_people.values():
        for start in range(0, len(of_same), _GROUPS_AT_A_TIME):
            some = of_same[start : start + _GROUPS_AT_A_TIME]
            drawn = np.stack([values[group_rows[at]] for at in some], axis=1)
            ends[:, some] = interval_over_clusters(labels[group_rows[some[0]]], drawn, statistic)
    return ends


def _labels(
    name: str, rows: pd.DataFrame, kind: str, tables: Mapping[str, pd.DataFrame]
) -> tuple[np.ndarray, list[str]]:
    """Return the index (n,) of each row's person or clip in a list of names, and this list of names."""
    clips = tables.get(f"{name.split('/')[0]}/{INGEST}")
    codes, uniques = pd.factorize(rows[kind], use_na_sentinel=False)  # rows without a label get a number too
    names = [str(label) for label in uniques]
    if kind == CLIP and clips is not None and {"clip", "person"} <= set(clips):
        person = dict(zip(clips["clip"].astype(str), clips["person"].astype(str), strict=True))
        names = [person.get(clip, clip) for clip in names]
    return codes, names


def _rows_behind(name: str, tables: Mapping[str, pd.DataFrame]) -> tuple[str, pd.DataFrame]:
    """Return the name of the column that defines clusters, or an empty string, and the rows to resample."""
    stem = name if "/" in name else f"{name}/table"
    stem = stem.removesuffix("_people")
    for candidate in (f"{stem}_populations", f"{stem}_draws", f"{stem}_people", name):
        rows = tables.get(candidate)
        for kind in (POPULATION, DRAW, PERSON, CLIP):
            if rows is not None and kind in rows.columns and len(rows):
                return kind, rows
    return "", tables[name]
