"""Tests of counts drawn as stacked bars: every number is shown."""

from __future__ import annotations

from pathlib import Path

from pipeline.pictures.style import Canvas
from pipeline.pictures.tallies import draw_tallies

ROWS = [("one paper", {"holds": 3, "differs": 1}), ("another", {"holds": 5})]


def test_a_bar_for_each_number(tmp_path: Path) -> None:
    for name in ("one", "two"):
        draw_tallies(
            Canvas(tmp_path / name), ROWS, {"holds": "green", "differs": "orange", "unknown": "grey"},
            hatched=["differs"],
        )  # fmt: skip
    drawn = (tmp_path / "one.svg").read_text(encoding="utf-8")
    assert drawn == (tmp_path / "two.svg").read_text(encoding="utf-8")
    legend = 1
    assert drawn.lower().count("fill: #009e73") == 2 + legend
    assert drawn.count("fill: url(#h") == 1 + legend, "the hatched bar, which a print without colours shows"
