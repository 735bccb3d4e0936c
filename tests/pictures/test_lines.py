"""Pictures of lines: two files, the same bytes every time, and nothing drawn from numbers that do not fit."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import pytest

from pipeline.palette import COLOURS, hex_colour
from pipeline.pictures import Panel, Series, Style, draw_lines, intervals, series
from pipeline.pictures.style import CAPTION_SIZE, PNG_DPI, STYLE, applied_style, finish, new_figure
from pipeline.validation import InvalidInput

X = np.arange(-90.0, 91.0)
LINE = Series(x=X, y=np.cos(np.deg2rad(X)), label="least squares", band=np.full(181, 0.1))
DASHED = Series(x=X, y=0.7 * LINE.y, label="MAP", line="dashed", band=(0.5 * LINE.y, LINE.y))
PANEL = Panel(
    series=(LINE, DASHED),
    xlabel="View angle (deg)",
    ylabel="Error (mm²)",
    xticks=30,
    references=(("x", 30.0, "here"), ("y", 0.5, "half")),
    annotation="80 walkers",
)
CAPTION = "Data: synthetic, 80 walkers, 30 eigenwalkers; bands are ±1 standard deviation over walkers. " * 3

TABLE = pd.DataFrame(
    {
        "angle": [30, 0, 60, 0, 30, 60],
        "method": ["map", "map", "map", "null", "null", "null"],
        "error": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        "error_sd": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
    }
)
STYLES = {"null": Style("average walker", "null", banded=False), "map": Style("approach II", "map")}


def size_of_png(path: Path) -> tuple[int, int]:
    """Width and height from the header of a PNG."""
    head = path.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    return int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")


def strokes(path: Path) -> list[str]:
    """The colours of all that an SVG strokes, one to each line."""
    root = ElementTree.parse(path).getroot()
    assert root.tag.endswith("svg")
    styles = [e.get("style", "") for e in root.iter() if e.tag.endswith("path")]
    return [style.split("stroke: ")[1][:7] for style in styles if "stroke: #" in style]


def draw(stem: Path) -> None:
    """Draw two panels above one another, with everything that a panel can have."""
    draw_lines(stem, [PANEL, PANEL], caption=CAPTION)


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


def test_a_caption_makes_the_picture_higher(tmp_path: Path) -> None:
    draw_lines(tmp_path / "bare", [PANEL, PANEL], columns=2)
    draw_lines(tmp_path / "told", [PANEL, PANEL], columns=2, caption=CAPTION)
    width, height = size_of_png(tmp_path / "bare.png")
    assert (width, height) == (round(PNG_DPI * 7.5), round(PNG_DPI * 2.45))
    wide, high = size_of_png(tmp_path / "told.png")
    assert wide == width
    assert high > height + 2 * PNG_DPI * CAPTION_SIZE / 72


def test_a_long_caption_stays_inside_the_figure(tmp_path: Path) -> None:
    with applied_style():
        figure = new_figure(3.8, 2.4)
        figure.add_subplot().plot([0, 1], [0, 1])
        finish(figure, tmp_path / "a", CAPTION + "$\\sigma^2 = 70\\ \\mathrm{mm}^2$")
        box = figure.texts[0].get_window_extent()
        axes = figure.axes[0].get_tightbbox()
        assert axes is not None
        assert 0 <= box.x0 < box.x1 <= figure.bbox.width
        assert 0 <= box.y0 < box.y1 <= axes.y0


def test_letters_are_drawn_not_looked_up() -> None:
    assert STYLE["svg.fonttype"] == "path"


# --- a tidy table -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [pd.DataFrame, dict])
def test_a_table_gives_a_line_to_each_series_in_the_order_of_the_styles(kind: Any) -> None:
    table = kind({name: TABLE[name].to_numpy() for name in TABLE})
    null, map_ = series(table, x="angle", y="error", by="method", band="error_sd", styles=STYLES)
    assert (null.label, null.colour, null.band) == ("average walker", "null", None)
    assert (map_.label, map_.colour) == ("approach II", "map")
    np.testing.assert_array_equal(map_.x, [0, 30, 60])
    np.testing.assert_array_equal(map_.y, [2, 1, 3])
    np.testing.assert_array_equal(map_.band, [0.2, 0.1, 0.3])


def test_only_the_rows_asked_for_are_drawn() -> None:
    (line,) = series(TABLE, x="angle", y="error", by="method", where={"method": "map", "angle": [0, 60]})
    np.testing.assert_array_equal(line.y, [2, 3])
    (both,) = series(TABLE, x="angle", y="error", band=("error_sd", "error"), where={"angle": 30})
    assert isinstance(both.band, tuple)
    np.testing.assert_array_equal(both.band[0], [0.1, 0.5])


def test_lines_of_a_table_have_the_colours_of_their_series(tmp_path: Path) -> None:
    panel = Panel(y="error", band="error_sd", from_zero=True)
    draw_lines(tmp_path / "a", [panel], TABLE, x="angle", by="method", styles=STYLES)
    drawn = strokes(tmp_path / "a.svg")
    for role in ("map", "null"):
        assert drawn.count(hex_colour(role).lower()) == 2, "the line, and its entry in the legend"


def test_units_are_lines_of_their_own(tmp_path: Path) -> None:
    for name, units in (("one", ""), ("two", "method")):
        panel = Panel(y="error", units=units)
        draw_lines(tmp_path / name, [panel], TABLE, x="angle", styles=Style(colour="purple"))
    counts = [strokes(tmp_path / f"{n}.svg").count(COLOURS["purple"].lower()) for n in ("one", "two")]
    assert counts == [1, 2]


def test_equal_legends_are_drawn_once_and_a_legend_of_the_figure_names_all(tmp_path: Path) -> None:
    of_map = hex_colour("map").lower()
    for name, legend, panels, entries in (
        ("equal", "panels", [Panel(y="error"), Panel(y="error")], 1),
        ("none", "panels", [Panel(y="error", legend=()), Panel(y="error", legend=())], 0),
        ("figure", "figure", [Panel(y="error"), Panel(y="error", where={"method": "map"})], 1),
    ):
        draw_lines(tmp_path / name, panels, TABLE, x="angle", by="method", styles=STYLES, legend=legend)
        assert strokes(tmp_path / f"{name}.svg").count(of_map) == 2 + entries, name


def test_panels_of_a_row_share_their_ordinate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limits: list[list[tuple[float, float]]] = []

    def keep(figure: Any, *_: Any, **__: Any) -> None:
        limits.append([axes.get_ylim() for axes in figure.axes])

    monkeypatch.setattr("pipeline.pictures.style.finish", keep)
    panel = Panel(y="error", from_zero=True)
    panels = [replace(panel, where={"method": m}) for m in ("map", "null", "map")]
    for share_y in ("none", "row", "all"):
        draw_lines(
            tmp_path / "a", panels, TABLE, x="angle", by="method", styles=STYLES, share_y=share_y, columns=2
        )
    low, high = (0.0, 1.05 * 3.0), (0.0, 1.05 * 6.0)
    assert limits == [[low, high, low], [high, high, low], [high, high, high]]


def test_words_of_neighbouring_references_do_not_overlap(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    boxes: list[Any] = []

    def keep(figure: Any, *_: Any, **__: Any) -> None:
        figure.draw_without_rendering()
        boxes.extend(text.get_window_extent() for text in figure.axes[0].texts)

    monkeypatch.setattr("pipeline.pictures.style.finish", keep)
    panel = Panel(y="error", from_zero=True, references=(("y", 2.5, "upper"), ("y", 2.3, "lower")))
    draw_lines(tmp_path / "a", [panel], TABLE, x="angle", by="method", styles=STYLES)
    upper, lower = boxes
    assert lower.y1 <= upper.y0


def test_an_interval_is_drawn_where_it_is_known_and_the_line_everywhere(tmp_path: Path) -> None:
    drawn = {}
    for name, unknown in (
        ("whole", TABLE["angle"] < 0),
        ("part", TABLE["angle"] < 10),
        ("none", TABLE["angle"] < 90),
    ):
        width = np.where(unknown, np.nan, 0.5)
        table = TABLE.assign(error_low=TABLE["error"] - width, error_high=TABLE["error"] + width)
        again = intervals(table, x="angle", y="error", by="method", styles=STYLES)
        assert {line.label for line in again} == {""}
        panel = Panel(y="error", series=again, from_zero=True)
        draw_lines(tmp_path / name, [panel], TABLE, x="angle", by="method", styles=STYLES)
        drawn[name] = (tmp_path / f"{name}.svg").read_text(encoding="utf-8").count('id="FillBetween')
    assert drawn == {"whole": 2, "part": 2, "none": 0}


# --- what is refused ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"x": "time"}, "time: the table has no such column"),
        ({"styles": {"map": Style()}}, r"without a style \(expected map, received null\)"),
        ({"where": {"method": "none"}}, "no row of the table is left"),
    ],
)
def test_tables_that_do_not_fit_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        series(TABLE, **{"x": "angle", "y": "error", "by": "method", **options})


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (replace(LINE, y=LINE.y[:-1]), r"y must have shape \(181,\) \(got \(180,\)\)"),
        (replace(LINE, band=np.ones(3)), r"band must have shape \(181,\)"),
        (replace(LINE, band=-np.ones(181)), "negative"),
        (replace(LINE, y=np.where(X == 0, np.nan, 1.0)), "must be finite"),
        (replace(LINE, x=np.empty(0), y=np.empty(0)), "points must be at least 1"),
        (replace(LINE, line="wavy"), "line must be one of solid, dashed"),
        (replace(LINE, colour="pink"), "colour must be one of black, orange"),
        (replace(LINE, units=np.zeros(3)), "units must have shape"),
    ],
)
def test_series_that_do_not_fit_are_refused(tmp_path: Path, line: Series, words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        draw_lines(tmp_path / "a", [Panel(series=(line,))])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("panels", "words"),
    [
        ([], "panels must be at least 1"),
        ([Panel(series=())], "series must be at least 1"),
        ([Panel(y="error")], "a panel without a table"),
        ([replace(PANEL, references=(("z", 1.0, ""),))], "must be x or y"),
        ([replace(PANEL, yscale="cubic")], "must be linear or log"),
        ([replace(PANEL, xscale="log")], "without a logarithm"),
    ],
)
def test_panels_that_make_no_sense_are_refused(tmp_path: Path, panels: Sequence[Panel], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        draw_lines(tmp_path / "a", panels)


def test_a_missing_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="folder"):
        draw(tmp_path / "nowhere" / "a")
