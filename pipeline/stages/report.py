"""Report: one figure's tables, picture, recording and manifest, published whole under its own name."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from pipeline import papers, tables
from pipeline.config import (
    ViewErrorsReport,
    NoiseVarianceReport,
    PosturesReport,
    Report,
    SpectrumReport,
    ViewAnglesReport,
)
from pipeline.figures import Made
from pipeline.store import Store, canonical, provenance


def figure_module(report: Report) -> ModuleType:
    """The module of `pipeline.figures` that knows this kind of figure."""
    # Imported here: drawing costs a second, and nothing else needs it.
    from pipeline.figures import noise_variance, postures, spectrum, view_angles, view_errors

    match report:
        case SpectrumReport():
            return spectrum
        case NoiseVarianceReport():
            return noise_variance
        case PosturesReport():
            return postures
        case ViewErrorsReport():
            return view_errors
        case ViewAnglesReport():
            return view_angles
        case _:
            raise TypeError(f"no figure for {type(report).__name__}")


def run(made: Made, folder: Path, store: Store) -> list[papers.Verdict]:
    """Verdicts on the claims that this figure backs, after publishing `folder` whole.

    Writes ``table*.csv``, ``claims.csv``, ``table_ingest.csv``, ``figure.svg`` and ``.png``, ``recording*.rrd``,
    ``arrays.npz`` (per walker and joint) and, last, ``manifest.json``.
    """
    config = made.config
    module = figure_module(config.report)
    started = time.perf_counter()
    with store.publish(folder) as publication:
        made_tables = module.tables(made)
        for name, (columns, sort_by) in made_tables.items():
            tables.write(publication.folder / f"{name}.csv", columns, sort_by=sort_by)
        rows = made.ingest.notes["report"]
        report = {name: _column([row[name] for row in rows]) for name in rows[0]}
        tables.write(publication.folder / "table_ingest.csv", report, sort_by=["source", "person", "clip"])
        verdicts = judge(config.figure, {config.figure: made_tables}, config.data.name)
        write_claims(publication.folder / "claims.csv", verdicts)
        with (publication.folder / "arrays.npz").open("wb") as file:
            np.savez(file, **dict(made.sweep.arrays), walker=np.array(made.walkers))
        tabulated = time.perf_counter()
        if config.report.picture:
            module.picture(made, made_tables, publication.folder / "figure")
        if config.report.recording:
            module.recordings(made, made_tables, publication.folder)
        stages = {a.stage: {"key": a.key, "seconds": a.seconds} for a in _artefacts(made)}
        publication.manifest(
            {
                "figure": config.figure,
                "paper": config.paper,
                "title": config.title,
                "data": config.data.name,
                "scale": config.scale.name,
                "seed": config.seed,
                "configuration": canonical(config),
                "stages": stages,
                "inputs": made.ingest.notes["inputs"],
                "tabulate_seconds": round(tabulated - started, 3),
                "draw_seconds": round(time.perf_counter() - tabulated, 3),
                "provenance": provenance(),
            }
        )
    return verdicts


def _column(values: list[Any]) -> np.ndarray:
    """Numbers where there are any, with NaN for what a refused clip never reached; else text."""
    if any(isinstance(value, int | float) for value in values):
        return np.array([np.nan if value == "" else float(value) for value in values])
    return np.array([str(value) for value in values])


def _artefacts(made: Made) -> tuple[Any, ...]:
    return made.ingest, made.dataset, made.model, made.sweep


def judge(figure: str, made_tables: Mapping[str, Any], data_name: str) -> list[papers.Verdict]:
    """Verdicts on the claims backed by one figure's tables."""
    claims = [claim for paper in papers.PAPERS.values() for claim in paper.claims if claim.figure == figure]
    by_name = {}
    for name, group in made_tables.items():
        for table, (columns, _) in group.items():
            by_name[name if table == "table" else f"{name}/{table}"] = {
                column: np.asarray(values) for column, values in columns.items()
            }
    return papers.judge(claims, by_name, data_name)


def write_claims(path: Path, verdicts: list[papers.Verdict]) -> None:
    """The ledger as a table, one claim to a row."""
    tables.write(
        path,
        {
            "claim": [v.claim.name for v in verdicts],
            "paper": [v.claim.paper for v in verdicts],
            "section": [v.claim.section for v in verdicts],
            "figure": [v.claim.figure for v in verdicts],
            "quote": [v.claim.quote for v in verdicts],
            "published": [np.nan if v.claim.published is None else v.claim.published for v in verdicts],
            "ours": [np.nan if v.ours is None else v.ours for v in verdicts],
            "unit": [v.claim.unit for v in verdicts],
            "verdict": [v.verdict for v in verdicts],
            "why": [v.why for v in verdicts],
        },
        sort_by=["claim"],
    )
