"""The other commands: fetch, reconstruct, model, claims, equations, readme, view, archive, verify."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path
from typing import Any

from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TransferSpeedColumn
from rich.text import Text

from pipeline import papers
from pipeline.cli.compose import compose
from pipeline.cli.figures import lacking
from pipeline.cli.presets import listed, presets
from pipeline.cli.reconstruct import reconstruct, train_model
from pipeline.cli.summary import claims_table, open_console
from pipeline.clips.options import RecordedData
from pipeline.storage import archive, provenance, tables
from pipeline.studies import published
from pipeline.studies.ledger import judge_folder, write_claims
from pipeline.validation import InvalidInput


def built_figures() -> list[str]:
    """Return the presets that exist, in the papers' order."""
    there = set(presets())
    return [
        name for paper in papers.PAPERS.values() for name in (*paper.figures, *paper.beyond) if name in there
    ]


def figures_for(arguments: Sequence[str]) -> list[str]:
    """Return those for which the data set has clips."""
    return [name for name in built_figures() if not lacking(compose([f"experiment={name}", *arguments]))]


def fetch(arguments: Sequence[str]) -> int:
    """Download the public recordings; return 1 if some failed."""
    from pipeline.fetch import Progress as Progress_
    from pipeline.fetch import fetch as fetch_files

    options = [item for item in arguments if "=" in item]
    only = [item for item in arguments if "=" not in item]
    data = compose(["experiment=zhang2007_fig2", "data=optical", *options]).data
    if not isinstance(data, RecordedData):
        raise InvalidInput("must be optical, cmu or hdm05", where="data", received=data.name)
    out = open_console()
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        DownloadColumn(),
        TransferSpeedColumn(),
        console=out,
        disable=not out.is_terminal,
        transient=True,
    ) as progress:
        task = progress.add_task("recordings", total=None)

        def show(state: Progress_) -> None:
            progress.update(
                task,
                description=f"{state.files_done}/{state.files_total} {state.path}",
                completed=state.bytes_done,
                total=state.bytes_total,
            )

        report = fetch_files(
            Path(data.table),
            Path(data.raw),
            mirror=Path(data.mirror) if data.mirror else None,
            only=only or None,
            progress=show,
        )
    out.print(Text(str(report)), soft_wrap=True)
    return 1 if report.failed else 0


def _results_folder(arguments: Sequence[str]) -> tuple[Any, Path]:
    config = compose(["experiment=zhang2007_fig2", *arguments])
    return config, Path(config.results) / config.data.name / config.scale.name


def claims(arguments: Sequence[str]) -> int:
    """Print the papers' claims beside our numbers, and write claims.csv beside the figures."""
    config, folder = _results_folder(arguments)
    verdicts = judge_folder(folder, config.data.name, figures_for(arguments))
    if folder.is_dir():
        write_claims(folder / "claims.csv", verdicts)
    out = open_console()
    out.print(claims_table(verdicts))
    for verdict in verdicts:
        if verdict.verdict in ("differs", "direction only"):
            out.print(Text(f"{verdict.claim.name}: {verdict.why}"), soft_wrap=True)
    counts = {v.verdict: sum(w.verdict == v.verdict for w in verdicts) for v in verdicts}
    out.print(
        f"{config.data.name}, {config.scale.name}: " + ", ".join(f"{n} {kind}" for kind, n in counts.items())
    )
    return 0


def equations(arguments: Sequence[str]) -> int:
    """Print every numbered equation: in words, the function as printed, the one in use, and the test."""
    chosen = [papers.paper(key) for key in arguments] or list(papers.PAPERS.values())
    out = open_console()
    for paper in chosen:
        out.print(
            Text(f"{paper.key}: {paper.authors} ({paper.year}). {paper.title}.", style="bold"), soft_wrap=True
        )
        for equation in paper.equations:
            printed = _where(equation.printed)
            used = _where(equation.used) if equation.used else "by no result"
            out.print(Text(f"  ({equation.number}) {equation.words}"), soft_wrap=True)
            out.print(Text(f"      printed: {printed}  {equation.test}", style="dim"), soft_wrap=True)
            out.print(Text(f"      used:    {used}", style="dim"), soft_wrap=True)
            if equation.note:
                out.print(Text(f"      note: {equation.note}", style="dim"), soft_wrap=True)
    return 0


def _where(dotted: str) -> str:
    """Return file, line and name of a function."""
    path, line = papers.locate(dotted)
    return f"{path.relative_to(provenance.PROJECT).as_posix()}:{line} {dotted.rpartition('.')[2]}"


def readme(arguments: Sequence[str]) -> int:
    """Write the README's tables from results/published.csv; ``data=...`` first renews the rows of a data set."""
    layout = papers.read_mapping(provenance.PROJECT / "conf" / "readme.yaml")
    path = provenance.PROJECT / "results" / "published.csv"
    if arguments:
        _, folder = _results_folder(arguments)
        published.renew(path, published.measured(folder, figures_for(arguments), layout))
    document = provenance.PROJECT / "README.md"
    text = document.read_text(encoding="utf-8")
    made = {"figures": listed(), **published.rendered(layout, tables.read(path))}
    document.write_text(published.insert(text, made), encoding="utf-8")
    return 0


def view(arguments: Sequence[str]) -> int:
    """Open a figure's recording in the rerun viewer."""
    if not arguments or "=" in arguments[0]:
        raise InvalidInput("no figure is named", expected="view FIGURE", received=" ".join(arguments))
    path = Path(arguments[0])
    if path.suffix != ".rrd":
        _, folder = _results_folder(arguments[1:])
        path = folder / arguments[0] / "recording.rrd"
    if not path.is_file():
        raise InvalidInput("no such recording yet", where=str(path), expected=f"`make {arguments[0]}` first")
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise InvalidInput(
            "the viewer needs a screen",
            where=str(path),
            expected="a desktop session; or copy the file to one and open it with `rerun`, version 0.41",
        )
    # A process of its own, since only `recordings` imports rerun.
    return subprocess.run(
        [sys.executable, "-m", "rerun", "--bind", "127.0.0.1", str(path)], check=False
    ).returncode


def keep(arguments: Sequence[str]) -> int:
    """Archive the full-scale results of this commit in results/archive."""
    config, folder = _results_folder(arguments)
    figures = figures_for(arguments)
    if folder.is_dir():
        write_claims(folder / "claims.csv", judge_folder(folder, config.data.name, figures))
    made_with = provenance.provenance()
    kept = archive.keep(
        folder,
        Path(config.results) / "archive",
        date=date.today().isoformat(),
        commit=made_with["commit"],
        dirty=made_with["dirty"],
        figures_expected=figures,
    )
    open_console().print(f"kept in {kept}")
    return 0


def verify(arguments: Sequence[str]) -> int:
    """Re-hash archives and print every file that changed, is missing or was added."""
    if not arguments:
        raise InvalidInput("no archive is named", expected="verify results/archive/<date>-<commit>")
    status = 0
    for name in arguments:
        complaints = archive.verify(Path(name))
        for complaint in complaints:
            print(f"{name}: {complaint}")
        if complaints:
            status = 1
        else:
            print(f"{name}: every file is as it was kept")
    return status


COMMANDS: dict[str, Callable[[Sequence[str]], int]] = {
    "fetch": fetch,
    "reconstruct": reconstruct,
    "model": train_model,
    "claims": claims,
    "equations": equations,
    "readme": readme,
    "view": view,
    "archive": keep,
    "verify": verify,
}
"""Commands by name."""
