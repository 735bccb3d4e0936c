"""One figure from its configuration, and many figures with one progress display and one summary."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from pipeline.storage.store import Store
from pipeline.studies.options import Config
from pipeline.validation import InvalidInput

if TYPE_CHECKING:
    from pipeline.papers import Verdict
    from pipeline.studies.figure_inputs import Made

STAGES = ("ingest", "dataset", "model", "sweep", "report")


def open_console() -> Console:
    """A console; as wide as its tables where the output is not a terminal."""
    terminal = Console(highlight=False)
    return terminal if terminal.is_terminal else Console(highlight=False, width=160)


@dataclass(frozen=True)
class Outcome:
    """What came of one figure.

    Attributes
    ----------
    figure : str
    folder : Path
    seconds : dict
        Wall time of each stage.
    reused : tuple of str
        Stages whose artefact was found in the cache.
    verdicts : list of Verdict
        On the claims that the figure backs.
    remarks : tuple of str
        What a person should know, one sentence each.
    """

    figure: str
    folder: Path
    seconds: dict[str, float]
    reused: tuple[str, ...]
    verdicts: list[Verdict]
    remarks: tuple[str, ...]


def not_for(config: Config) -> str:
    """Why the data set has nothing for this figure, in a sentence; empty if it has."""
    from pipeline.stages import report

    try:
        report.check(config)
    except InvalidInput as refusal:
        if refusal.where == "data":
            return str(refusal)
    return ""


def make_figure(
    config: Config, folder: Path, *, store: Store, at: Callable[[str], None] = lambda stage: None
) -> Outcome:
    """Run the five stages in order and publish the figure in `folder`; `at` hears each stage begin."""
    # Imported here, so that help and refusals of configuration do not wait for scipy and pandas.
    from pipeline.stages import dataset, ingest, model, report, sweep
    from pipeline.studies.figure_inputs import Made

    seconds: dict[str, float] = {}
    last = time.perf_counter()

    def done(stage: str) -> None:
        nonlocal last
        now = time.perf_counter()
        seconds[stage], last = now - last, now

    if config.workers < 1:
        raise InvalidInput(
            "nobody to do the work", where="workers", expected="1 or more", received=str(config.workers)
        )
    report.check(config)
    workers = config.workers
    at("ingest")
    clips = ingest.run(config.data, config.skeleton, config.seed, workers, store, purpose=config.purpose)
    done("ingest")
    at("dataset")
    samples = dataset.run(config.dataset, clips, workers, store)
    done("dataset")
    at("model")
    learnt = model.run(config.model, samples, workers, store)
    done("model")
    at("sweep")
    swept = sweep.run(config.sweep, clips, samples, learnt, workers, store, seed=config.seed)
    done("sweep")
    at("report")
    made = Made(config, clips, samples, learnt, swept)
    verdicts = report.run(made, folder, store)
    done("report")
    reused = tuple(a.stage for a in (clips, samples, learnt, swept) if not a.computed)
    return Outcome(config.figure, folder, seconds, reused, verdicts, tuple(_remarks(made)))


def _remarks(made: Made) -> list[str]:
    remarks = [remark for made_by in made.artefacts for remark in made_by.notes.get("remarks", [])]
    remarks += [
        f"{row['clip']} is {row['reason']}: look at its frame rate"
        for row in made.ingest.notes["report"]
        if row["verdict"] == "kept" and "than the others" in row["reason"]
    ]
    refused = [row for row in made.ingest.notes["report"] if row["verdict"] == "refused"]
    if refused:
        total = len(made.ingest.notes["report"])
        remarks.append(
            f"{len(refused)} of {total} clips refused, with reasons, in table_ingest.csv"
            f" (e.g. {refused[0]['clip']}: {refused[0]['reason']})"
        )
    if made.sweep.notes.get("not_converged"):
        remarks.append(
            f"{made.config.figure}: {made.sweep.notes['not_converged']} view angles did not converge"
        )
    return remarks


def make_figures(jobs: Sequence[tuple[Config, Path]], *, console: Console) -> list[str]:
    """Why figures were refused, a sentence each, empty if none was; one that is does not stop the others.

    Parameters
    ----------
    jobs : sequence of (Config, Path)
        Each figure's configuration and folder.
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
        for number, (config, folder) in enumerate(jobs):
            first = number * len(STAGES)

            def at(stage: str, figure: str = config.figure, first: int = first) -> None:
                progress.update(task, description=f"{figure}: {stage}", completed=first + STAGES.index(stage))

            try:
                store = stores.get(config.results) or stores.setdefault(
                    config.results, Store(Path(config.results))
                )
                outcomes.append(make_figure(config, folder, store=store, at=at))
            except InvalidInput as refusal:
                refusals.setdefault(str(refusal), []).append(config.figure)
    if outcomes:
        summarise(outcomes, _ledger(outcomes, {c.figure: c for c, _ in jobs}), console)
    complaints = Console(stderr=True, highlight=False)
    for sentence, figures in refusals.items():
        complaints.print(Text(f"refused ({', '.join(figures)}): {sentence}", style="red"), soft_wrap=True)
    return list(refusals)


def _ledger(outcomes: Sequence[Outcome], configs: dict[str, Config]) -> list[Verdict]:
    """Verdicts on what these figures back together; ``claims.csv`` beside them where they share a folder."""
    from pipeline.papers import OVERRIDDEN
    from pipeline.studies.ledger import judge_folder, write_claims

    parents = {outcome.folder.parent for outcome in outcomes}
    if len(parents) > 1 or len(outcomes) == 1:
        return [verdict for outcome in outcomes for verdict in outcome.verdicts]
    parent = parents.pop()
    figures = [outcome.figure for outcome in outcomes]
    config = configs[figures[0]]
    as_preset = parent == Path(config.results) / config.data.name / config.scale.name
    verdicts = judge_folder(parent, config.data.name if as_preset else OVERRIDDEN, figures)
    write_claims(parent / "claims.csv", verdicts)
    return verdicts


def summarise(outcomes: Sequence[Outcome], verdicts: Sequence[Verdict], console: Console) -> None:
    """Print what was made, where, in how many seconds, and the verdicts on the papers' claims."""
    figures = Table(title="Figures", title_justify="left", box=None, pad_edge=False)
    for heading in ("figure", "seconds", "of which report", "reused", "folder", "files"):
        figures.add_column(heading, justify="right" if "second" in heading or "which" in heading else "left")
    for outcome in outcomes:
        files = sorted(p.name for p in outcome.folder.iterdir() if p.suffix in {".rrd", ".svg", ".png"})
        tables = sorted(p.name for p in outcome.folder.glob("table*.csv"))
        figures.add_row(
            outcome.figure,
            f"{sum(outcome.seconds.values()):.2f}",
            f"{outcome.seconds['report']:.2f}",
            " ".join(outcome.reused) or "-",
            f"{outcome.folder}/",
            f"{len(tables)} tables, {' '.join(files)}",
        )
    console.print(figures)
    total: dict[str, float] = {}
    for outcome in outcomes:
        for stage, seconds in outcome.seconds.items():
            total[stage] = total.get(stage, 0.0) + seconds
    computed = sum(v for stage, v in total.items() if stage != "report")
    console.print(
        f"Computed in {computed:.1f} s ("
        + ", ".join(f"{stage} {total[stage]:.1f}" for stage in STAGES if stage != "report")
        + f"), tabulated, drawn and logged in {total['report']:.1f} s."
    )
    if verdicts:
        console.print(claims_table(verdicts))
    for remark in dict.fromkeys(r for outcome in outcomes for r in outcome.remarks):
        console.print(Text(remark, style="yellow"), soft_wrap=True)


_STYLES = {"reproduced": "green", "direction only": "yellow", "differs": "red"}


def claims_table(verdicts: Sequence[Verdict]) -> Table:
    """The claims with the published number, ours and the verdict."""
    table = Table(title="Claims", title_justify="left", box=None, pad_edge=False)
    for heading in ("claim", "published", "ours", "unit", "verdict"):
        table.add_column(heading, justify="right" if heading in ("published", "ours") else "left")
    for v in verdicts:
        table.add_row(
            v.claim.name,
            "" if v.claim.published is None else f"{v.claim.published:g}",
            "" if v.ours is None else f"{v.ours:.4g}",
            v.claim.unit,
            Text(v.verdict, style=_STYLES.get(v.verdict, "dim")),
        )
    return table
