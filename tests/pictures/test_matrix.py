"""Tests of matrix pictures: the path and the outline over the matrix, and charts next to it."""

from pathlib import Path

import numpy as np

from pipeline.charts import Chart, Sheet
from pipeline.palette import COLOURS, Style
from pipeline.pictures.matrix import draw_heat_map
from pipeline.pictures.style import Canvas
from pipeline.scenes import HeatMap

MATRIX = HeatMap(
    values=np.arange(15.0).reshape(3, 5),
    x=np.arange(5),
    y=np.arange(-1, 2),
    path=np.array([0, 0, 1, 1, 0]),
    outline=np.array([[0.0, -1.0], [4.0, -1.0], [4.0, 1.0], [0.0, 1.0]]),
    title="costs",
    xlabel="sample",
    ylabel="disparity",
    bar="cost",
    path_label="path",
    outline_label="trellis",
)
LINES = Sheet(
    charts=[Chart(table={"x": range(3)}, x="x", y="x", label="x", styles=Style("sequence", "purple"))]
)


def test_the_path_the_outline_and_the_lines_beside_are_drawn(tmp_path: Path) -> None:
    draw_heat_map(Canvas(tmp_path / "a", LINES, caption="Data: none."), MATRIX)
    text = (tmp_path / "a.svg").read_text(encoding="utf-8").lower()
    for name in ("orange", "grey", "purple"):
        assert text.count(f"stroke: {COLOURS[name].lower()}") == 2, "the line, and its entry in the legend"
