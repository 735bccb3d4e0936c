"""Description of a figure's folder at smoke scale: rows and columns of its tables, entities of its recording.

python -m tests.contents FOLDER FIGURE …
    Write ``tests/golden/FIGURE.csv``, its first table, and ``tests/golden/FIGURE.txt``, what is in its folder
    ``FOLDER/FIGURE``; ``make golden`` calls it.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Collection
from pathlib import Path

import numpy as np

from pipeline.storage import tables
from tests.recordings import reading

GOLDEN = Path(__file__).resolve().parent / "golden"
COMMON = ("claims", "table_ingest")
"""Names of the tables that every figure has."""


def contents(folder: Path) -> str:
    """Return a text with one line for each table and each recorded entity; ``?`` marks columns with empty cells."""
    lines = []
    for path in sorted(folder.glob("*.csv")):
        if path.stem not in COMMON:
            columns = tables.read(path)
            full = {name: v.dtype.kind == "U" or bool(np.isfinite(v).all()) for name, v in columns.items()}
            names = ", ".join(name if full[name] else f"{name}?" for name in columns)
            lines.append(f"{path.name}, {len(next(iter(columns.values())))} rows: {names}")
    path = folder / "recording.rrd"
    lines += [f"recording: {first}" for first in (sorted(reading.entities(path)) if path.is_file() else ())]
    return "\n".join(lines) + "\n"


def golden(figure: str) -> str:
    """Return the expected description of the folder of a figure."""
    return (GOLDEN / f"{figure}.txt").read_text(encoding="utf-8")


def columns_of(figure: str) -> dict[str, list[str]]:
    """Return the expected columns of each table of a figure, by table name."""
    result = {}
    for line in golden(figure).splitlines():
        if not line.startswith("recording: "):
            name, _, columns = line.partition(": ")
            result[name.partition(".csv")[0]] = [column.rstrip("?") for column in columns.split(", ")]
    return result


def sharing_a_class(figures: Collection[str]) -> dict[str, list[str]]:
    """Return the further figures that share a class of options with the given figures, by class."""
    from pipeline.cli.compose import compose_figures

    users: dict[str, list[str]] = {}
    for experiment in compose_figures([], ["scale=smoke"]):
        for option in (experiment.figure, experiment.sweep):
            users.setdefault(type(option).__name__, []).append(experiment.name)
    return {
        kind: sorted({*names} - {*figures})
        for kind, names in users.items()
        if kind != "NoSweep" and {*names} & {*figures} and {*names} - {*figures}
    }


if __name__ == "__main__":
    for name in sys.argv[2:]:
        figure_folder = Path(sys.argv[1]) / name
        shutil.copyfile(figure_folder / "table.csv", GOLDEN / f"{name}.csv")
        (GOLDEN / f"{name}.txt").write_text(contents(figure_folder), encoding="utf-8")
    for kind, names in sharing_a_class(sys.argv[2:]).items():
        print(f"{kind} also makes {', '.join(names)}: make golden FIGURE=… renews each")
