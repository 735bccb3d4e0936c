"""Figure stage: publication of an experiment's tables, picture, recordings and verdicts in one folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from pipeline import papers, recordings
from pipeline.chart_json import to_json
from pipeline.chart_limits import with_shared_limits
from pipeline.papers import Verdict
from pipeline.stages import populations
from pipeline.stages.artefacts import Stored
from pipeline.stages.ingest import report_table
from pipeline.stages.shown_population import displayed_population
from pipeline.stages.sources import figure_code, used_plugins
from pipeline.storage import tables
from pipeline.storage.provenance import provenance, without_paths
from pipeline.storage.publishing import publish
from pipeline.storage.sealed_folders import canonical
from pipeline.storage.store import Store, packed
from pipeline.studies.captions import filled_caption
from pipeline.studies.evaluation import Registry
from pipeline.studies.experiment import Experiment
from pipeline.studies.figure_inputs import FigureInputs
from pipeline.studies.ledger import INGEST, SMOKE, judge_figure, number_of_figure, write_claims


def run(
    experiment: Experiment,
    stages: Sequence[Stored[Any]],
    folder: Path,
    store: Store,
    *,
    measures: Registry,
    early: bool = False,
) -> list[Verdict]:
    """Publish the figure in `folder`, and return the verdicts on the claims that depend on this figure alone.

    Writes ``table*.csv``, ``claims.csv``, ``table_ingest.csv``, ``figure.svg`` and others, ``recording*.rrd``,
    ``arrays.npz`` and, last, ``manifest.json``.

    Parameters
    ----------
    experiment : Experiment
    stages : sequence of Stored
        Clips, dataset, model and sweep.
    folder : Path
    store : Store
    measures : Registry
    early : bool
        True: publish the figure of one population first, if `folder` does not exist and further populations follow.
    """
    inputs = FigureInputs(experiment, *(stage.value for stage in stages))
    if early and populations.count(experiment) and not folder.exists():
        _publish(inputs, stages, folder, experiment.figure.tables(inputs), measures, complete=False)
    inputs, outputs = displayed_population(inputs, store)
    return _publish(inputs, stages, folder, outputs, measures)


def _publish(
    inputs: FigureInputs[Any, Any, Any],
    stages: Sequence[Stored[Any]],
    folder: Path,
    outputs: Mapping[str, Any],
    measures: Registry,
    *,
    complete: bool = True,
) -> list[Verdict]:
    """Publish a figure with the given tables; only a `complete` figure has a recording and a digest of its sources."""
    experiment, figure, outputs = inputs.experiment, inputs.experiment.figure, dict(outputs)
    with publish(folder, having="figure") as publication:
        for name, table in outputs.items():
            tables.write(publication.folder / f"{name}.csv", table)
        report = report_table(inputs.clips.report, inputs.clips.report_columns)
        tables.write(publication.folder / f"{INGEST}.csv", report, sort_by=["source", "person", "clip"])
        judged_tables = {**outputs, INGEST: report}
        verdicts = judge_figure(
            experiment.name, judged_tables, experiment.data.name, measures=measures,
            smoke=experiment.scale.name == SMOKE, overridden=folder.parent != experiment.published_in,
        )  # fmt: skip
        write_claims(publication.folder / "claims.csv", verdicts)
        (publication.folder / "arrays.npz").write_bytes(packed({**inputs.arrays, **figure.arrays(inputs)}))
        sheet = figure.charts(inputs, outputs)
        sheet = with_shared_limits(sheet.with_published(papers.published, figure.marks(experiment)), outputs)
        caption = f"{inputs.caption} {sheet.caption}".strip()
        expect = filled_caption(experiment.expect, number_of_figure(experiment.name, judged_tables, measures))
        if figure.picture:
            from pipeline.pictures.picture import Picture

            stem, options = publication.folder / "figure", figure.printed
            figure.draw(inputs, outputs, Picture(stem, sheet, outputs, caption, experiment.title, **options))
        if figure.recording and complete:
            begin = partial(
                recordings.Recording, publication.folder / "recording.rrd", name=experiment.name, charts=sheet.charts,
                about=inputs.about(expect), edition=f"{experiment.data.name} {experiment.scale.name}", tables=outputs,
            )  # fmt: skip
            figure.record(inputs, outputs, begin)
        publication.facts = {
            "figure": experiment.name,
            "paper": experiment.paper,
            "title": experiment.title,
            "data": experiment.data.name,
            "scale": experiment.scale.name,
            "seed": experiment.seed,
            **({"population": inputs.population} if inputs.population else {}),
            "configuration": without_paths(canonical(experiment)),
            "code": figure_code(experiment) if complete else "",
            "stages": {stage.artefact.stage: stage.artefact.facts for stage in stages},
            "inputs": inputs.clips.inputs,
            "caption": caption,
            "expect": expect,
            "charts": [to_json(chart) for chart in sheet.charts if chart.page],
            "picture_beside_charts": figure.draws_more_than(sheet),
            "plugins": used_plugins(experiment, publication.folder),
            "provenance": provenance(),
        }
    return verdicts
