"""Summary printed after figures are made: files, durations, verdicts on the papers' claims, and remarks."""

from __future__ import annotations

import errno
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from pipeline.papers import Verdict

WIDE = 110
"""Smallest width of the terminal, in characters, at which the table of claims shows all columns."""

STAGES = ("ingest", "dataset", "model", "sweep", "figure")


def open_console() -> Console:
    """Return a console; if the output is not a terminal, the console is 160 characters wide."""
    terminal = _Console(highlight=False)
    return terminal if terminal.is_terminal else _Console(highlight=False, width=160)


class _Console(Console):
    """Console that raises an error if the program that reads the output has closed the pipe."""

    def on_broken_pipe(self) -> None:
        """Raise BrokenPipeError, which the function `main` reports to the user."""
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))


@dataclass(frozen=True)
class Outcome:
    """Results of a figure that was made successfully.

    Attributes
    ----------
    figure : str
    folder : Path
    seconds : dict
        Wall time of each stage.
    reused : tuple of str
        Stages whose result was found in the cache.
    verdicts : list of Verdict
        Verdicts on the claims that use only this figure.
    remarks : tuple of str
        Warnings, one sentence each.
    processor_s : float
        Processor time of the figure, summed over all cores.
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
    """Error message of a figure that could not be made.

    Attributes
    ----------
    figure : str
    sentence : str
        Error message.
    traceback : str
        Traceback of a bug; empty for an error that the user can correct.
    """

    figure: str
    sentence: str
    traceback: str = ""


Made = Outcome | Failure


def summarise(
    outcomes: Sequence[Outcome], verdicts: Sequence[Verdict], console: Console, *, seconds: float
) -> None:
    """Print the table of figures with durations, their folders, the verdicts on the papers' claims, and remarks.

    `seconds` is the duration of the whole run.
    """
    figures = Table(title="Figures", title_justify="left", box=None, pad_edge=False)
    for heading in ("figure", "seconds", "figure stage", "processor", "reused"):
        left = heading in ("figure", "reused")
        figures.add_column(heading, justify="left" if left else "right", no_wrap=heading == "figure")
    for outcome in outcomes:
        figures.add_row(
            outcome.figure,
            f"{sum(outcome.seconds.values()):.2f}",
            f"{outcome.seconds['figure']:.2f}",
            f"{outcome.processor_s:.2f}",
            " ".join(outcome.reused) or "-",
        )
    console.print(figures)
    for folder in dict.fromkeys(outcome.folder for outcome in outcomes):
        console.print(f"{folder}/", soft_wrap=True)  # never shortened: it is copied
    kinds = Counter(path.suffix for outcome in outcomes for path in outcome.folder.iterdir())
    files = [f"{kinds[end]} {kind}{'s' * (kinds[end] > 1)}" for end, kind in _KINDS.items() if kinds[end]]
    console.print(f"Files: {', '.join(files)}.")
    processor = sum(outcome.processor_s for outcome in outcomes)
    console.print(
        f"Made in {seconds:.1f} s with {processor:.1f} s of processor time (seconds per stage over all figures: "
        + ", ".join(f"{stage} {sum(outcome.seconds[stage] for outcome in outcomes):.1f}" for stage in STAGES)
        + ")."
    )
    if verdicts:
        rows = claim_rows(verdicts)
        console.print(claims_table(rows, console.width))
        console.print("\n".join(counts(verdicts)), soft_wrap=True)
    for remark in dict.fromkeys(r for outcome in outcomes for r in outcome.remarks):
        console.print(Text(remark, style="yellow"), soft_wrap=True)


_KINDS = {".csv": "table", ".svg": "picture", ".rrd": "recording"}
"""Kind of file, in words, for each suffix."""

_AGREEMENTS = {
    "agrees": "green",
    "close": "yellow",
    "undecided": "yellow",
    "differs": "red",
    "met": "green",
    "not met": "red",
    "untestable": "dim",
    "not judged at smoke scale": "dim",
}
_BEYOND = {
    "yes": ("green", "beyond the baseline"),
    "no": ("yellow", "not"),
    "worse": ("red", "worse than it"),
    "unknown": ("yellow", "not known"),
}
"""Colour and words for each result of a comparison with the baseline, in the order of counting."""

_SHORT = {"not judged at smoke scale": "not judged"}
"""Short forms of long verdicts, for the printed table."""

Row = dict[str, str]


def claim_rows(verdicts: Sequence[Verdict]) -> list[Row]:
    """Return the rows of the table of claims as text, sorted by kind of claim; ``why`` is empty if the claim agrees."""
    from pipeline.papers import Kind, all_papers

    rows, kinds = [], list(Kind)
    keys = [*all_papers()]
    for v in sorted(verdicts, key=lambda v: (kinds.index(v.claim.kind), keys.index(v.claim.paper))):
        evidence, agreement = v.evidence, str(v.agreement)
        rows.append(
            {
                "agreement": agreement,
                "beyond baseline": str(v.beyond) if v.beyond in _BEYOND else "",
                "paper": v.claim.paper,
                "claim": v.claim.text.short,
                "name": v.claim.name,
                "quote": v.claim.text.quote if v.claim.kind is Kind.TARGET else f"“{v.claim.text.quote}”",
                "published": "" if v.claim.published is None else f"{v.claim.published:g}",
                "ours": str(evidence.value) if evidence else "",
                "unit": v.claim.unit,
                "baseline": str(evidence.baseline) if evidence and evidence.baseline else "",
                "kind": str(v.claim.kind),
                "why": v.why if evidence and agreement not in ("agrees", "met") else "",
            }
        )
    return rows


def claims_table(rows: Sequence[Row], width: int = 160) -> Table:
    """Return the table of claims by kind and paper: verdict, result against the baseline, short name, and values.

    The baseline's number needs a width of `WIDE` columns.
    """
    table = Table(title="Claims", title_justify="left", box=None, pad_edge=False)
    table.add_column("agreement", no_wrap=True)
    table.add_column("beyond", no_wrap=True)
    table.add_column("claim")
    for heading in ("paper", "ours", *(["baseline"] if width >= WIDE else [])):
        table.add_column(heading, justify="right")
    for (kind, paper), of_group in groupby(rows, lambda row: (row["kind"], row["paper"])):
        table.add_row(Text(f"{kind}s", style="bold"), "", Text(paper, style="bold"))
        for row in of_group:
            agreement, beyond = row["agreement"], row["beyond baseline"]
            table.add_row(
                Text(_SHORT.get(agreement, agreement), _AGREEMENTS.get(agreement, "")),
                Text(beyond, _BEYOND.get(beyond, ("",))[0]),
                row["claim"],
                row["published"],
                f"{row['ours']} {row['unit']}".strip() if row["ours"] else "",
                *([row["baseline"]] if width >= WIDE else []),
            )
    return table


def counts(verdicts: Sequence[Verdict]) -> list[str]:
    """Return lines that count the verdicts for each kind of claim, and for each paper."""
    from pipeline.papers import JUDGED, OF_PAPERS, Agreement, Beyond, Kind, all_papers, count, count_by_kind

    rows, lines = [verdict.row for verdict in verdicts], []
    for kind, tally in count_by_kind(rows).items():
        parts = []
        for agreement, number, answers in tally.rows:
            words = ", ".join(f"{times} {_BEYOND[beyond][1]}" for beyond, times in answers)
            parts.append(f"{number} {agreement}" + (f" ({words})" if words else ""))
        lines.append(f"{kind}s: {', '.join(parts)}")
    for key, paper in all_papers().items():
        tally = count(
            (row for row in rows if row["paper"] == key), OF_PAPERS if paper.figures else [Kind.TARGET]
        )
        if tally.judged:
            beyond = tally.number(Agreement.AGREES, beyond=Beyond.YES)
            others = ", ".join(
                f"{tally.number(agreement_kind)} {agreement_kind}" for agreement_kind in JUDGED[1:]
            )
            lines.append(
                f"{key}{'' if paper.figures else ' (our targets)'}: {tally.number(Agreement.AGREES)} of {tally.judged}"
                f" agree ({beyond} beyond the baseline); {others}; {tally.number(Agreement.UNTESTABLE)} untestable"
            )
    return lines
