"""Report: one figure's tables, picture, recording and manifest, published whole under its own name."""

from __future__ import annotations

import re
import time
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from pipeline import papers
from pipeline.clips.corpus import require
from pipeline.storage import tables
from pipeline.storage.provenance import provenance
from pipeline.storage.sealed_folders import canonical
from pipeline.storage.store import Store, packed
from pipeline.studies import options
from pipeline.studies.figure_inputs import Made
from pipeline.studies.ledger import judge_figure, write_claims
from pipeline.studies.options import Config, Grid
from pipeline.validation import InvalidInput

KINDS: dict[type[options.Report], tuple[str, type[options.Model], type[options.Sweep]]] = {
    options.SpectrumReport: ("walks.figures.spectrum", options.EigenwalkersModel, options.Sweep),
    options.NoiseVarianceReport: (
        "walks.figures.noise_variance",
        options.EigenwalkersModel,
        options.KnownViewSweep,
    ),
    options.PosturesReport: ("walks.figures.postures", options.EigenwalkersModel, options.KnownViewSweep),
    options.ViewErrorsReport: (
        "walks.figures.view_errors",
        options.EigenwalkersModel,
        options.KnownViewSweep,
    ),
    options.ViewAnglesReport: (
        "walks.figures.view_angles",
        options.EigenwalkersModel,
        options.UnknownViewSweep,
    ),
    options.WarpReport: ("actions.figures.warps", options.ActionSpaceModel, options.Sweep),
    options.TrellisReport: ("actions.figures.trellis", options.ActionSpaceModel, options.Sweep),
    options.ActionModelReport: ("actions.figures.action_model", options.ActionSpaceModel, options.Sweep),
    options.PostureSamplesReport: (
        "actions.figures.posture_samples",
        options.ActionSpaceModel,
        options.PostureSamplesSweep,
    ),
    options.WarpErrorReport: (
        "actions.figures.warp_error",
        options.ActionSpaceModel,
        options.SmoothnessSweep,
    ),
    options.VarianceLeftReport: ("actions.figures.variance_left", options.ActionSpaceModel, options.Sweep),
    options.TrackingReport: ("actions.figures.tracking", options.ActionSpaceModel, options.TrackingSweep),
    options.LimbScatterReport: (
        "limbs.figures.limb_scatter",
        options.TrajectoryBasisModel,
        options.ReconstructibilitySweep,
    ),
    options.LimbErrorsReport: ("limbs.figures.limb_errors", options.TrajectoryBasisModel, options.LimbSweep),
    options.ProofsReport: ("limbs.figures.proofs", options.TrajectoryBasisModel, options.ProofSweep),
    options.MotionsReport: ("limbs.figures.motions", options.TrajectoryBasisModel, options.MotionsSweep),
    options.FaceOffReport: ("face_off.figure", options.EigenwalkersModel, options.FaceOffSweep),
}
"""Of each report: its module in `pipeline.figures`, and the model and the sweep that it shows."""

PURPOSES: dict[type[options.Model], str] = {
    options.EigenwalkersModel: "walks",
    options.ActionSpaceModel: "performances",
    options.TrajectoryBasisModel: "clips",
}
"""What each model is learnt from."""


def figure_module(report: options.Report) -> ModuleType:
    """The module of `pipeline.figures` that knows this kind of figure."""
    # Imported here: drawing costs a second, and nothing else needs it.
    return import_module(f"pipeline.studies.{KINDS[type(report)][0]}")


def check(config: Config) -> None:
    """Nothing; a InvalidInput, before anything is computed, if this figure cannot be made of these options."""
    report, sweep = config.report, config.sweep
    _, model, wanted = KINDS[type(report)]
    for group, option, expected in (("model", config.model, model), ("sweep", sweep, wanted)):
        if not isinstance(option, expected):
            raise InvalidInput(
                f"{type(report).__name__} cannot be made of {type(option).__name__}",
                where=group,
                expected=_options_of(group, expected),
            )
    if config.purpose != PURPOSES[model]:
        raise InvalidInput(
            f"{model.__name__} cannot be learnt from {type(config.dataset).__name__}", where="dataset"
        )
    require(config.data, config.purpose)
    if isinstance(report, options.WarpErrorReport) and not isinstance(config.data, options.SyntheticData):
        raise InvalidInput(
            "the true course of an action is known of synthetic performances alone",
            where="data",
            expected="data=synthetic",
            received=f"data={config.data.name}",
        )
    if isinstance(report, options.NoiseVarianceReport) and "map" not in getattr(sweep, "methods", ()):
        raise InvalidInput(
            "σ² is swept for approach II alone", where="sweep.methods", expected="map among the methods"
        )
    if not report.recording:
        return
    # A recording's view angles and variances are sequence numbers.
    of = "sigma2_mm2" if isinstance(report, options.NoiseVarianceReport) else "view_angle_deg"
    grid = getattr(sweep, of, None)
    if isinstance(grid, Grid) and (grid.start % 1 or grid.step % 1):
        raise InvalidInput(
            "a recording counts in whole numbers",
            where=f"sweep.{of}",
            expected="whole start and step, or report.recording=false",
            received=f"start {grid.start:g}, step {grid.step:g}",
        )


def _options_of(group: str, wanted: type) -> str:
    """The options of a group that are of a kind, as one would ask for them."""
    kinds = [kind for kind in vars(options).values() if isinstance(kind, type) and issubclass(kind, wanted)]
    names = [
        re.sub("(?<!^)(?=[A-Z])", "_", k.__name__.removesuffix(group.capitalize())).lower() for k in kinds
    ]
    return f"{group}=" + " or ".join(name for name in names if name)


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
        (publication.folder / "arrays.npz").write_bytes(packed(made.arrays))
        tabulated = time.perf_counter()
        if config.report.picture:
            module.picture(made, made_tables, publication.folder / "figure")
        if config.report.recording:
            module.recordings(made, made_tables, publication.folder)
        stages = {a.stage: {"key": a.key, "seconds": a.seconds} for a in made.artefacts}
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
