"""The ledger of claims: verdicts from published tables, and ``claims.csv``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline import papers
from pipeline.clips import one_person
from pipeline.core import bootstrap
from pipeline.storage import tables
from pipeline.storage.sealed_folders import read_manifest
from pipeline.studies import evaluation
from pipeline.studies.replicated import DRAW, INGEST, POPULATION, Replicates, replicate
from pipeline.studies.rows import Number, rows_of
from pipeline.validation import InvalidInput

Tables = Mapping[str, Any]
"""Tables, or mappings of columns, by name: ``zhang2007_fig5`` is the figure's ``table.csv``, and
``zhang2007_fig5/table_walkers`` the ``table_walkers.csv`` beside it."""

SMOKE = "smoke"
"""Scale whose results decide nothing."""

LARGEST = 1e100
"""A replicate above says nothing: the third power of its distance would be no number."""
MOST_SILENT = 0.05
"""Share of the replicates that may have no value, for there to be an interval."""

SHARES = ("percent", "mean_percent", "percent_below", "larger", "smaller")
"""Measures that are shares of rows or of walkers, or the larger or smaller of such, by name."""

EXTREMES = ("largest", "smallest")
"""Measures whose value in people drawn again never lies beyond that of all people, by name."""


def judge(
    claims: Iterable[papers.Claim],
    made: Tables,
    data_name: str,
    *,
    measures: evaluation.Registry,
    smoke: bool = False,
    overridden: bool = False,
) -> list[papers.Verdict]:
    """Return one verdict per claim, in the order of the claims.

    Parameters
    ----------
    claims : iterable of Claim
    made : Tables
        Tables of the figures that are made.
    data_name : str
        Option of the data group, ``"synthetic"``, ``"optical"``…
    measures : Registry
        Measures of the claims, by name.
    smoke : bool
        Whether the figures are made at small scale, which decides nothing.
    overridden : bool
        Whether options differ from the presets'.

    Raises
    ------
    InvalidInput
        If a table lacks a column that a claim reads, or there is no such measure.
    """
    frames = {name: _frame(name, table) for name, table in made.items()}
    verdicts = []
    for claim in claims:
        if claim.measure:
            evaluation.check(claim.measure, measures, claim.name)
        if missing := [name for name in claim.tables if name not in frames]:
            why = f"figure {missing[0]} is not made yet"
            verdicts.append(papers.Verdict(claim, papers.Agreement.UNTESTABLE, why))
        else:
            found = _evidence(claim, frames, measures, interval=not smoke)
            verdicts.append(
                papers.judge(
                    claim,
                    found,
                    data_name,
                    lambda name: _number(papers.quantity(name), frames, measures),
                    smoke=smoke,
                    overridden=overridden,
                )
            )
    return verdicts


def _evidence(
    claim: papers.Claim,
    frames: Mapping[str, pd.DataFrame],
    measures: evaluation.Registry,
    *,
    interval: bool,
) -> papers.Evidence:
    """Return the value of a claim, that of its baseline and the paired gain of the one over the other."""
    people, doubt = _people(claim.tables, frames)
    doubt = doubt or _not_met(claim, frames, measures)
    if claim.measure is None or claim.kind is papers.Kind.CONDITION or not interval:
        return papers.Evidence(
            value=papers.Estimate(_number(claim, frames, measures)), people=people, doubt=doubt
        )
    drawn = replicate(claim.tables, frames)
    value, values = _measured(claim.measure, frames, drawn, measures)
    found = papers.Evidence(
        value=_beyond_the_seen(
            _estimate(value, values, drawn, people, extreme=claim.measure.name in EXTREMES),
            claim.measure,
            drawn,
        ),
        one_sample=_one_sample(claim, value, values, drawn),
        people=people,
        doubt=doubt,
        drawn=0 if drawn is None else drawn.clusters or (people or 0) * (drawn.kind == DRAW),
    )
    simpler = claim.of_baseline
    if simpler is None:
        return found
    nothing, nothings = (
        _measured(simpler, frames, drawn, measures)
        if isinstance(simpler, papers.Measure)
        else (simpler, simpler)
    )
    better = papers.gain(claim, nothing)
    return replace(
        found,
        baseline=_within_a_share(_estimate(nothing, nothings, drawn, people), simpler),
        gain=_estimate(better(value, nothing), better(values, nothings), drawn, people),
    )


def _measured(
    measure: papers.Measure,
    frames: Mapping[str, pd.DataFrame],
    drawn: Replicates | None,
    measures: evaluation.Registry,
) -> tuple[float, Number]:
    """Return the value of a measure, the mean of several populations if there are, and its replicates (B,) or NaN."""
    if drawn is None:
        return float(evaluation.evaluate(measure, measures, frames)), np.nan
    values = evaluation.evaluate(measure, measures, drawn.tables, drawn.size)
    if drawn.kind == POPULATION:
        return float(np.mean(values)), values
    return float(evaluation.evaluate(measure, measures, frames)), values


def _estimate(
    value: float,
    values: Number,
    drawn: Replicates | None,
    people: int | None,
    *,
    extreme: bool = False,
) -> papers.Estimate:
    """Return a value with its 95 % interval; without one if there is none.

    A replicate may hold none of the rows that a measure reads, such as no clip of walking: those few say nothing.
    The largest of people drawn again is never above the largest of all, though that of other people may be: where no
    replicate lies beyond an extreme, its interval reaches as far beyond it as it does to the other side.
    """
    if drawn is None or np.ndim(values) == 0:
        return papers.Estimate(float(value))
    last = drawn.size - drawn.left_out
    draws, left_out = (
        part[np.abs(part) < LARGEST] for part in (np.asarray(values)[:last], np.asarray(values)[last:])
    )
    if len(draws) < max(2.0, (1.0 - MOST_SILENT) * last):
        return papers.Estimate(float(value))
    if drawn.kind == POPULATION:
        return papers.Estimate(float(value), *bootstrap.mean_interval(draws))
    if extreme:  # a correction for bias would draw the one end, which is reflected, towards the value
        low, high = map(float, bootstrap.percentile_interval(draws))
    else:
        low, high = bootstrap.cluster_interval(value, draws, left_out, drawn.clusters or max(people or 2, 2))
    if extreme and draws.max() <= value:
        high = 2.0 * value - low
    elif extreme and draws.min() >= value:
        low = 2.0 * value - high
    return papers.Estimate(float(value), low, high)


def _beyond_the_seen(
    share: papers.Estimate, measure: papers.Measure, drawn: Replicates | None
) -> papers.Estimate:
    """Return a share of 0 or 100 % with the interval of Clopper and Pearson: what no row had, no replicate has either.

    It takes rows as independent, which nothing tells where all are alike; shares of views, which nobody drew, stay.
    """
    if drawn is None or not _is_share(measure):
        return share
    share = _within_a_share(share, measure)
    if share.low != share.high:
        return share
    counts = []
    for arguments in (part.arguments for part in measure.parts if "table" in part.arguments):
        rows = rows_of(drawn.tables[arguments["table"]], arguments.get("where", "")).frame
        if arguments.get("by", "walker") != "walker":
            return share
        counts.append(rows["walker"].nunique() if "by" in arguments else len(rows))
    unseen = 100.0 * (1.0 - (0.5 * (1.0 - bootstrap.LEVEL)) ** (1.0 / min(counts)))
    if share.value == 0.0:
        return replace(share, high=unseen)
    return replace(share, low=100.0 - unseen) if share.value == 100.0 else share


def _is_share(measure: papers.Measure | float) -> bool:
    return isinstance(measure, papers.Measure) and all(part.name in SHARES for part in measure.parts)


def _within_a_share(estimate: papers.Estimate, measure: papers.Measure | float) -> papers.Estimate:
    """Return an estimate whose interval ends at 0 and 100 % if it is a share: Student's of few people passes them."""
    if not _is_share(measure):
        return estimate
    return replace(estimate, low=max(estimate.low, 0.0), high=min(estimate.high, 100.0))


def _one_sample(
    claim: papers.Claim, value: float, values: Number, drawn: Replicates | None
) -> papers.Estimate | None:
    """Return the value with the 95 % prediction interval of one sample of the paper's size.

    A population has the paper's size.  Of people, the spread of replicates is scaled to it, and adds to our own.
    """
    if (
        drawn is None
        or claim.published is None
        or claim.measure is None
        or np.ndim(values) == 0
        or not np.all(np.abs(values) < LARGEST)
    ):
        return None
    if drawn.kind == POPULATION:
        ends = bootstrap.mean_interval(np.asarray(values), more=1.0)
        return _within_a_share(papers.Estimate(value, *ends), claim.measure)
    if not (drawn.clusters and claim.scope.sample):
        return None
    away = np.asarray(values)[: drawn.size - drawn.left_out] - value
    one = value + np.roll(away, 1) + away * np.sqrt(drawn.clusters / claim.scope.sample)
    low, high = map(float, bootstrap.percentile_interval(one))
    return _within_a_share(papers.Estimate(value, low, high), claim.measure)


def _people(names: Iterable[str], frames: Mapping[str, pd.DataFrame]) -> tuple[int | None, str]:
    """Return how many people the figures of these tables rest on, the fewest, and a recording that may be another's.

    None if no table says how many; nothing if every recording differs from those of other people.
    """
    counts: list[int] = []
    doubts: list[str] = []
    for figure in sorted({name.split("/")[0] for name in names}):
        clips = frames.get(f"{figure}/{INGEST}")
        if clips is not None and {"person", "verdict"} <= set(clips.columns):
            kept = clips[clips["verdict"] == "kept"]
            counts.append(len(set(kept["person"].astype(str))))
            if "reason" in clips.columns:
                doubts += [
                    f"who is who is not known: {clip} {remark}"
                    for clip, reason in zip(kept["clip"], kept["reason"], strict=True)
                    for remark in str(reason).split("; ")  # NaN where no recording has one
                    if remark.startswith(one_person.REMARK)
                ]
    return (int(np.min(counts)) if counts else None), next(iter(doubts), "")


def _not_met(claim: papers.Claim, frames: Mapping[str, pd.DataFrame], measures: evaluation.Registry) -> str:
    """Return which condition that a claim rests on is not met, empty if none; those whose tables are not there are."""
    for name in claim.scope.rests_on:
        condition = papers.claim(name)
        value = _number(condition, frames, measures)
        if (
            condition.bounds.agrees
            and set(condition.tables) <= set(frames)
            and value not in condition.bounds.agrees
        ):
            return f"{name} is not met (expected {condition.bounds.agrees}, received {value:.4g})"
    return ""


def numbers_of(
    names: Iterable[str], made: Tables, measures: evaluation.Registry
) -> dict[str, papers.Estimate]:
    """Return our values of claims and quantities by name, with intervals; NaN where the tables have none."""
    frames = {name: _frame(name, table) for name, table in made.items()}
    found = {}
    for name in names:
        measure = papers.quantity(name).measure
        if measure is None or not set(measure.tables) <= frames.keys():
            found[name] = papers.Estimate(np.nan)
            continue
        drawn = replicate(measure.tables, frames)
        people, _ = _people(measure.tables, frames)
        values = _measured(measure, frames, drawn, measures)
        estimate = _estimate(*values, drawn, people, extreme=measure.name in EXTREMES)
        found[name] = _beyond_the_seen(estimate, measure, drawn)
    return found


def number_of_figure(
    figure: str, made: Mapping[str, Any], measures: evaluation.Registry
) -> Callable[[str], float]:
    """Return the function of a claim's or quantity's name to our value, from one figure's tables by file name."""
    by_name = {_name(figure, name): table for name, table in made.items()}
    return lambda name: numbers_of([name], by_name, measures)[name].value


def _number(
    item: papers.Claim | papers.Quantity, frames: Mapping[str, pd.DataFrame], measures: evaluation.Registry
) -> float:
    """Return our value, of several populations their mean; NaN if a table is missing."""
    if item.measure is None or any(name not in frames for name in item.measure.tables):
        return np.nan
    drawn = replicate(item.measure.tables, frames)
    several = drawn if drawn and drawn.kind == POPULATION else None
    return _measured(item.measure, frames, several, measures)[0]


def judge_figure(
    figure: str,
    made: Mapping[str, Any],
    data_name: str,
    *,
    measures: evaluation.Registry,
    smoke: bool = False,
    overridden: bool = False,
) -> list[papers.Verdict]:
    """Return the verdicts on the claims that use one figure alone, from its tables by file name without suffix."""
    by_name = {_name(figure, name): table for name, table in made.items()}
    alone = [c for c in _claims([figure]) if all(name.split("/")[0] == figure for name in c.tables)]
    return judge(alone, by_name, data_name, measures=measures, smoke=smoke, overridden=overridden)


def judge_folder(
    folder: Path,
    data_name: str,
    figures: Sequence[str],
    *,
    measures: evaluation.Registry,
    overridden: bool = False,
) -> list[papers.Verdict]:
    """Return the verdicts on all claims of these figures, from the tables below ``results/<data>/<scale>``.

    Of other figures the tables that these claims read are read, too.

    Raises
    ------
    InvalidInput
        If a table differs from what was published, or a folder is of another figure or data set.
    """
    scales, claims = set(), _claims(figures)
    read = {*figures, *(name.partition("/")[0] for claim in claims for name in claim.tables)}
    for figure in sorted(read):
        if (folder / figure).is_dir():
            made_as = read_manifest(folder / figure)
            scales.add(made_as.get("scale"))
            holds = f"{made_as.get('figure', figure)} of {made_as.get('data', data_name)}"
            if holds != (own := f"{figure} of {data_name}"):
                raise InvalidInput(
                    "the folder holds another result", folder / figure, own, holds, code="other_result"
                )
    made = read_folder(folder, sorted(read))
    return judge(claims, made, data_name, measures=measures, smoke=SMOKE in scales, overridden=overridden)


def read_folder(folder: Path, figures: Sequence[str]) -> dict[str, pd.DataFrame]:
    """Return the published tables of these figures, by figure and name.

    Raises
    ------
    InvalidInput
        If a table differs from what was published.
    """
    return {
        _name(figure, name): _frame(_name(figure, name), columns)
        for figure in figures
        if (folder / figure).is_dir()
        for name, columns in tables.read_published(folder / figure).items()
    }


def _frame(name: str, table: Any) -> pd.DataFrame:
    frame = pd.DataFrame(table if isinstance(table, pd.DataFrame) else dict(table))
    frame.attrs["name"] = name
    return frame


def _name(figure: str, table: str) -> str:
    return figure if table == "table" else f"{figure}/{table}"


def _claims(figures: Sequence[str]) -> list[papers.Claim]:
    chosen = set(figures)
    return [
        claim for paper in papers.all_papers().values() for claim in paper.claims if claim.figure in chosen
    ]


def write_claims(
    path: Path, verdicts: Sequence[papers.Verdict], *, judged: Iterable[str] | None = None
) -> None:
    """Write the verdicts as a table, one row per claim: both answers, the numbers that they rest on, and why.

    Parameters
    ----------
    path : Path
    verdicts : sequence of Verdict
    judged : iterable of str, optional
        Figures that were judged: rows of others that the file has stay.  By default the file is replaced.
    """
    rows = [_row(verdict) for verdict in verdicts]
    columns = [*_row(papers.Verdict(papers.claim("zhang2007_walkers"), papers.Agreement.UNTESTABLE, ""))]
    anew = {*(judged or ()), *(row["figure"] for row in rows)}
    tables.renew(
        path,
        rows,
        None if judged is None else lambda row: row.get("figure") in anew or {*row} != {*columns},
        columns=columns,
        sort_by=["claim"],
        replace=lambda old: old.startswith((b"claim,short,", b"claim,paper,")),
    )


def _row(verdict: papers.Verdict) -> dict[str, Any]:
    claim, found = verdict.claim, verdict.evidence or papers.Evidence(value=papers.Estimate(np.nan))
    none = papers.Estimate(np.nan)
    value, one = found.value, found.one_sample or none
    baseline, gain = found.baseline or none, found.gain or none
    simpler = claim.baseline or papers.Baseline(measures="", reason="")
    inside = verdict.paper_in_prediction
    return {
        "claim": claim.name,
        "short": claim.text.short,
        "paper": claim.paper,
        "section": claim.text.section,
        "kind": str(claim.kind),
        "same_as": claim.same_as,
        "figure": claim.figure,
        "quote": claim.text.quote,
        "published": np.nan if claim.published is None else claim.published,
        "unit": claim.unit,
        "measure": str(claim.measure or ""),
        "help": claim.text.help,
        "agreement": str(verdict.agreement),
        "value": value.value,
        "value_low": value.low,
        "value_high": value.high,
        "bounds": str(claim.bounds.agrees or ""),
        "close_bounds": str(claim.bounds.close or ""),
        "one_sample_low": one.low,
        "one_sample_high": one.high,
        "paper_in_prediction": "" if inside is None else "yes" if inside else "no",
        "beyond_baseline": str(verdict.beyond),
        "class": simpler.measures,
        "baseline": simpler.name,
        "baseline_knows": simpler.knows,
        "baseline_value": baseline.value,
        "baseline_low": baseline.low,
        "baseline_high": baseline.high,
        "gain": gain.value,
        "gain_low": gain.low,
        "gain_high": gain.high,
        "why": verdict.why,
        "n_people": np.nan if found.people is None else float(found.people),
        "written": claim.bounds.written,
    }
