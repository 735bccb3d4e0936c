"""Tests that every picture and chart is legible: no text is cut or covered, and no interval or band is missing.

Letters have the widths of DejaVu Sans, in which pictures are laid out, on every machine.
"""

from __future__ import annotations

import html
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib import get_data_path

from pipeline import report
from pipeline.charts import Axis, Chart, Reference, Sheet, lines_of
from pipeline.cli.presets import presets
from pipeline.palette import COLOURS, ROLES, Style
from pipeline.pictures.charts import draw_charts
from pipeline.pictures.style import Canvas
from pipeline.report.page_charts import _plain, charts_of
from pipeline.report.published import PublishedFigure, read_published
from tests.report.planted import shown

HERE = Path(__file__).parent
SOURCES = Path(report.__file__).parent / "page"
FONT = Path(get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"


def box(name: str, spec: object, width: int) -> str:
    """Return the HTML element of a chart, which the test script draws and examines."""
    text = html.escape(json.dumps(spec))
    return (
        f'<div class="chart" style="width:{width}px" data-name="{name}, {width} px" data-spec="{text}"></div>'
    )


def picture(name: str, path: Path, least: dict[str, int]) -> str:
    """Return the HTML element of a picture, with the smallest expected numbers of bands and intervals."""
    drawn = re.sub(r"^.*?(?=<svg )", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    return f"<div data-name=\"{name}, picture\" data-least='{json.dumps(least)}'>{drawn}</div>"


def faults(browser: str, boxes: Sequence[str], folder: Path, more: str = "") -> list[str]:
    """Return the faults of charts and pictures in a browser, after the script `more` has run."""
    colours = "".join(f"--c-{name}:{value};" for name, value in COLOURS.items())
    page = folder / "looked.html"
    page.write_text(
        f"<!doctype html><meta charset='utf-8'><style>{(SOURCES / 'style.css').read_text()}</style>"
        f"<style>@font-face{{font-family:Fixed;src:url({FONT.as_uri()})}} :root{{{colours}}}"
        f"body, svg text, svg tspan{{font-family:Fixed!important}}</style>"
        f"<body data-count='{len(boxes)}'><span style='font-family:Fixed'>letters</span>{''.join(boxes)}"
        f"<script type='application/json' id='roles'>{json.dumps(ROLES)}</script>"
        f"<script>{(SOURCES / 'charts.js').read_text()}</script>"
        f"<script>const faults = [];\n{(HERE / 'legibility.js').read_text().replace('/* more */', more)}</script>",
        encoding="utf-8",
    )
    output = re.search(r'id="faults">(.*?)</pre>', shown(browser, page.as_uri(), folder), re.DOTALL)
    assert output, "the script ended early"
    result = json.loads(html.unescape(output[1]))
    assert result["looked"] == str(len(boxes))
    return list(result["faults"])


def bands_of(figure: PublishedFigure) -> dict[str, int]:
    """Return the smallest numbers of bands and intervals that a figure's picture must show."""
    count = {"band": 0, "interval": 0}
    for chart in figure.charts if not figure.manifest.get("picture_beside_charts") else ():
        for line in lines_of(chart, figure.tables_of(chart)) if chart.picture else ():
            points = line.style.line == "points" or len(line.x) == 1 or bool(chart.abscissa.words)
            count["interval"] += bool(line.interval) or (points and bool(line.band))
            count["band"] += bool(line.band) and not points
    return count


def test_every_figure_can_be_read(smoke_results: Path, browser: str, tmp_path: Path) -> None:
    results = read_published(smoke_results / "synthetic" / "smoke", presets())
    boxes = []
    for name, figure in results.figures.items():
        if (drawn := figure.folder / "figure.svg").is_file():
            boxes.append(picture(name, drawn, bands_of(figure)))
        for number, spec in enumerate(charts_of(figure)):
            boxes += [box(f"{name} {number}", spec, width) for width in (640, 340)]
    assert len(boxes) > 100
    assert faults(browser, boxes, tmp_path) == []


def test_one_cursor_moves_in_all_charts_of_a_figure(browser: str, tmp_path: Path) -> None:
    spec = _plain(CHART, {}) | {"note": ""}
    boxes = [f"<div>{box('a', spec, 400)}{box('b', spec, 400)}</div>", f"<div>{box('c', spec, 400)}</div>"]
    script = """const of = n => document.querySelectorAll("[data-spec]")[n].chart;
    of(0).svg.dispatchEvent(new KeyboardEvent("keydown", { key: "End" }));
    faults.push([0, 1, 2].map(n => of(n).now).join(" "), of(1).output.textContent);"""
    assert faults(browser, boxes, tmp_path, script) == ["3 3 2", "across 3: ours 4 (3 to 9)"]


TABLE = {
    "x": np.arange(4.0),
    "y": np.array([1.0, 2.0, 3.0, 4.0]),
    "y_low": np.array([0.0, 1.0, 2.0, 3.0]),
    "y_high": np.array([2.0, 3.0, 5.0, 9.0]),
    "sd": np.full(4, 0.5),
}
CHART = Chart(table=TABLE, x="x", y="y", band="sd", styles=Style("ours"), abscissa=Axis(label="across"), label="error",
              references=[Reference(x=2.0, label="one"), Reference(x=2.05, label="another")])  # fmt: skip


def test_the_script_notices_faults(browser: str, tmp_path: Path) -> None:
    draw_charts(Canvas(tmp_path / "good", Sheet(charts=[CHART])))
    spec = _plain(CHART, {}) | {"note": ""}
    good = picture("good", tmp_path / "good.svg", {"band": 1, "interval": 1})
    assert faults(browser, [good, box("good", spec, 400)], tmp_path) == []
    cut = (tmp_path / "good.svg").read_text(encoding="utf-8").replace('viewBox="0 0', 'viewBox="60 0')
    (tmp_path / "cut.svg").write_text(cut, encoding="utf-8")
    bad = [
        picture("cut", tmp_path / "cut.svg", {}),
        picture("bandless", tmp_path / "good.svg", {"band": 2}),
        box("outside", spec | {"limits": [0.0, 5.0]}, 400),
        box("over", spec | {"y_label": "a -3 b", "names": ["a"] * 4 + ["b"] * 0}, 400),
    ]
    noticed = "\n".join(faults(browser, bad, tmp_path))
    for words in (
        'cut, picture: "',
        "1 of 2 bands",
        "ends of y outside the axis",
        "has a hyphen for a minus",
    ):
        assert words in noticed
    close = replace(
        CHART, references=[Reference(x=2.0, label="a" * 60), Reference(x=2.0, label="b" * 60)] * 20
    )
    draw_charts(Canvas(tmp_path / "full", Sheet(charts=[close])))
    assert '" over "' in "\n".join(faults(browser, [picture("full", tmp_path / "full.svg", {})], tmp_path))


@pytest.mark.parametrize("limits", [None, (0.0, 3.0)])
def test_the_limits_hold_every_interval_and_a_wide_band_leaves_them(
    limits: tuple[float, float] | None,
) -> None:
    wide = replace(CHART, table=TABLE | {"sd": np.full(4, 1e3)}, limits=limits, zero=True)
    low, high = _plain(wide, {})["limits"]
    assert low == 0.0
    assert 9.0 < high < 20.0
