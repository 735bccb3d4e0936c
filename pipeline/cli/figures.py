"""Making one figure from its experiment, and several with a progress display and a summary."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.text import Text

from pipeline.cli.summary import STAGES, Outcome, summarise
from pipeline.clips.kinds import Clips
from pipeline.papers import OVERRIDDEN, Verdict
from pipeline.stages import dataset, figure, ingest, model, sweep
from pipeline.storage.sealed_folders import require_replaceable
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment
from pipeline.studies.ledger import judge_folder, write_claims
from pipeline.validation import InvalidInput


def lacking(experiment: Experiment) -> str:
    """Return why the data set has no clips for this experiment; empty if it has."""
    try:
        experiment.validate()
    except InvalidInput as error:
        if error.where == "data":
            return str(error)
    return ""


def make_figure(
    experiment: Experiment, folder: Path, *, store: Store, at: Callable[[str], None] = lambda stage: None
) -> Outcome:
    """Run the five stages and publish the figure in `folder`; `at` is called with each stage that begins."""
    experiment.validate()
    require_replaceable(folder)
    seconds: dict[str, float] = {}

    @contextmanager
    def stage(name: str) -> Iterator[None]:
        at(name)
        started = time.perf_counter()
        yield
        seconds[name] = time.perf_counter() - started

    with stage("ingest"):
        clips = ingest.run(experiment, store)
    with stage("dataset"):
        samples = dataset.run(experiment, clips, store)
    with stage("model"):
        learnt = model.run(experiment, samples, store)
    with stage("sweep"):
        measured = sweep.run(experiment, clips, samples, learnt, store)
    stages = (clips, samples, learnt, measured)
    with stage("figure"):
        verdicts = figure.run(experiment, stages, folder, store)
    reused = tuple(kept.artefact.stage for kept in stages if not kept.artefact.computed)
    remarks = [remark for kept in stages for remark in getattr(kept.value, "remarks", [])]
    return Outcome(experiment.name, folder, seconds, reused, verdicts, (*remarks, *_remarks_on(clips.value)))


def _remarks_on(clips: Clips) -> list[str]:
    """Return warnings on the clips: unusual ones that are kept, and how many are refused."""
    remarks = [
        f"{row['clip']} is {row['reason']}: look at its frame rate"
        for row in clips.report
        if row["verdict"] == "kept" and "than the others" in row["reason"]
    ]
    refused = [row for row in clips.report if row["verdict"] == "refused"]
    if refused:
        remarks.append(
            f"{len(refused)} of {len(clips.report)} clips refused, with reasons, in table_ingest.csv"
            f" (e.g. {refused[0]['clip']}: {refused[0]['reason']})"
        )
    return remarks


def make_figures(jobs: Sequence[tuple[Experiment, Path]], *, console: Console) -> list[str]:
    """Make figures and return why some were refused, a sentence each; the others are made all the same.

    Parameters
    ----------
    jobs : sequence of (Experiment, Path)
        Each figure's experiment and folder.
    console : Console
        For progress and summary; the refusals are printed to standard error.
    """
    outcomes: list[Outcome] = []
    refusals: dict[str, list[str]] = {}
    stores: dict[str, Store] = {}
    with Progress(
        TextColumn("{task.description}", justify="left"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=console,
        disable=not console.is_terminal,
        transient=True,
    ) as progress:
        task = progress.add_task("starting", total=len(jobs) * len(STAGES))
        for number, (experiment, folder) in enumerate(jobs):
            first = number * len(STAGES)

            def at(stage: str, name: str = experiment.name, first: int = first) -> None:
                progress.update(task, description=f"{name}: {stage}", completed=first + STAGES.index(stage))

            try:
                store = stores.get(experiment.results) or stores.setdefault(
                    experiment.results, Store(Path(experiment.results))
                )
                outcomes.append(make_figure(experiment, folder, store=store, at=at))
            except InvalidInput as error:
                refusals.setdefault(str(error), []).append(experiment.name)
    if outcomes:
        summarise(outcomes, _ledger(outcomes, {e.name: e for e, _ in jobs}), console)
    complaints = Console(stderr=True, highlight=False)
    for sentence, figures in refusals.items():
        complaints.print(Text(f"refused ({', '.join(figures)}): {sentence}", style="red"), soft_wrap=True)
    return list(refusals)


def _ledger(outcomes: Sequence[Outcome], experiments: dict[str, Experiment]) -> list[Verdict]:
    """Return the verdicts on these figures; writes ``claims.csv`` beside several that share a folder."""
    parents = {outcome.folder.parent for outcome in outcomes}
    if len(parents) > 1 or len(outcomes) == 1:
        return [verdict for outcome in outcomes for verdict in outcome.verdicts]
    parent = parents.pop()
    figures = [outcome.figure for outcome in outcomes]
    one = experiments[figures[0]]
    as_preset = parent == Path(one.results) / one.data.name / one.scale.name
    verdicts = judge_folder(parent, one.data.name if as_preset else OVERRIDDEN, figures)
    write_claims(parent / "claims.csv", verdicts)
    return verdicts
