"""Computation of one figure from its experiment, or of several figures with a progress display and a summary."""

from __future__ import annotations

import os
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.text import Text

from pipeline import papers
from pipeline.cli.errors import sentence
from pipeline.cli.own_result import own_result
from pipeline.cli.pool import Jobs, make_side_by_side
from pipeline.cli.progress import Display
from pipeline.cli.summary import Failure, Made, Outcome, summarise
from pipeline.clips.kinds import Clips
from pipeline.clips.walks import FAR_FREQUENCY
from pipeline.ingestion.data import FolderData
from pipeline.processes import core_lent
from pipeline.stages import chain, figure
from pipeline.storage.sealed_folders import require_replaceable
from pipeline.storage.store import Store
from pipeline.studies.experiment import Experiment
from pipeline.studies.ledger import judge_folder, write_claims
from pipeline.studies.registry import all_measures


def make_figure(
    experiment: Experiment,
    folder: Path,
    *,
    store: Store,
    at: Callable[[str], None] = lambda stage: None,
    early: bool = False,
) -> Outcome:
    """Run the five stages of an experiment, publish the figure in `folder`, and return the outcome.

    `at` is called with the name of each stage when it starts.  With `early`, the figure is first published without
    further populations.
    """
    experiment.validate()
    require_replaceable(folder)
    seconds: dict[str, float] = {}
    processor_s = _processor_s()

    @contextmanager
    def stage(name: str) -> Iterator[None]:
        at(name)
        started = time.perf_counter()
        yield
        seconds[name] = time.perf_counter() - started

    stages = chain.run(experiment, store, at=stage)
    with stage("figure"):
        verdicts = figure.run(experiment, stages, folder, store, measures=all_measures(), early=early)
    reused = tuple(result.artefact.stage for result in stages if not result.artefact.computed)
    remarks = [remark for result in stages for remark in getattr(result.value, "remarks", [])]
    remarks += _remarks_on(stages[0].value)
    took_s = _processor_s() - processor_s
    return Outcome(experiment.name, folder, seconds, reused, verdicts, tuple(remarks), took_s)


def _processor_s() -> float:
    """Return the processor time, s, of this process and its child processes."""
    return sum(os.times()[:4])


def _remarks_on(clips: Clips) -> list[str]:
    """Return warnings about used clips with an unusual stride frequency, and about the number of rejected clips."""
    remarks = [
        f"{row['clip']} is {row['reason']}: check its frame rate"
        for row in clips.report
        if row["verdict"] == "kept" and row["code"] == FAR_FREQUENCY
    ]
    refused = [row for row in clips.report if row["verdict"] == "refused"]
    if refused:
        remarks.append(
            f"{len(refused)} of {len(clips.report)} clips are rejected; table_ingest.csv has the reasons"
            f" (e.g. {refused[0]['clip']}: {refused[0]['reason']})"
        )
    return remarks


def attempt(
    experiment: Experiment,
    folder: Path,
    at: Callable[[str], None],
    *,
    early: bool = False,
    store: Store | None = None,
) -> Made:
    """Make a figure, and return the outcome or the failure.

    The first figure of a folder is published early.

    Each figure uses a new store, so that memory does not grow with the number of figures.
    """
    early |= not folder.parent.exists()
    try:
        store = store or Store(Path(experiment.results), core_lent)
        return make_figure(experiment, folder, store=store, at=at, early=early)
    except Exception as error:
        words = sentence(error)
        if words:
            return Failure(experiment.name, words)
        return Failure(experiment.name, f"{type(error).__name__}: {error}", traceback.format_exc())


def make_figures(jobs: Jobs, *, console: Console) -> list[str]:
    """Make several figures and return the error messages; a failed figure does not stop the others.

    Parameters
    ----------
    jobs : sequence of (Experiment, Path)
        Experiment and folder of each figure, in starting order.  The largest `workers` of the experiments is the number
        of processes; a single figure uses all of them for its own work.
    console : Console
        Console for progress and summary; error messages go to standard error.
    """
    cores = max([1, *(experiment.workers for experiment, _ in jobs)])
    processes = min(cores, len(jobs))
    started = time.perf_counter()
    with Display([e for e, _ in jobs], console, slots=processes) as display:
        if processes > 1:
            results = make_side_by_side(jobs, attempt, display, processes=processes, cores=cores)
        else:
            results = _make_in_turn(jobs, display)
    return report(jobs, results, console, seconds=time.perf_counter() - started)


def report(
    jobs: Jobs,
    results: Sequence[Made],
    console: Console,
    *,
    seconds: float,
) -> list[str]:
    """Print the summary of all figures and the errors of failed figures, and return the error messages.

    `seconds` is the duration of the whole run.
    """
    outcomes = [result for result in results if isinstance(result, Outcome)]
    if outcomes:
        on_user_data = {e.name for e, _ in jobs if isinstance(e.data, FolderData)}
        for words in filter(
            None, (own_result(result.folder) for result in outcomes if result.figure in on_user_data)
        ):
            console.print(Text(words, style="bold"), soft_wrap=True)
        verdicts = _ledger(outcomes, {e.name: e for e, _ in jobs})
        summarise(outcomes, verdicts, console, seconds=seconds)
    failures = [result for result in results if isinstance(result, Failure)]
    complaints = Console(stderr=True, highlight=False)
    for trace in dict.fromkeys(failure.traceback for failure in failures if failure.traceback):
        complaints.print(Text(trace), soft_wrap=True)
    by_sentence: dict[str, list[str]] = {}
    for failure in failures:
        by_sentence.setdefault(failure.sentence, []).append(failure.figure)
    for words, figures in by_sentence.items():
        complaints.print(Text(f"not made ({', '.join(figures)}): {words}", style="red"), soft_wrap=True)
    return list(by_sentence)


def _make_in_turn(jobs: Jobs, display: Display) -> list[Made]:
    """Make figures one after the other in this process."""
    results: list[Made] = []
    for number, (experiment, folder) in enumerate(jobs):
        display.began(0, number)
        results.append(attempt(experiment, folder, lambda stage: display.at(0, stage), early=len(jobs) == 1))
        display.ended(0, number, results[-1])
    return results


def _ledger(outcomes: Sequence[Outcome], experiments: dict[str, Experiment]) -> list[papers.Verdict]:
    """Return the verdicts on the claims about figures, and write ``claims.csv`` if the figures are in one folder."""
    parents = {outcome.folder.parent for outcome in outcomes}
    if len(parents) > 1 or len(outcomes) == 1:
        return [verdict for outcome in outcomes for verdict in outcome.verdicts]
    parent = parents.pop()
    figures = [outcome.figure for outcome in outcomes]
    first = experiments[figures[0]]
    verdicts = judge_folder(
        parent, first.data.name, figures, measures=all_measures(), overridden=parent != first.published_in
    )
    write_claims(parent / "claims.csv", verdicts, judged=figures)
    return verdicts
