"""Tests of chart pictures: SVG and PNG files, reproducible bytes, and errors for invalid numbers."""

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import pytest
from PIL import Image

from pipeline import report
from pipeline.charts import Axis, Chart, Lines, Reference, Sheet
from pipeline.palette import COLOURS, Style, hex_colour
from pipeline.pictures import style as look
from pipeline.pictures.charts import draw_charts
from pipeline.pictures.style import FAMILY, PNG_DPI, Canvas
from tests.rejects import rejects

X = np.arange(-90.0, 91.0)
COSINE = np.cos(np.deg2rad(X))
COLUMNS = {
    "x": X,
    "y": COSINE,
    "sd": np.full(181, 0.1),
    "map": 0.7 * COSINE,
    "low": 0.5 * COSINE,
    "high": COSINE,
}
CHART = Chart(
    table=COLUMNS,
    x="x",
    abscissa=Axis(label="View angle", unit="deg", ticks=30),

    y="y",
    band="sd",
    styles=Style("least squares"),
    label="Error",
    unit="mm²",
    also=[Lines(table=COLUMNS, y="map", band=("low", "high"), styles=Style("MAP", line="dashed"))],

    references=[Reference(x=30.0, label="here"), Reference(y=0.5, label="half"),
                Reference(x=0.0, y=0.9, published=True),
                Reference(slope=0.01, label="rising"), Reference(below="y", percent=30.0, published=True)],
)  # fmt: skip
CAPTION = "Data: synthetic, 80 walkers, 30 eigenwalkers; bands are ±1 standard deviation over walkers. " * 3

TABLE = pd.DataFrame(
    {
        "angle": [30, 0, 60, 0, 30, 60],
        "method": ["map", "map", "map", "baseline", "baseline", "baseline"],
        "error": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        "error_sd": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
    }
)
STYLES = {"baseline": Style("average walker", "baseline", banded=False), "map": Style("approach II", "map")}
ERROR = Chart(x="angle", y="error", by="method", styles=STYLES, label="Error", zero=True)


def of_table(stem: Path, *charts: Chart, table: Any = TABLE, **options: Any) -> None:
    """Draw the given charts from one table."""
    draw_charts(Canvas(stem, Sheet(charts=charts, **options), {"table": table}))


def size_of_png(path: Path) -> tuple[int, int]:
    """Return width and height, px, from the header of a PNG file."""
    head = path.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    return int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")


def strokes(path: Path) -> list[str]:
    """Return the stroke colour of each line in an SVG file."""
    root = ElementTree.parse(path).getroot()
    assert root.tag.endswith("svg")
    styles = [e.get("style", "") for e in root.iter() if e.tag.endswith("path")]
    return [style.split("stroke: ")[1][:7] for style in styles if "stroke: #" in style]


def draw(stem: Path) -> None:
    """Draw two panels, one above the other, with every kind of chart element."""
    draw_charts(Canvas(stem, Sheet(charts=[CHART, CHART]), caption=CAPTION))


def test_equal_input_gives_equal_bytes_and_no_scraps(tmp_path: Path) -> None:
    for name in ("one", "two"):
        draw(tmp_path / name)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["one.png", "one.svg", "two.png", "two.svg"]
    for suffix in ("svg", "png"):
        assert (tmp_path / f"one.{suffix}").read_bytes() == (tmp_path / f"two.{suffix}").read_bytes()
    assert strokes(tmp_path / "one.svg")


def test_the_users_own_settings_change_nothing_and_stay(tmp_path: Path) -> None:
    draw(tmp_path / "before")
    with matplotlib.rc_context({"font.size": 30.0, "lines.linewidth": 9.0, "savefig.bbox": "tight"}):
        draw(tmp_path / "after")
        assert matplotlib.rcParams["font.size"] == 30.0
    for suffix in ("svg", "png"):
        assert (tmp_path / f"before.{suffix}").read_bytes() == (tmp_path / f"after.{suffix}").read_bytes()


def test_a_caption_is_the_description_of_both_files_and_not_drawn(tmp_path: Path) -> None:
    sheet = Sheet(charts=[CHART, CHART], columns=2)
    draw_charts(Canvas(tmp_path / "bare", sheet))
    draw_charts(Canvas(tmp_path / "captioned", sheet, caption=CAPTION))
    assert size_of_png(tmp_path / "bare.png") == size_of_png(tmp_path / "captioned.png")
    assert size_of_png(tmp_path / "captioned.png")[0] == round(PNG_DPI * 7.5)
    assert strokes(tmp_path / "bare.svg") == strokes(tmp_path / "captioned.svg")
    assert CAPTION in (tmp_path / "captioned.svg").read_text()
    with Image.open(tmp_path / "captioned.png") as picture:
        assert picture.info["Description"] == CAPTION


def test_text_is_text_in_the_family_of_the_page_with_a_title(tmp_path: Path) -> None:
    draw_charts(Canvas(tmp_path / "a", Sheet(charts=[CHART]), caption="A < B", title="Errors & views"))
    root = ElementTree.parse(tmp_path / "a.svg").getroot()
    texts = [e for e in root.iter() if e.tag.endswith("}text")]
    assert {"here", "half", "View angle (deg)", "Error (mm²)"} <= {
        "".join(e.itertext()).strip() for e in texts
    }
    assert all(FAMILY in e.get("style", "") for e in texts)
    assert [(e.tag.partition("}")[2], e.text) for e in root[:2]] == [
        ("title", "Errors & views"),
        ("desc", "A < B"),
    ]
    css = (Path(report.__file__).parent / "page" / "style.css").read_text(encoding="utf-8")
    assert (
        FAMILY.split(",")[:4]
        == re.findall(r"font: 16px/1.5 ([^;]*);", css)[0].replace('"', "'").split(",")[:4]
    )


def test_a_journal_gets_its_width_its_formats_and_its_panels(tmp_path: Path) -> None:
    sheet = Sheet(charts=[CHART, replace(CHART, label="Other")], columns=2)
    canvas = Canvas(
        tmp_path / "a", sheet, formats=["pdf", "svg", "png"], width_mm=85.0, dpi=600, panels=["b"]
    )
    draw_charts(canvas)
    assert size_of_png(tmp_path / "a.png")[0] == int(85.0 / 25.4 * 600)
    svg = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert f'width="{85.0 / 25.4 * 72:.4f}'[:12] in svg
    assert "Other (mm²)" in svg
    assert "Error (mm²)" not in svg
    pdf = (tmp_path / "a.pdf").read_bytes()
    assert b"/FontFile2" in pdf, "the letters are embedded"
    draw_charts(replace(canvas, path_stem=tmp_path / "b", after_layout=[]))
    assert pdf == (tmp_path / "b.pdf").read_bytes()
    with rejects("unknown_choice", "figure.panels"):
        draw_charts(replace(canvas, panels=["c"]))


def test_without_references_the_papers_marks_are_left_out_and_ours_stay() -> None:
    sheet = Sheet(charts=[CHART]).with_published(float, shown=False)
    assert [r.label for r in sheet.charts[0].references] == ["here", "half", "rising"]


# --- a tidy table -------------------------------------------------------------------------------------------


def test_lines_of_a_table_have_the_colours_of_their_series(tmp_path: Path) -> None:
    of_table(tmp_path / "a", replace(ERROR, band="error_sd"))
    drawn = strokes(tmp_path / "a.svg")
    for role in ("map", "baseline"):
        assert drawn.count(hex_colour(role).lower()) == 2, "the line, and its entry in the legend"


def test_strands_are_lines_of_their_own(tmp_path: Path) -> None:
    for name, strands in (("one", ""), ("two", "method")):
        of_table(tmp_path / name, replace(ERROR, by="", strands=strands, styles=Style(colour="purple")))
    counts = [strokes(tmp_path / f"{n}.svg").count(COLOURS["purple"].lower()) for n in ("one", "two")]
    assert counts == [1, 2]


def test_one_legend_names_every_series_once(tmp_path: Path) -> None:
    of_table(tmp_path / "a", ERROR, replace(ERROR, where={"method": "map"}))
    assert strokes(tmp_path / "a.svg").count(hex_colour("map").lower()) == 3


def test_a_legend_of_many_lines_leaves_room_for_the_curves(tmp_path: Path) -> None:
    names = [f"a variant with a long name, number {number}" for number in range(12)]
    table = pd.DataFrame({"angle": [0, 30] * 12, "method": np.repeat(names, 2), "error": np.arange(24.0)})
    styles = {name: Style(name) for name in names}
    of_table(tmp_path / "few", replace(ERROR, styles={names[0]: styles[names[0]]}), table=table[:2])
    of_table(tmp_path / "many", replace(ERROR, styles=styles), table=table)  # a warning is an error
    heights = [size_of_png(tmp_path / f"{name}.png")[1] for name in ("few", "many")]
    assert heights[1] > 1.5 * heights[0]


def test_names_on_the_abscissa_are_points_with_whiskers_side_by_side(tmp_path: Path) -> None:
    table = TABLE.assign(error_low=TABLE["error"] - 0.5, error_high=TABLE["error"] + 0.5)
    words = {"0": "front", "30": "oblique", "60": "side"}
    of_table(tmp_path / "a", replace(ERROR, abscissa=Axis(words=words)), table=table)
    drawn = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert drawn.count('id="interval-') == 2
    assert "FillBetween" not in drawn


def test_charts_of_a_row_share_their_ordinate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limits: list[list[tuple[float, float]]] = []

    def keep(figure: Any, *_: Any, **__: Any) -> None:
        limits.append([axes.get_ylim() for axes in figure.axes])

    monkeypatch.setattr("pipeline.pictures.style.finish", keep)
    charts = [replace(ERROR, where={"method": m}) for m in ("map", "baseline", "map")]
    for share_y in (False, True):
        of_table(tmp_path / "a", *charts, share_y=share_y, columns=2)
    low, high = (0.0, 1.05 * 3.0), (0.0, 1.05 * 6.0)
    np.testing.assert_allclose(limits, [[low, high, low], [high, high, low]])


@pytest.mark.parametrize("heights", [(2.5, 2.3), (6.0, 5.4)])
def test_words_of_neighbouring_references_do_not_overlap(
    heights: tuple[float, float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    boxes: list[Any] = []

    def keep(figure: Any, *_: Any) -> None:
        figure.draw_without_rendering()
        boxes[:] = [text.get_window_extent() for text in figure.axes[0].texts]

    monkeypatch.setattr("pipeline.pictures.style._write", keep)
    references = [Reference(y=y, label=name) for y, name in zip(heights, ("upper", "lower"), strict=True)]
    of_table(tmp_path / "a", replace(ERROR, references=references))
    first, second = boxes
    assert not first.overlaps(second)


def test_an_interval_is_drawn_where_it_is_known_and_the_line_everywhere(tmp_path: Path) -> None:
    drawn = {}
    for name, unknown in (
        ("whole", TABLE["angle"] < 0),
        ("part", TABLE["angle"] < 10),
        ("none", TABLE["angle"] < 90),
    ):
        width = np.where(unknown, np.nan, 0.5)
        table = TABLE.assign(error_low=TABLE["error"] - width, error_high=TABLE["error"] + width)
        of_table(tmp_path / name, ERROR, table=table)
        drawn[name] = (tmp_path / f"{name}.svg").read_text(encoding="utf-8").count('id="interval-')
    assert drawn == {"whole": 2, "part": 2, "none": 0}


# --- rejected input ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "code", "where"),
    [
        ({"x": "time"}, "no_column", "time"),
        ({"where": {"method": "none"}}, "no_rows", ""),
        ({"styles": {"other": Style()}}, "no_rows", ""),
        ({"table": "table_people"}, "no_table", "table_people"),
        ({"band": ("error_sd", "angle")}, "swapped_ends", ""),
        ({"log_y": True, "times": -1.0}, "not_positive", ""),
    ],
)
def test_charts_that_do_not_fit_are_refused(
    tmp_path: Path, change: dict[str, Any], code: str, where: str
) -> None:
    with rejects(code, where):
        of_table(tmp_path / "a", replace(ERROR, **change))
    assert list(tmp_path.iterdir()) == []


def test_a_sheet_without_a_chart_is_refused(tmp_path: Path) -> None:
    with rejects("out_of_range", "charts", value=0):
        of_table(tmp_path / "a", replace(ERROR, picture=False))


def test_a_text_is_wrapped_greedily_within_the_width() -> None:
    text = "alpha beta gamma delta epsilon"
    width = look.text_width("alpha beta", look.TITLE_SIZE)
    assert look.wrapped(text, width).split("\n")[0] == "alpha beta"
    assert all(
        look.text_width(line, look.TITLE_SIZE) <= width for line in look.wrapped(text, width).split("\n")
    )
    assert look.wrapped(text, 1.0).split("\n") == text.split(" ")
    assert look.wrapped(text, 1e4) == text


def test_a_formula_is_as_wide_as_its_symbols() -> None:
    assert look.text_width(r"$\sigma$", 10.0) < 0.3 * look.text_width("sigma,s", 10.0)
    assert look.text_width("mm", 20.0) == pytest.approx(2.0 * look.text_width("mm", 10.0), rel=0.02)
