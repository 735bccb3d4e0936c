"""Figure stage: tables, picture, recordings and verdicts of an experiment, published in one folder."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline import charts, papers, pictures, recordings
from pipeline.papers import Verdict
from pipeline.stages.artefacts import Stored
from pipeline.stages.ingest import report_table
from pipeline.stages.shown_population import shown
from pipeline.storage import tables
from pipeline.storage.provenance import provenance
from pipeline.storage.publishing import publish
from pipeline.storage.sealed_folders import canonical
from pipeline.storage.source_code import sources_digest
from pipeline.storage.store import Store, packed
from pipeline.studies.experiment import Experiment
from pipeline.studies.figure_inputs import FigureInputs
from pipeline.studies.ledger import INGEST, SMOKE, judge_figure, write_claims

PRIVATE_PATHS = ("mirror", "raw", "path")
"""Options of a data set that are folders of this machine."""


def run(experiment: Experiment, stages: Sequence[Stored[Any]], folder: Path, store: Store) -> list[Verdict]:
    """Publish the figure in `folder` and return the verdicts on the claims that rest on it alone.

    Writes ``table*.csv``, ``claims.csv``, ``table_ingest.csv``, ``figure.svg`` and ``.png``, ``recording*.rrd``,
    ``arrays.npz`` and, last, ``manifest.json``.

    Parameters
    ----------
    experiment : Experiment
    stages : sequence of Stored
        Clips, dataset, model and sweep.
    folder : Path
    store : Store
    """
    clips, dataset, model, sweep = stages
    inputs = FigureInputs(experiment, clips.value, dataset.value, model.value, sweep.value)
    figure = experiment.figure
    started = time.perf_counter()
    with publish(folder, having="figure") as publication:
        inputs, made = shown(inputs, store)
        for name, table in made.items():
            tables.write(publication.folder / f"{name}.csv", table)
        report = report_table(inputs.clips.report, inputs.clips.report_columns)
        tables.write(publication.folder / f"{INGEST}.csv", report, sort_by=["source", "person", "clip"])
        as_preset = folder.parent == Path(experiment.results) / experiment.data.name / experiment.scale.name
        verdicts = judge_figure(
            experiment.name,
            {**made, INGEST: report},
            experiment.data.name,
            smoke=experiment.scale.name == SMOKE,
            overridden=not as_preset,
        )
        write_claims(publication.folder / "claims.csv", verdicts)
        (publication.folder / "arrays.npz").write_bytes(packed({**inputs.arrays, **figure.arrays(inputs)}))
        tabulated = time.perf_counter()
        sheet = figure.charts(inputs, made).with_published(_published)
        caption = f"{inputs.caption} {sheet.caption}".strip()
        if figure.picture:
            stem = publication.folder / "figure"
            figure.draw(inputs, made, pictures.Picture(stem, caption, sheet, made))
        if figure.recording:
            edition = f"{experiment.data.name} {experiment.scale.name}"
            begin = (publication.folder, experiment.name, inputs.about, edition, sheet, made)
            figure.record(inputs, made, recordings.Recorder(*begin))
        artefacts = [kept.artefact for kept in stages]
        publication.manifest(
            {
                "figure": experiment.name,
                "paper": experiment.paper,
                "title": experiment.title,
                "data": experiment.data.name,
                "scale": experiment.scale.name,
                "seed": experiment.seed,
                **({"population": inputs.population} if inputs.population else {}),
                "configuration": _without_paths(canonical(experiment)),
                "code": figure_code(experiment),
                "stages": {
                    a.stage: {"key": a.key, "content": a.content, "seconds": a.seconds} for a in artefacts
                },
                "inputs": clips.value.inputs,
                "caption": caption,
                "charts": [charts.to_json(chart) for chart in sheet.charts if chart.page],
                "picture_beside_charts": figure.draws_more_than(sheet),
                "tabulate_seconds": round(tabulated - started, 3),
                "draw_seconds": round(time.perf_counter() - tabulated, 3),
                "provenance": provenance(),
            }
        )
    return verdicts


def figure_code(experiment: Experiment) -> str:
    """Return the digest of the sources of tables, picture and recording."""
    drawn = ("pipeline.pictures.picture", "pipeline.recordings.recording")
    return sources_digest([type(experiment.figure).__module__, *drawn])


def _published(claim: str) -> float:
    """Return the number that a paper prints."""
    number = papers.claim(claim).published
    assert number is not None, claim
    return number


def _without_paths(configuration: dict[str, Any]) -> dict[str, Any]:
    """Return the configuration with folders of this machine reduced to their last name."""
    data = dict(configuration["data"])
    for option in PRIVATE_PATHS:
        if data.get(option):
            data[option] = Path(data[option]).name
    return {**configuration, "data": data, "results": Path(configuration["results"]).name}
