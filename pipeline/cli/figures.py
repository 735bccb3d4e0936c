"""Making one figure from its experiment, and several with a progress display and a summary."""

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
    """Run the five stages and publish the figure in `folder`; `at` is called with each stage that begins.

    With `early`, first without further populations.
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
    reused = tuple(kept.artefact.stage for kept in stages if not kept.artefact.computed)
    remarks = [remark for kept in stages for remark in getattr(kept.value, "remarks", [])]
    remarks += _remarks_on(stages[0].value)
    took_s = _processor_s() - processor_s
    return Outcome(experiment.name, folder, seconds, reused, verdicts, tuple(remarks), took_s)


def _processor_s() -> float:
    """Return the processor time of this process and its helpers."""
    return sum(os.times()[:4])


def _remarks_on(clips: Clips) -> list[str]:
    """Return warnings on the clips: unusual ones that are kept, and how many are refused."""
    remarks = [
        f"{row['clip']} is {row['reason']}: look at its frame rate"
        for row in clips.report
        if row["verdict"] == "kept" and row["code"] == FAR_FREQUENCY
    ]
    refused = [row for row in clips.report if row["verdict"] == "refused"]
    if refused:
        remarks.append(
            f"{len(refused)} of {len(clips.report)} clips refused, with reasons, in table_ingest.csv"
            f" (e.g. {refused[0]['clip']}: {refused[0]['reason']})"
        )
    return remarks


def attempt(experiment: Experiment, folder: Path, at: Callable[[str], None], *, early: bool = False) -> Made:
    """Make a figure and return it, or why it could not be made; it comes early also where it is the first.

    A store of its own remembers the artefacts of one figure: memory does not grow with the number of figures.
    """
    early |= not folder.parent.exists()
    try:
        return make_figure(
            experiment, folder, store=Store(Path(experiment.results), core_lent), at=at, early=early
        )
    except Exception as error:
        words = sentence(error)
        if words:
            return Failure(experiment.name, words)
        return Failure(experiment.name, f"{type(error).__name__}: {error}", traceback.format_exc())


def make_figures(jobs: Jobs, *, console: Console) -> list[str]:
    """Make figures and return why some were not made, a sentence each; the others are made all the same.

    Parameters
    ----------
    jobs : sequence of (Experiment, Path)
        Each figure's experiment and folder, in the order in which they are begun.  As many processes as the
        experiments' `workers` make them side by side; one figure alone uses all of these for its own work.
    console : Console
        For progress and summary; why figures were not made is printed to standard error.
    """
    cores = max([1, *(experiment.workers for experiment, _ in jobs)])
    processes = min(cores, len(jobs))
    started = time.perf_counter()
    with Display([e for e, _ in jobs], console, slots=processes) as display:
        if processes > 1:
            made = make_side_by_side(jobs, attempt, display, processes=processes, cores=cores)
        else:
            made = _make_in_turn(jobs, display)
    return report(jobs, made, console, seconds=time.perf_counter() - started)


def report(
    jobs: Jobs,
    made: Sequence[Made],
    console: Console,
    *,
    seconds: float,
) -> list[str]:
    """Print the summary of figures that were made in some time, and return why some were not, a sentence each."""
    outcomes = [one for one in made if isinstance(one, Outcome)]
    if outcomes:
        own = {e.name for e, _ in jobs if isinstance(e.data, FolderData)}
        for words in filter(None, (own_result(one.folder) for one in outcomes if one.figure in own)):
            console.print(Text(words, style="bold"), soft_wrap=True)
        verdicts = _ledger(outcomes, {e.name: e for e, _ in jobs})
        summarise(outcomes, verdicts, console, seconds=seconds)
    failures = [one for one in made if isinstance(one, Failure)]
    complaints = Console(stderr=True, highlight=False)
    for trace in dict.fromkeys(failure.traceback for failure in failures if failure.traceback):
        complaints.print(Text(trace), soft_wrap=True)
    by_sentence: dict[str, list[str]] = {}
    for failure in failures:
        by_sentence.setdefault(failure.sentence, []).append(failure.figure)
    for words, figures in by_sentence.items():
        complaints.print(Text(f"refused ({', '.join(figures)}): {words}", style="red"), soft_wrap=True)
    return list(by_sentence)


def _make_in_turn(jobs: Jobs, display: Display) -> list[Made]:
    """Make figures one after the other in this process."""
    made: list[Made] = []
    for number, (experiment, folder) in enumerate(jobs):
        display.began(0, number)
        made.append(attempt(experiment, folder, lambda stage: display.at(0, stage), early=len(jobs) == 1))
        display.ended(0, number, made[-1])
    return made


def _ledger(outcomes: Sequence[Outcome], experiments: dict[str, Experiment]) -> list[papers.Verdict]:
    """Return the verdicts on these figures; writes ``claims.csv`` beside several that share a folder."""
    parents = {outcome.folder.parent for outcome in outcomes}
    if len(parents) > 1 or len(outcomes) == 1:
        return [verdict for outcome in outcomes for verdict in outcome.verdicts]
    parent = parents.pop()
    figures = [outcome.figure for outcome in outcomes]
    one = experiments[figures[0]]
    verdicts = judge_folder(
        parent, one.data.name, figures, measures=all_measures(), overridden=parent != one.published_in
    )
    write_claims(parent / "claims.csv", verdicts, judged=figures)
    return verdicts
