"""Commands that work on the figures of a data set, or on recordings."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path

from rich.text import Text

from pipeline.cli.compose import compose, compose_figures, reason_without_clips
from pipeline.cli.durations import durations, insert_durations
from pipeline.cli.earlier_names import require_preset
from pipeline.cli.output import tell_json
from pipeline.cli.presets import listed, split_named, split_options
from pipeline.cli.status import CURRENT, status
from pipeline.cli.summary import claim_rows, claims_table, counts, open_console
from pipeline.storage import archive, provenance, tables
from pipeline.storage.sealed_folders import FIGURE, MANIFEST, read_manifest, visible
from pipeline.studies.experiment import Experiment
from pipeline.studies.ledger import judge_folder, write_claims
from pipeline.studies.registry import all_measures
from pipeline.validation import InvalidInput, require_choice


def figures_for(arguments: Sequence[str], among: Sequence[str] = ()) -> tuple[Experiment, list[str]]:
    """Return the first figure's configuration, and the names of the figures for which the data set has suitable clips.

    Parameters
    ----------
    arguments : sequence of str
        Overrides, without ``experiment=``.
    among : sequence of str
        Figures to consider; by default all.

    Raises
    ------
    InvalidInput
        If the arguments name figures.
    """
    if split_named(arguments)[0]:
        raise InvalidInput(
            "this command works on all figures: call it without experiment=",
            "experiment",
            code="for_all_figures",
        )
    experiments = compose_figures(among, arguments)
    return experiments[0], [
        experiment.name for experiment in experiments if not reason_without_clips(experiment)
    ]


def fetch(arguments: Sequence[str]) -> int:
    """Download the public recordings and return the exit status: 1 if a download failed."""
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TransferSpeedColumn

    from pipeline.fetch import Progress as Progress_
    from pipeline.fetch import fetch as fetch_files
    from pipeline.ingestion.data import RecordedData

    options = [item for item in arguments if "=" in item]
    only = [item for item in arguments if "=" not in item]
    data = compose(["experiment=zhang2007_fig2", "data=optical", *options]).data
    if not isinstance(data, RecordedData):
        raise InvalidInput(
            "must be a data set that can be downloaded: optical, cmu or hdm05",
            "data",
            received=data.name,
            code="not_recorded",
        )
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
    """Judge the claims on the figures of a data set again, and write the HTML page with all these figures."""
    experiment, figures = figures_for(arguments)
    open_console().print(make_page(experiment.published_in, experiment.data.name, figures), soft_wrap=True)
    return 0


def make_page(folder: Path, data_name: str, figures: Sequence[str]) -> str:
    """Write ``claims.csv`` and ``index.html`` in the folder of the figures; return the page's path and size as text."""
    from pipeline.report.document import write_page

    if folder.is_dir():
        write_claims(folder / "claims.csv", judge_folder(folder, data_name, figures, measures=all_measures()))
    page = write_page(folder, figures)
    return f"page: {page} ({page.stat().st_size / 1e6:.2f} MB)"


def claims(arguments: Sequence[str]) -> int:
    """Print the papers' claims next to our numbers, and write claims.csv in the folder of the figures.

    ``claims FIGURE``, or ``experiment=a,b``, prints only the claims on these figures and writes no file.  ``--json``
    prints the rows for other programs.
    """
    as_json, arguments = "--json" in arguments, [item for item in arguments if item != "--json"]
    named, common = split_named([a if "=" in a else f"experiment={a}" for a in arguments])
    experiment, figures = figures_for(common, [*map(require_preset, named)])
    folder, out = experiment.published_in, open_console()
    if not folder.is_dir():
        from pipeline.report.entries import options_of

        words = f"{folder} has no figures yet: run make sweeps{options_of(experiment.data.name, experiment.scale.name)}"
        out.print(words, soft_wrap=True)
        return 1
    verdicts = judge_folder(folder, experiment.data.name, figures, measures=all_measures())
    if not named:
        write_claims(folder / "claims.csv", verdicts)
    rows = claim_rows(verdicts)
    if as_json:
        tell_json(rows)
        return 0
    out.print(claims_table(rows, out.width))
    for row in rows:
        if row["why"]:
            reason = f"{row['paper']}, {row['claim']}: {row['agreement']}: {row['why']}"
            out.print(Text(reason), soft_wrap=not out.is_terminal)
    out.print(f"{experiment.data.name}, {experiment.scale.name}")
    out.print("\n".join(counts(verdicts)), soft_wrap=True)
    return 0


FILLED_PAGES: Mapping[str, tuple[str, ...]] = {
    "README.md": ("first", "counts"),
    "CONTRIBUTING.md": (),
    "docs/index.md": (),
    "docs/gallery.md": (),
    "docs/figures.md": ("figures",),
    "docs/results.md": ("headline",),
}
"""Pages of the documentation that state durations of commands, each with the names of its generated tables."""


def readme(arguments: Sequence[str]) -> int:
    """Write results and durations into docs/ and README.md, from results/published.csv and results/durations.csv.

    ``data=...`` first updates the rows of a data set from its published figures.  ``data=synthetic`` also draws the
    README's pictures, which need the figures of ``data=optical``.
    """
    from pipeline.papers import read_mapping
    from pipeline.studies import published

    layout = read_mapping(provenance.PROJECT / "conf" / "readme.yaml")
    path = provenance.PROJECT / "results" / "published.csv"
    if arguments:
        from pipeline.report.first_screen import RECORDED, draw_first_screen
        from pipeline.report.published import read_published

        experiment, figures = figures_for(arguments)
        folder = experiment.published_in
        published.renew(path, published.measured(folder, figures, layout, all_measures()))
        if experiment.data.name == "synthetic":
            other, theirs = figures_for(
                [a for a in arguments if not a.startswith("data=")] + [f"data={RECORDED}"]
            )
            draw_first_screen(
                read_published(folder, figures),
                read_published(other.published_in, theirs),
                provenance.PROJECT / "results" / "archive" / "light",
            )
    quoted = {name: layout[name] for name in ("headline", "first", "counts")}
    texts = {"figures": listed(), **published.rendered(quoted, tables.read(path))}
    measured_s = durations(tables.read_rows(provenance.PROJECT / "results" / "durations.csv"))
    for document, names in FILLED_PAGES.items():
        page = provenance.PROJECT / document
        text = published.insert(page.read_text("utf-8"), {name: texts[name] for name in names})
        page.write_text(insert_durations(text, measured_s), encoding="utf-8")
    return 0


def view(arguments: Sequence[str]) -> int:
    """Open the recording of a figure in the rerun viewer."""
    if not arguments or "=" in arguments[0]:
        raise InvalidInput(
            "no figure is named",
            expected="view FIGURE",
            received=" ".join(arguments),
            code="no_figure_named",
            typed=True,
        )
    path, first = Path(arguments[0]), ""
    if path.suffix != ".rrd":
        name = require_preset(arguments[0])
        experiment, _ = figures_for(arguments[1:], [name])
        path = experiment.published_in / name / "recording.rrd"
        first = f": run `make {name} DATA={experiment.data.name} SCALE={experiment.scale.name}` first"
    if not path.is_file():
        raise InvalidInput(f"the recording file does not exist{first}", path, code="no_recording")
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise InvalidInput(
            "the viewer needs a screen. Start it in a desktop session, or use a browser: `make report` writes a page"
            f" with players, and `.venv/bin/rerun --serve-web --bind 127.0.0.1 {path}` prints an address",
            path,
            code="no_screen",
        )
    # A separate process, since only `recordings` may import rerun.
    command = [sys.executable, "-m", "pipeline.recordings.viewing", str(path)]
    return subprocess.run(command, check=False).returncode


def keep(arguments: Sequence[str]) -> int:
    """Archive full-scale results in results/archive; the results must come from the sources of this commit.

    ``light=1`` writes the small archive of the repository.  ``only=FIGURE`` archives one figure.  ``name=NAME``
    archives a run with changed options: the latest in results/scratch, or ``run=FOLDER``.
    """
    options, arguments = split_options(arguments, ("light", "only", "name", "run"))
    experiment, figures = figures_for(arguments)
    folder = experiment.published_in
    root, made_with, out = Path(experiment.results) / "archive", provenance.provenance(), open_console()
    facts = {
        "date": date.today().isoformat(),
        "commit": made_with["commit"],
        "dirty": made_with["dirty"],
    }
    if name := options.get("name"):
        run = (
            Path(options["run"]) if options.get("run") else _latest_run(Path(experiment.results) / "scratch")
        )
        data, run_figures = archive.figures_of_run(run)
        archived = archive.keep(run, root, run_figures, name=name, data=data, scale="", **facts)
        out.print(f"archived {run} in {archived}", soft_wrap=True)
        return 0
    if only := options.get("only"):
        require_choice("only", only, figures)
    elif folder.is_dir():
        write_claims(
            folder / "claims.csv",
            judge_folder(folder, experiment.data.name, figures, measures=all_measures()),
        )
    light = options.get("light") not in (None, "", "0")
    archived_figures = [only] if only else figures
    if light:
        archived_figures = [
            experiment.name
            for experiment in compose_figures(archived_figures, arguments)
            if experiment.figure.traits.in_light_archives and experiment.data.in_light_archives
        ]
        if not archived_figures:
            what = "the terms of these recordings do not allow copies in a light archive: leave out light=1"
            raise InvalidInput(what, only or experiment.data.name, code="no_copies")
    current = _current(archived_figures, folder, arguments, commit=facts["commit"])
    if light:
        from pipeline.report.light import keep_light

        target = root / "light" / experiment.data.name
        kinds = keep_light(folder, target, archived_figures, current=current, **facts)
        sizes = ", ".join(f"{kind} {size / 1e6:.2f}" for kind, size in sorted(kinds.items()))
        out.print(f"archived in {target} ({sum(kinds.values()) / 1e6:.2f} MB: {sizes})", soft_wrap=True)
        return 0
    moment = f"{facts['date']}-{facts['commit'][:12]}" + (f"-{only}" if only else "")
    archived = archive.keep(
        folder, root, archived_figures, name=moment, data=experiment.data.name, current=current, **facts
    )
    out.print(f"archived in {archived}")
    return 0


def _current(figures: Sequence[str], folder: Path, arguments: Sequence[str], *, commit: str) -> list[str]:
    """Return the names of figures that another commit computed and that the present sources would reproduce unchanged.

    This happens because `make readme` is committed before results are archived.
    """
    finished = [name for name in figures if (folder / name / MANIFEST).is_file()]
    others = [
        name
        for name in finished
        if read_manifest(folder / name, FIGURE)["provenance"].get("commit") != commit
    ]
    experiments = compose_figures(others, arguments) if others else []
    return [
        experiment.name
        for experiment in experiments
        if status(experiment, folder / experiment.name).state == CURRENT
    ]


def _latest_run(scratch: Path) -> Path:
    """Return the folder of the latest run in ``results/scratch``, where runs with changed options are stored."""
    runs = [path for path in visible(scratch, "*") if path.is_dir()]
    if not runs:
        raise InvalidInput("the scratch folder has no run with changed options", scratch, code="no_run")
    return runs[-1]
