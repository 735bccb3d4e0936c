"""Printing and writing of the rows of a benchmark."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

Row = dict[str, str | int | float]


def show(name: str, about: str, rows: Sequence[Row]) -> None:
    """Print the title of a benchmark, its description, and its rows under their headings."""
    headings = list(rows[0])
    cells = [headings] + [[_cell(row[h]) for h in headings] for row in rows]
    widths = [max(len(line[c]) for line in cells) for c in range(len(headings))]
    print(f"\n{name}: {about.strip()}\n")
    for line in cells:
        print("  " + "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip())
    print(flush=True)


def _cell(value: str | int | float) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def write(path: Path, rows: Sequence[Row]) -> None:
    """Write the rows of a benchmark as a CSV file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, fieldnames=list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
