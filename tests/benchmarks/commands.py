"""Wall time of the commands in README and docs in this clone, written to results/durations.csv.

Options: `only`, a part of a command, such as `only=test`; `film`, the film of `make reconstruct`, and `recordings`, the
folder of `make inspect`, which are not measured without them.  Measure on an idle machine.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from pipeline.storage import tables
from pipeline.storage.provenance import provenance
from tests.benchmarks import children
from tests.benchmarks.tables import Row

HERE = Path(__file__).resolve().parents[2]
DURATIONS = HERE / "results" / "durations.csv"
COLUMNS = ("command", "input", "wall_s", "cores", "commit")


GALLERY = (
    *("zhang2004_fig5", "zhang2007_fig3", "zhang2007_fig4", "zhang2007_fig5", "zhang2007_joint_angles"),
    *("mozerov2006_fig3", "mozerov2006_fig4", "park2011_fig3a", "park2011_fig4"),
)
"""Names of the figures in docs/gallery.md."""


def commands(folder: str, film: str, recordings: str) -> dict[str, tuple[str, list[str]]]:
    """Return the data and the Python arguments of each command on the pages, with `folder` for the results."""
    figures = ["-m", "pipeline", "figures", f"results={folder}"]
    tests = ["-m", "pytest", "-q", "-n", "auto", "--dist", "loadfile", "--no-loadscope-reorder"]
    reconstruct = ["-m", "pipeline", "reconstruct", f"input.path={film}", f"output.path={folder}/walk"]
    measured = {
        "make sweeps": ("synthetic people", figures),
        "make zhang2007_fig5": ("synthetic people", [*figures, "experiment=zhang2007_fig5"]),
        **{
            f"make {name} SCALE=smoke": ("synthetic people", [*figures, f"experiment={name}", "scale=smoke"])
            for name in GALLERY
        },
        "make pointlight": (
            "a synthetic walker",
            ["-m", "pipeline", "pointlight", "synthetic", f"to={folder}/w.svg"],
        ),
        "make test": ("", [*tests, "-m", "not thorough"]),
    }
    if film:
        measured["make reconstruct INPUT=walk.mp4"] = (Path(film).name, reconstruct)
    if recordings:
        inspect = ["-m", "pipeline", "inspect", recordings]
        measured["make inspect INPUT=my_walks"] = (f"folder of {Path(recordings).name}", inspect)
    return measured


def run(only: str = "", film: str = "", recordings: str = "") -> list[Row]:
    """Measure the commands, update the table of durations, and return a row for each command."""
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        for command, (source, arguments) in commands(folder, film, recordings).items():
            if only in command:
                used = children.run(arguments, HERE)
                commit = str(provenance()["commit"])[:12]
                row = (command, source, round(used.wall_s, 1), os.cpu_count() or 1, commit)
                rows.append(dict(zip(COLUMNS, row, strict=True)))
    renewed = {row["command"] for row in rows}
    tables.renew(DURATIONS, rows, lambda row: row["command"] in renewed, columns=COLUMNS, sort_by=["command"])
    return rows
