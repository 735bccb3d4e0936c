"""Report: one figure's tables, picture, recording and manifest, published whole under its own name."""

from __future__ import annotations

import time
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from pipeline import papers, tables
from pipeline.config import (
    Grid,
    KnownViewSweep,
    NoiseVarianceReport,
    PosturesReport,
    Report,
    SpectrumReport,
    Sweep,
    UnknownViewSweep,
    ViewAnglesReport,
    ViewErrorsReport,
)
from pipeline.figures import Made
from pipeline.ledger import judge_figure, write_claims
from pipeline.provenance import provenance
from pipeline.refusal import Refusal
from pipeline.sealed_folders import canonical
from pipeline.store import Store, packed


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


def check(report: Report, sweep: Sweep) -> None:
    """Nothing; a Refusal, before anything is computed, if this figure cannot be made of this sweep."""
    kind = "unknown_view" if isinstance(report, ViewAnglesReport) else "known_view"
    if not isinstance(report, SpectrumReport) and not isinstance(
        sweep, UnknownViewSweep if kind == "unknown_view" else KnownViewSweep
    ):
        raise Refusal(
            f"{type(report).__name__} cannot be made of {type(sweep).__name__}",
            where="sweep",
            expected=f"sweep={kind}",
        )
    if isinstance(report, NoiseVarianceReport) and "map" not in getattr(sweep, "methods", ()):
        raise Refusal(
            "σ² is swept for approach II alone", where="sweep.methods", expected="map among the methods"
        )
    if not report.recording:
        return
    # A recording's view angles and variances are sequence numbers.
    of = "sigma2_mm2" if isinstance(report, NoiseVarianceReport) else "view_angle_deg"
    grid = getattr(sweep, of, None)
    if isinstance(grid, Grid) and (grid.start % 1 or grid.step % 1):
        raise Refusal(
            "a recording counts in whole numbers",
            where=f"sweep.{of}",
            expected="whole start and step, or report.recording=false",
            received=f"start {grid.start:g}, step {grid.step:g}",
        )


def run(made: Made, folder: Path, store: Store) -> list[papers.Verdict]:
    """Verdicts on the claims that this figure backs, after publishing `folder` whole.

    Writes ``table*.csv``, ``claims.csv``, ``table_ingest.csv``, ``figure.svg`` and ``.png``,
    ``recording*.rrd``, ``arrays.npz`` (per walker and joint) and, last, ``manifest.json``.
    """
    config = made.config
    module = figure_module(config.report)
    started = time.perf_counter()
    with store.publish(folder) as publication:
        made_tables = module.tables(made)
        for name, (columns, sort_by) in made_tables.items():
            tables.write(publication.folder / f"{name}.csv", columns, sort_by=sort_by)
        rows = made.ingest.notes["report"]
        report = {name: _column([row[name] for row in rows]) for name in made.ingest.notes["report_columns"]}
        tables.write(publication.folder / "table_ingest.csv", report, sort_by=["source", "person", "clip"])
        as_preset = folder.parent == Path(config.results) / config.data.name / config.scale.name
        known_as = config.data.name if as_preset else papers.OVERRIDDEN
        verdicts = judge_figure(config.figure, made_tables, known_as)
        write_claims(publication.folder / "claims.csv", verdicts)
        arrays: dict[str, Any] = {**made.sweep.arrays, "walker": np.array(made.walkers)}
        (publication.folder / "arrays.npz").write_bytes(packed(arrays))
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
                "configuration": _without_paths(canonical(config)),
                "stages": stages,
                "inputs": made.ingest.notes["inputs"],
                "tabulate_seconds": round(tabulated - started, 3),
                "draw_seconds": round(time.perf_counter() - tabulated, 3),
                "provenance": provenance(),
            }
        )
    return verdicts


def _without_paths(configuration: dict[str, Any]) -> dict[str, Any]:
    """The configuration as it may be published: folders of this machine reduced to their last name."""
    data = dict(configuration["data"])
    for option in ("mirror", "raw", "path"):
        if data.get(option):
            data[option] = Path(data[option]).name
    return {**configuration, "data": data, "results": Path(configuration["results"]).name}


def _column(values: list[Any]) -> np.ndarray:
    """Numbers where there are any, with NaN for what a refused clip never reached; else text."""
    if any(isinstance(value, int | float) for value in values):
        return np.array([np.nan if value == "" else float(value) for value in values])
    return np.array([str(value) for value in values])


def _artefacts(made: Made) -> tuple[Any, ...]:
    return made.ingest, made.dataset, made.model, made.sweep
