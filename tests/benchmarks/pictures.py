"""Pictures of two benchmarks: columns by row, and cost against size."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from pipeline import pictures
from tests.benchmarks.tables import Row

SERIES = {
    "times_ours_cpu": "processor time",
    "times_ours_wall": "wall time",
    "ours_cpu_s": "processor time",
    "ours_wall_s": "wall time",
}


def draw_columns(
    stem: Path, rows: Sequence[Row], columns: Sequence[str], *, xlabel: str, caption: str
) -> None:
    """Draw some columns of a table against the number of the row."""
    table = pd.concat(
        pd.DataFrame(
            {"row": range(1, len(rows) + 1), "series": name, "value": [float(row[name]) for row in rows]}
        )
        for name in columns
    )
    styles = {name: pictures.Style(SERIES[name], line="points") for name in columns}
    panel = pictures.Panel(
        y="value",
        ylabel="Reference over ours" if columns[0].startswith("times") else "Seconds",
        yscale="log",
        xticks=range(1, len(rows) + 1),
        references=[("y", 1.0, "")],
    )
    pictures.draw_lines(
        stem,
        [panel],
        table,
        x="row",
        by="series",
        styles=styles,
        xlabel=xlabel,
        caption=textwrap.fill(caption, 110),
    )


def draw_growth(stem: Path, table: pd.DataFrame, caption: str) -> None:
    """Draw processor time and peak memory against size, a panel to each quantity that grows."""
    panels = []
    for y, label in (("cpu_s", "Processor time (s)"), ("peak_mb", "Peak memory (MB)")):
        for grows in dict.fromkeys(table["grows"]):
            here = table[table["grows"] == grows]
            panels.append(
                pictures.Panel(
                    y=y,
                    where={"grows": grows},
                    ylabel=label,
                    xlabel=grows.capitalize(),
                    xscale="log",
                    yscale="log" if y == "cpu_s" else "linear",
                    from_zero=y == "peak_mb",
                    legend=list(dict.fromkeys(here["job"])) if y == "cpu_s" else [],
                )
            )
    styles = {job: pictures.Style(job) for job in dict.fromkeys(table["job"])}
    pictures.draw_lines(
        stem,
        panels,
        table,
        x="size",
        by="job",
        styles=styles,
        columns=len(panels) // 2,
        caption=caption,
        letters=False,
    )
