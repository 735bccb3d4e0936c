"""Verdicts on all claims, computed from published tables and written to ``claims.csv``."""

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
from pipeline.reading import as_written
from pipeline.storage import tables
from pipeline.storage.sealed_folders import read_manifest
from pipeline.studies import evaluation
from pipeline.studies.replicated import DRAW, INGEST, POPULATION, Replicates, replicate
from pipeline.studies.rows import Number, rows_of
from pipeline.validation import InvalidInput

Tables = Mapping[str, Any]
"""Published tables by name, each a data frame or a mapping from column names to entries.

``zhang2007_fig5`` is the figure's ``table.csv``, and ``zhang2007_fig5/table_walkers`` is the ``table_walkers.csv`` next
to it.
"""

SMOKE = "smoke"
"""Name of the scale for quick tests, whose results never decide a claim."""

MAX_REPLICATE = 1e100
"""Largest absolute value of a bootstrap replicate; larger values overflow in the BCa interval and are ignored."""
MAX_MISSING = 0.05
"""Largest share of bootstrap replicates without a value for which an interval is still computed."""

SHARES = ("percent", "mean_percent", "percent_below", "larger", "smaller")
"""Names of measures that return a percentage of rows or walkers, or the larger or smaller of percentages."""

EXTREMES = ("largest", "smallest")
"""Names of measures of an extreme value, which no bootstrap replicate can exceed."""


def judge(
    claims: Iterable[papers.Claim],
    figure_tables: Tables,
    data_name: str,
    *,
    measures: evaluation.Registry,
    smoke: bool = False,
    overridden: bool = False,
) -> list[papers.Verdict]:
    """Return the verdict on each claim, in the order of the claims.

    Parameters
    ----------
    claims : iterable of Claim
    figure_tables : Tables
        Tables of the available figures.
    data_name : str
        Option of the data group, ``"synthetic"``, ``"optical"``…
    measures : Registry
        Measures of the claims, by name.
    smoke : bool
        True if the figures are of the small scale, which decides no claim.
    overridden : bool
        True if options differ from the presets.

    Raises
    ------
    InvalidInput
        If a table lacks a column that a claim reads, or there is no such measure.
    """
    frames = {name: _frame(name, table) for name, table in figure_tables.items()}
    verdicts = []
    for claim in claims:
        if claim.measure:
            evaluation.check(claim.measure, measures, claim.name)
        if missing := [name for name in claim.tables if name not in frames]:
            why = f"figure {missing[0]} is not made yet"
            verdicts.append(papers.Verdict(claim, papers.Agreement.UNTESTABLE, why))
        else:
            evidence = _evidence(claim, frames, measures, interval=not smoke)
            verdicts.append(
                papers.judge(
                    claim,
                    evidence,
                    data_name,
                    lambda name: value_of(papers.quantity(name), frames, measures),
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
    """Return the evidence on a claim: our value, the baseline's value, and the paired gain over the baseline."""
    people, doubt = _people(claim.tables, frames)
    doubt = doubt or _not_met(claim, frames, measures)
    if claim.measure is None or claim.kind is papers.Kind.CONDITION or not interval:
        return papers.Evidence(
            value=papers.Estimate(value_of(claim, frames, measures)), people=people, doubt=doubt
        )
    drawn = replicate(claim.tables, frames)
    value, values = _measured(claim.measure, frames, drawn, measures)
    evidence = papers.Evidence(
        value=_with_clopper_pearson(
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
        return evidence
    baseline_value, baseline_values = (
        _measured(simpler, frames, drawn, measures)
        if isinstance(simpler, papers.Measure)
        else (simpler, simpler)
    )
    better = papers.gain(claim, baseline_value)
    return replace(
        evidence,
        baseline=_clipped_share(_estimate(baseline_value, baseline_values, drawn, people), simpler),
        gain=_estimate(better(value, baseline_value), better(values, baseline_values), drawn, people),
    )


def _measured(
    measure: papers.Measure,
    frames: Mapping[str, pd.DataFrame],
    drawn: Replicates | None,
    measures: evaluation.Registry,
) -> tuple[float, Number]:
    """Return the value of a measure and its value in each bootstrap replicate (B,); NaN without replicates.

    If the tables contain several populations, the value is the mean over populations.
    """
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
    """Return a value with its 95 % interval; the interval is missing if too few replicates have a value.

    A replicate may lack all rows that a measure reads, such as every clip of walking; such replicates are ignored.
    The maximum of a bootstrap sample never exceeds that of the sample, although other people may exceed it.  If no
    replicate lies beyond an extreme value, its interval is therefore made symmetric about the value.
    """
    if drawn is None or np.ndim(values) == 0:
        return papers.Estimate(float(value))
    last = drawn.size - drawn.left_out
    draws, left_out = (
        part[np.abs(part) < MAX_REPLICATE] for part in (np.asarray(values)[:last], np.asarray(values)[last:])
    )
    if len(draws) < max(2.0, (1.0 - MAX_MISSING) * last):
        return papers.Estimate(float(value))
    if drawn.kind == POPULATION:
        return papers.Estimate(float(value), *bootstrap.mean_interval(draws))
    if extreme:  # a bias correction would move the end that is reflected towards the value
        low, high = map(float, bootstrap.percentile_interval(draws))
    else:
        low, high = bootstrap.cluster_interval(value, draws, left_out, drawn.clusters or max(people or 2, 2))
    if extreme and draws.max() <= value:
        high = 2.0 * value - low
    elif extreme and draws.min() >= value:
        low = 2.0 * value - high
    return papers.Estimate(float(value), low, high)


def _with_clopper_pearson(
    share: papers.Estimate, measure: papers.Measure, drawn: Replicates | None
) -> papers.Estimate:
    """Return a percentage with its interval, of the Clopper-Pearson type for a percentage of 0 or 100.

    The bootstrap variance of such a share is zero.  The interval assumes independent rows, which equal rows cannot
    disprove.  Shares of views are returned unchanged, because views are not sampled.
    """
    if drawn is None or not _is_share(measure):
        return share
    share = _clipped_share(share, measure)
    if share.low != share.high:
        return share
    counts = []
    for arguments in (part.arguments for part in measure.parts if "table" in part.arguments):
        rows = rows_of(drawn.tables[arguments["table"]], arguments.get("where", "")).frame
        if arguments.get("by", "walker") != "walker":
            return share
        counts.append(rows["walker"].nunique() if "by" in arguments else len(rows))
    upper = 100.0 * (1.0 - (0.5 * (1.0 - bootstrap.LEVEL)) ** (1.0 / min(counts)))
    if share.value == 0.0:
        return replace(share, high=upper)
    return replace(share, low=100.0 - upper) if share.value == 100.0 else share


def _is_share(measure: papers.Measure | float) -> bool:
    return isinstance(measure, papers.Measure) and all(part.name in SHARES for part in measure.parts)


def _clipped_share(estimate: papers.Estimate, measure: papers.Measure | float) -> papers.Estimate:
    """Return an estimate; the interval of a percentage is clipped to the range from 0 to 100 %."""
    if not _is_share(measure):
        return estimate
    return replace(estimate, low=max(estimate.low, 0.0), high=min(estimate.high, 100.0))


def _one_sample(
    claim: papers.Claim, value: float, values: Number, drawn: Replicates | None
) -> papers.Estimate | None:
    """Return our value with a 95 % prediction interval for one sample that has the size of the paper's sample.

    Each population has the paper's size.  For people, the spread of replicates is scaled to that size and added to the
    spread of our own sample.
    """
    if (
        drawn is None
        or claim.published is None
        or claim.measure is None
        or np.ndim(values) == 0
        or not np.all(np.abs(values) < MAX_REPLICATE)
    ):
        return None
    if drawn.kind == POPULATION:
        ends = bootstrap.mean_interval(np.asarray(values), more=1.0)
        return _clipped_share(papers.Estimate(value, *ends), claim.measure)
    if not (drawn.clusters and claim.scope.sample):
        return None
    deviations = np.asarray(values)[: drawn.size - drawn.left_out] - value
    predictions = value + np.roll(deviations, 1) + deviations * np.sqrt(drawn.clusters / claim.scope.sample)
    low, high = map(float, bootstrap.percentile_interval(predictions))
    return _clipped_share(papers.Estimate(value, low, high), claim.measure)


def _people(names: Iterable[str], frames: Mapping[str, pd.DataFrame]) -> tuple[int | None, str]:
    """Return the smallest number of people in some tables, and a message if two recordings may show one person.

    The number is None if no table gives it; the doubt is empty if every recording differs from those of other people.
    """
    counts: list[int] = []
    doubts: list[str] = []
    for figure in sorted({name.split("/")[0] for name in names}):
        clips = frames.get(f"{figure}/{INGEST}")
        if clips is not None and {"person", "verdict"} <= set(clips.columns):
            usable = clips[clips["verdict"] == "kept"]
            counts.append(len(set(usable["person"].astype(str))))
            if "reason" in clips.columns:
                doubts += [
                    f"who is who is not known: {clip} {remark}"
                    for clip, reason in zip(usable["clip"], usable["reason"], strict=True)
                    for remark in str(reason).split("; ")  # NaN if no recording has a remark
                    if remark.startswith(one_person.REMARK)
                ]
    return (int(np.min(counts)) if counts else None), next(iter(doubts), "")


def _not_met(claim: papers.Claim, frames: Mapping[str, pd.DataFrame], measures: evaluation.Registry) -> str:
    """Return a message about the first unmet condition of a claim, or an empty string if all conditions are met.

    A condition whose tables are missing counts as met.
    """
    for name in claim.scope.rests_on:
        condition = papers.claim(name)
        value = value_of(condition, frames, measures)
        if (
            condition.bounds.agrees
            and set(condition.tables) <= set(frames)
            and value not in condition.bounds.agrees
        ):
            return f"{name} is not met (expected {condition.bounds.agrees}, found {value:.4g})"
    return ""


def numbers_of(
    names: Iterable[str], figure_tables: Tables, measures: evaluation.Registry
) -> dict[str, papers.Estimate]:
    """Return our values of the named claims and quantities, with intervals; NaN if a table is missing."""
    frames = {name: _frame(name, table) for name, table in figure_tables.items()}
    estimates = {}
    for name in names:
        measure = papers.quantity(name).measure
        if measure is None or not set(measure.tables) <= frames.keys():
            estimates[name] = papers.Estimate(np.nan)
            continue
        drawn = replicate(measure.tables, frames)
        people, _ = _people(measure.tables, frames)
        values = _measured(measure, frames, drawn, measures)
        estimate = _estimate(*values, drawn, people, extreme=measure.name in EXTREMES)
        estimates[name] = _with_clopper_pearson(estimate, measure, drawn)
    return estimates


def number_of_figure(
    figure: str, figure_tables: Mapping[str, Any], measures: evaluation.Registry
) -> Callable[[str], float]:
    """Return a function that computes our value of a claim or quantity from the tables of one figure."""
    by_name = {_name(figure, name): table for name, table in figure_tables.items()}
    return lambda name: numbers_of([name], by_name, measures)[name].value


def value_of(
    item: papers.Claim | papers.Quantity, frames: Mapping[str, pd.DataFrame], measures: evaluation.Registry
) -> float:
    """Return our value of a claim or quantity; NaN if a table that it reads is missing.

    If the tables contain several populations, the value is the mean over populations.
    """
    if item.measure is None or any(name not in frames for name in item.measure.tables):
        return np.nan
    drawn = replicate(item.measure.tables, frames)
    several = drawn if drawn and drawn.kind == POPULATION else None
    return _measured(item.measure, frames, several, measures)[0]


def judge_figure(
    figure: str,
    figure_tables: Mapping[str, Any],
    data_name: str,
    *,
    measures: evaluation.Registry,
    smoke: bool = False,
    overridden: bool = False,
) -> list[papers.Verdict]:
    """Return the verdicts on all claims that need the tables of this figure only.

    The keys of `figure_tables` are file names without suffix.
    """
    by_name = {_name(figure, name): table for name, table in figure_tables.items()}
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
    """Return the verdicts on all claims of the given figures, from the tables below ``results/<data>/<scale>``.

    Tables of other figures are read too if these claims use them.

    Raises
    ------
    InvalidInput
        If a table differs from its published version, or a folder contains another figure or data set.
    """
    scales, claims = set(), _claims(figures)
    read = {*figures, *(name.partition("/")[0] for claim in claims for name in claim.tables)}
    for figure in sorted(read):
        if (folder / figure).is_dir():
            manifest = read_manifest(folder / figure)
            scales.add(manifest.get("scale"))
            contents = f"{manifest.get('figure', figure)} of {manifest.get('data', data_name)}"
            if contents != (expected := f"{figure} of {data_name}"):
                raise InvalidInput(
                    "the folder contains another figure or data set",
                    folder / figure,
                    expected,
                    contents,
                    code="other_result",
                )
    figure_tables = read_folder(folder, sorted(read))
    with as_written(folder):
        return judge(
            claims, figure_tables, data_name, measures=measures, smoke=SMOKE in scales, overridden=overridden
        )


def read_folder(folder: Path, figures: Sequence[str]) -> dict[str, pd.DataFrame]:
    """Return all published tables of the named figures, by the name ``figure/table``.

    Raises
    ------
    InvalidInput
        If a table differs from its published version.
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
    names = set(figures)
    return [
        claim for paper in papers.all_papers().values() for claim in paper.claims if claim.figure in names
    ]


def write_claims(
    path: Path, verdicts: Sequence[papers.Verdict], *, judged: Iterable[str] | None = None
) -> None:
    """Write a table with one row for each verdict: the paper's answer, our answer, the numbers and the reason.

    Parameters
    ----------
    path : Path
    verdicts : sequence of Verdict
    judged : iterable of str, optional
        Figures that were judged; the file's rows of other figures are retained.  By default the file is replaced.
    """
    rows = [_row(verdict) for verdict in verdicts]
    columns = [*_row(papers.Verdict(papers.claim("zhang2007_walkers"), papers.Agreement.UNTESTABLE, ""))]
    judged_figures = {*(judged or ()), *(row["figure"] for row in rows)}
    tables.renew(
        path,
        rows,
        None if judged is None else lambda row: row.get("figure") in judged_figures or {*row} != {*columns},
        columns=columns,
        sort_by=["claim"],
        replace=lambda old: old.startswith((b"claim,short,", b"claim,paper,")),
    )


def _row(verdict: papers.Verdict) -> dict[str, Any]:
    claim, evidence = verdict.claim, verdict.evidence or papers.Evidence(value=papers.Estimate(np.nan))
    missing = papers.Estimate(np.nan)
    value, one_sample = evidence.value, evidence.one_sample or missing
    baseline, gain = evidence.baseline or missing, evidence.gain or missing
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
        "one_sample_low": one_sample.low,
        "one_sample_high": one_sample.high,
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
        "n_people": np.nan if evidence.people is None else float(evidence.people),
        "written": claim.bounds.written,
    }
