"""Pictures of two benchmarks: columns by row, and growth with size."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from pipeline import pictures
from pipeline.charts import Chart, Reference, Sheet
from pipeline.palette import Style
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
    chart = Chart(
        x="row",
        x_label=xlabel,
        y="value",
        by="series",
        styles={name: Style(SERIES[name], line="points") for name in columns},
        label="Reference over ours" if columns[0].startswith("times") else "Seconds",
        log_y=True,
        ticks=list(range(1, len(rows) + 1)),
        references=[Reference(y=1.0)],
    )
    pictures.draw_charts(stem, Sheet(charts=[chart]), {"table": table}, caption=textwrap.fill(caption, 110))


def draw_growth(stem: Path, table: pd.DataFrame, caption: str) -> None:
    """Draw processor time and peak memory against size, a panel to each quantity that grows."""
    charts = [
        Chart(
            x="size",
            x_label=grows.capitalize(),
            log_x=True,
            y=y,
            by="job",
            styles={job: Style(job) for job in dict.fromkeys(table["job"])},
            where={"grows": grows},
            label=label,
            unit=unit,
            log_y=y == "cpu_s",
            zero=y == "peak_mb",
        )
        for y, label, unit in (("cpu_s", "Processor time", "s"), ("peak_mb", "Peak memory", "MB"))
        for grows in dict.fromkeys(table["grows"])
    ]
    sheet = Sheet(charts=charts, columns=len(charts) // 2, letters=False)
    pictures.draw_charts(stem, sheet, {"table": table}, caption=caption)
