"""The summary after figures are made: files, seconds, verdicts on the papers' claims, remarks."""

from __future__ import annotations

import errno
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from pipeline.papers import Agreement, Beyond, Kind, Verdict, count

WIDE = 110
"""Columns of a terminal in which all of a claim has room."""

STAGES = ("ingest", "dataset", "model", "sweep", "figure")


def open_console() -> Console:
    """Return a console, 160 columns wide if the output is not a terminal."""
    terminal = _Console(highlight=False)
    return terminal if terminal.is_terminal else _Console(highlight=False, width=160)


class _Console(Console):
    """A console that says so where its reader has gone."""

    def on_broken_pipe(self) -> None:
        """Raise the error, which `main` puts into words."""
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))


@dataclass(frozen=True)
class Outcome:
    """A figure that was made.

    Attributes
    ----------
    figure : str
    folder : Path
    seconds : dict
        Wall time of each stage.
    reused : tuple of str
        Stages whose result was found in the cache.
    verdicts : list of Verdict
        On the claims that rest on the figure alone.
    remarks : tuple of str
        Warnings, one sentence each.
    processor_s : float
        Processor time of all of it, on every core.
    """

    figure: str
    folder: Path
    seconds: dict[str, float]
    reused: tuple[str, ...]
    verdicts: list[Verdict]
    remarks: tuple[str, ...]
    processor_s: float


@dataclass(frozen=True)
class Failure:
    """A figure that was not made.

    Attributes
    ----------
    figure : str
    sentence : str
        Why.
    traceback : str
        Of a bug; empty for what the user can correct.
    """

    figure: str
    sentence: str
    traceback: str = ""


def summarise(
    outcomes: Sequence[Outcome], verdicts: Sequence[Verdict], console: Console, *, seconds: float
) -> None:
    """Print each figure with its files and seconds, the verdicts on the papers' claims and the remarks.

    `seconds` is the time that all of them took together.
    """
    figures = Table(title="Figures", title_justify="left", box=None, pad_edge=False)
    for heading in ("figure", "seconds", "of which figure", "processor", "reused", "folder", "files"):
        numeric = heading in ("seconds", "of which figure", "processor")
        figures.add_column(heading, justify="right" if numeric else "left")
    for outcome in outcomes:
        files = sorted(p.name for p in outcome.folder.iterdir() if p.suffix in {".rrd", ".svg", ".png"})
        tables = sorted(p.name for p in outcome.folder.glob("table*.csv"))
        figures.add_row(
            outcome.figure,
            f"{sum(outcome.seconds.values()):.2f}",
            f"{outcome.seconds['figure']:.2f}",
            f"{outcome.processor_s:.2f}",
            " ".join(outcome.reused) or "-",
            f"{outcome.folder}/",
            f"{len(tables)} tables, {' '.join(files)}",
        )
    console.print(figures)
    total: dict[str, float] = {}
    for outcome in outcomes:
        for stage, of_stage in outcome.seconds.items():
            total[stage] = total.get(stage, 0.0) + of_stage
    processor = sum(outcome.processor_s for outcome in outcomes)
    console.print(
        f"Made in {seconds:.1f} s, {processor:.1f} s of processor time (the stages of all figures: "
        + ", ".join(f"{stage} {total[stage]:.1f}" for stage in STAGES)
        + ")."
    )
    if verdicts:
        console.print(claims_table(verdicts))
        console.print("\n".join(counts_by_kind(verdicts)))
    for remark in dict.fromkeys(r for outcome in outcomes for r in outcome.remarks):
        console.print(Text(remark, style="yellow"), soft_wrap=True)


_STYLES = {
    Agreement.AGREES: "green",
    Agreement.MET: "green",
    Agreement.CLOSE: "yellow",
    Agreement.UNDECIDED: "yellow",
    Agreement.DIFFERS: "red",
    Agreement.NOT_MET: "red",
    Beyond.YES: "green",
    Beyond.NO: "yellow",
    Beyond.WORSE: "red",
    Beyond.UNKNOWN: "yellow",
}


def claims_table(verdicts: Sequence[Verdict], width: int = 160) -> Table:
    """Return the claims as a table, kind by kind: both answers, the published number, ours and the baseline's.

    In less than `WIDE` columns without the baseline's number.
    """
    table = Table(title="Claims", title_justify="left", box=None, pad_edge=False)
    headings = ["agreement", "beyond baseline", "claim", "published", "ours", "unit", "baseline"]
    headings = headings if width >= WIDE else headings[:-1]
    for heading in headings:
        right = heading in ("published", "ours", "baseline")
        table.add_column(heading, justify="right" if right else "left", overflow="fold")
    kinds = list(Kind)
    shown = None
    for v in sorted(verdicts, key=lambda v: kinds.index(v.claim.kind)):
        if v.claim.kind is not shown:
            shown = v.claim.kind
            table.add_row(Text(f"{shown}s", style="bold"))
        found = v.evidence
        beyond = "" if v.beyond is Beyond.NOT_APPLICABLE else str(v.beyond)
        cells: list[Text | str] = [
            Text(str(v.agreement), style=_STYLES.get(v.agreement, "dim")),
            Text(beyond, style=_STYLES.get(v.beyond, "dim")),
            v.claim.name,
            "" if v.claim.published is None else f"{v.claim.published:g}",
            str(found.value) if found else "",
            v.claim.unit,
            str(found.baseline) if found and found.baseline else "",
        ]
        table.add_row(*cells[: len(headings)])
    return table


def counts_by_kind(verdicts: Sequence[Verdict]) -> list[str]:
    """Return a line to each kind of claims: how many have each agreement, and of those how many are beyond what."""
    lines = []
    for kind, of_kind in count(verdicts).items():
        told = []
        for agreement in Agreement:
            apart = {beyond: n for (found, beyond), n in of_kind.items() if found is agreement}
            beyond = [f"{apart[b]} {_BEYOND[b]}" for b in Beyond if b in apart and b in _BEYOND]
            if apart:
                told.append(
                    f"{sum(apart.values())} {agreement}" + (f" ({', '.join(beyond)})" if beyond else "")
                )
        lines.append(f"{kind}s: " + ", ".join(told))
    return lines


_BEYOND = {
    Beyond.YES: "beyond the baseline",
    Beyond.NO: "not",
    Beyond.WORSE: "worse than it",
    Beyond.UNKNOWN: "not known",
}
