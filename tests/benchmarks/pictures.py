"""Pictures of benchmark results: columns against the row number, and growth with size."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import pandas as pd

from pipeline.charts import Axis, Chart, Reference, Sheet
from pipeline.palette import CYCLE, Style
from pipeline.pictures.charts import draw_charts
from pipeline.pictures.style import Canvas
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
    """Draw the given columns of a table against the row number."""
    table = pd.concat(
        pd.DataFrame(
            {"row": range(1, len(rows) + 1), "series": name, "value": [float(row[name]) for row in rows]}
        )
        for name in columns
    )
    chart = Chart(
        x="row",
        abscissa=Axis(label=xlabel, ticks=list(range(1, len(rows) + 1))),
        y="value",
        by="series",
        styles={name: Style(SERIES[name], line="points") for name in columns},
        label="Reference over ours" if columns[0].startswith("times") else "Seconds",
        log_y=True,
        references=[Reference(y=1.0)],
    )
    draw_charts(Canvas(stem, Sheet(charts=[chart]), {"table": table}, textwrap.fill(caption, 110)))


def draw_growth(stem: Path, table: pd.DataFrame, caption: str) -> None:
    """Draw processor time and peak memory against size; sizes and times are relative to the first row of each job."""
    jobs = list(dict.fromkeys(table["job"]))
    first = table.groupby("job")[["size", "cpu_s"]].transform("first")
    table = table.assign(times=table["size"] / first["size"], time=table["cpu_s"] / first["cpu_s"])
    styles = {job: Style(job, colour) for job, colour in zip(jobs, itertools.cycle(CYCLE), strict=False)}
    growth = partial(
        Chart, x="times", abscissa=Axis(label="Size / the first one", log=True), by="job", styles=styles
    )
    charts = [
        growth(y="time", label="Processor time / the first one", log_y=True),
        growth(y="peak_mb", label="Peak memory", unit="MB", zero=True),
    ]
    sheet = Sheet(charts=charts, columns=2, panel_size=(3.5, 3.0))
    draw_charts(Canvas(stem, sheet, {"table": table}, caption))
