"""Commands on the figures of a data set and on its recordings."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path

from rich.text import Text

from pipeline.cli.compose import compose, compose_figures, lacking
from pipeline.cli.durations import durations, insert_durations
from pipeline.cli.earlier_names import require_preset
from pipeline.cli.presets import apart, listed, split_named
from pipeline.cli.status import CURRENT, status
from pipeline.cli.summary import claim_rows, claims_table, counts, open_console
from pipeline.storage import archive, provenance, tables
from pipeline.storage.sealed_folders import FIGURE, MANIFEST, read_manifest, visible
from pipeline.studies.experiment import Experiment
from pipeline.studies.ledger import judge_folder, write_claims
from pipeline.studies.registry import all_measures
from pipeline.validation import InvalidInput, require_choice


def figures_for(arguments: Sequence[str], among: Sequence[str] = ()) -> tuple[Experiment, list[str]]:
    """Return an experiment on a data set and the figures for which it has clips: of all, or among some.

    Raises
    ------
    InvalidInput
        If the arguments name figures.
    """
    if split_named(arguments)[0]:
        raise InvalidInput(
            "this is done for all figures", "experiment", "no experiment=", code="for_all_figures"
        )
    found = compose_figures(among, arguments)
    return found[0], [one.name for one in found if not lacking(one)]


def fetch(arguments: Sequence[str]) -> int:
    """Download the public recordings; return 1 if some failed."""
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TransferSpeedColumn

    from pipeline.fetch import Progress as Progress_
    from pipeline.fetch import fetch as fetch_files
    from pipeline.ingestion.data import RecordedData

    options = [item for item in arguments if "=" in item]
    only = [item for item in arguments if "=" not in item]
    data = compose(["experiment=zhang2007_fig2", "data=optical", *options]).data
    if not isinstance(data, RecordedData):
        raise InvalidInput("must be optical, cmu or hdm05", "data", received=data.name, code="not_recorded")
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
            data.listing,
            Path(data.raw),
            mirror=data.mirrors,
            only=only or None,
            progress=show,
        )
    out.print(Text(str(report)), soft_wrap=True)
    return 1 if report.failed else 0


def report(arguments: Sequence[str]) -> int:
    """Judge the claims again and write the page over all figures of a data set."""
    one, figures = figures_for(arguments)
    open_console().print(make_page(one.published_in, one.data.name, figures), soft_wrap=True)
    return 0


def make_page(folder: Path, data_name: str, figures: Sequence[str]) -> str:
    """Write ``claims.csv`` and ``index.html`` in ``results/<data>/<scale>`` and return a sentence about the page."""
    from pipeline.report.document import write_page

    if folder.is_dir():
        write_claims(folder / "claims.csv", judge_folder(folder, data_name, figures, measures=all_measures()))
    page = write_page(folder, figures)
    return f"page: {page} ({page.stat().st_size / 1e6:.2f} MB)"


def claims(arguments: Sequence[str]) -> int:
    """Print the papers' claims beside our numbers, and write claims.csv beside the figures.

    ``claims FIGURE``, or ``experiment=a,b``, prints those on some figures, and writes none.
    """
    named, common = split_named([a if "=" in a else f"experiment={a}" for a in arguments])
    one, figures = figures_for(common, [*map(require_preset, named)])
    folder, out = one.published_in, open_console()
    if not folder.is_dir():
        from pipeline.report.entries import options_of

        words = f"nothing is made yet in {folder}: make sweeps{options_of(one.data.name, one.scale.name)}"
        out.print(words, soft_wrap=True)
        return 1
    verdicts = judge_folder(folder, one.data.name, figures, measures=all_measures())
    if not named:
        write_claims(folder / "claims.csv", verdicts)
    rows = claim_rows(verdicts)
    out.print(claims_table(rows, out.width))
    for row in rows:
        if row["why"]:
            heading = f"{row['paper']}, {row['claim']} ({row['name']}): {row['quote']}"
            out.print(Text(f"{heading}: {row['agreement']}: {row['why']}"), soft_wrap=True)
    out.print(f"{one.data.name}, {one.scale.name}")
    out.print("\n".join(counts(verdicts)), soft_wrap=True)
    return 0


FILLED_PAGES: Mapping[str, tuple[str, ...]] = {
    "README.md": ("first", "counts"),
    "CONTRIBUTING.md": (),
    "docs/index.md": (),
    "docs/figures.md": ("figures",),
    "docs/results.md": ("headline",),
}
"""Pages with durations of commands, and the tables of each that `readme` fills."""


def readme(arguments: Sequence[str]) -> int:
    """Write results and durations into docs/ and README.md, from results/published.csv and results/durations.csv.

    ``data=...`` first renews the rows of a data set from its published figures.  ``data=synthetic`` also draws the
    README's pictures, which need the figures of ``data=optical``.
    """
    from pipeline.papers import read_mapping
    from pipeline.studies import published

    layout = read_mapping(provenance.PROJECT / "conf" / "readme.yaml")
    path = provenance.PROJECT / "results" / "published.csv"
    if arguments:
        from pipeline.report.first_screen import RECORDED, draw_first_screen
        from pipeline.report.published import read_published

        one, figures = figures_for(arguments)
        folder = one.published_in
        published.renew(path, published.measured(folder, figures, layout, all_measures()))
        if one.data.name == "synthetic":
            other, theirs = figures_for(
                [a for a in arguments if not a.startswith("data=")] + [f"data={RECORDED}"]
            )
            draw_first_screen(
                read_published(folder, figures),
                read_published(other.published_in, theirs),
                provenance.PROJECT / "results" / "archive" / "light",
            )
    quoted = {name: layout[name] for name in ("headline", "first", "counts")}
    made = {"figures": listed(), **published.rendered(quoted, tables.read(path))}
    measured_s = durations(tables.read_rows(provenance.PROJECT / "results" / "durations.csv"))
    for document, names in FILLED_PAGES.items():
        page = provenance.PROJECT / document
        text = published.insert(page.read_text("utf-8"), {name: made[name] for name in names})
        page.write_text(insert_durations(text, measured_s), encoding="utf-8")
    return 0


def view(arguments: Sequence[str]) -> int:
    """Open a figure's recording in the rerun viewer."""
    if not arguments or "=" in arguments[0]:
        raise InvalidInput(
            "no figure is named", expected="view FIGURE", received=" ".join(arguments), code="no_figure_named"
        )
    path, first = Path(arguments[0]), ""
    if path.suffix != ".rrd":
        name = require_preset(arguments[0])
        one, _ = figures_for(arguments[1:], [name])
        path = one.published_in / name / "recording.rrd"
        first = f"`make {name} DATA={one.data.name} SCALE={one.scale.name}` first"
    if not path.is_file():
        raise InvalidInput("no such recording yet", path, first, code="no_recording")
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise InvalidInput(
            "the viewer needs a screen",
            path,
            "a desktop session; or a browser: `make report` writes a page with players, and "
            f"`.venv/bin/rerun --serve-web --bind 127.0.0.1 {path}` prints an address that shows it",
            code="no_screen",
        )
    # A process of its own, since only `recordings` imports rerun.
    return subprocess.run(
        [sys.executable, "-m", "rerun", "--bind", "127.0.0.1", str(path)], check=False
    ).returncode


def keep(arguments: Sequence[str]) -> int:
    """Archive full-scale results of this commit, or of another with the same sources, in results/archive.

    ``light=1`` writes the small archive of the repository, ``only=FIGURE`` keeps one figure, and ``name=NAME`` keeps a
    run with changed options: the latest in results/scratch, or ``run=FOLDER``.
    """
    own, arguments = apart(arguments, ("light", "only", "name", "run"))
    one, figures = figures_for(arguments)
    folder = one.published_in
    root, made_with, out = Path(one.results) / "archive", provenance.provenance(), open_console()
    facts = {
        "date": date.today().isoformat(),
        "commit": made_with["commit"],
        "dirty": made_with["dirty"],
    }
    if name := own.get("name"):
        run = Path(own["run"]) if own.get("run") else _latest_run(Path(one.results) / "scratch")
        data, found = archive.figures_of_run(run)
        kept = archive.keep(run, root, found, name=name, data=data, scale="", **facts)
        out.print(f"kept {run} in {kept}", soft_wrap=True)
        return 0
    if only := own.get("only"):
        require_choice("only", only, figures)
    elif folder.is_dir():
        write_claims(
            folder / "claims.csv", judge_folder(folder, one.data.name, figures, measures=all_measures())
        )
    light = own.get("light") not in (None, "", "0")
    chosen = [only] if only else figures
    if light:
        chosen = [
            one.name
            for one in compose_figures(chosen, arguments)
            if one.figure.traits.in_light_archives and one.data.in_light_archives
        ]
        if not chosen:
            what = "the terms of these recordings do not allow copies, so they go into no light archive"
            raise InvalidInput(what, only or one.data.name, "an archive without light=1", code="no_copies")
    current = _current(chosen, folder, arguments, commit=facts["commit"])
    if light:
        from pipeline.report.light import keep_light

        target = root / "light" / one.data.name
        kinds = keep_light(folder, target, chosen, current=current, **facts)
        sizes = ", ".join(f"{kind} {size / 1e6:.2f}" for kind, size in sorted(kinds.items()))
        out.print(f"kept in {target} ({sum(kinds.values()) / 1e6:.2f} MB: {sizes})", soft_wrap=True)
        return 0
    moment = f"{facts['date']}-{facts['commit'][:12]}" + (f"-{only}" if only else "")
    kept = archive.keep(folder, root, chosen, name=moment, data=one.data.name, current=current, **facts)
    out.print(f"kept in {kept}")
    return 0


def _current(figures: Sequence[str], folder: Path, arguments: Sequence[str], *, commit: str) -> list[str]:
    """Return those of another commit that the present sources would make again as they are.

    Results are archived after `make readme`, whose tables are a commit of their own.
    """
    there = [name for name in figures if (folder / name / MANIFEST).is_file()]
    others = [
        name for name in there if read_manifest(folder / name, FIGURE)["provenance"].get("commit") != commit
    ]
    known = compose_figures(others, arguments) if others else []
    return [one.name for one in known if status(one, folder / one.name).state == CURRENT]


def _latest_run(scratch: Path) -> Path:
    """Return the folder of the latest run with changed options."""
    runs = [path for path in visible(scratch, "*") if path.is_dir()]
    if not runs:
        raise InvalidInput("no run with changed options is there", scratch, code="no_run")
    return runs[-1]
