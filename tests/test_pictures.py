"""Figures: two files, the same bytes every time, and nothing drawn from numbers that do not fit."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest

from pipeline.pictures.curves import Panel, PostureRow, Series, curves, postures
from pipeline.pictures.style import CAPTION_SIZE, STYLE, finish, house_style, new_figure
from pipeline.validation import InvalidInput

X = np.arange(-90.0, 91.0)
LINE = Series(x=X, y=np.cos(np.deg2rad(X)), label="least squares", spread=np.full(181, 0.1))
DASHED = Series(x=X, y=0.7 * LINE.y, label="MAP", style="dashed", spread=(0.5 * LINE.y, LINE.y))
PANEL = Panel(
    title="(a)",
    series=(LINE, DASHED),
    xlabel="View angle (deg)",
    ylabel="Error (mm²)",
    xticks=range(-90, 91, 30),
    references=(("x", 30.0, "here"), ("y", 0.5, "half")),
    annotation="80 walkers",
)
BONES = ((0, 1), (1, 2))
LIMB = np.array([[0.0, 1700.0], [50.0, 900.0], [-200.0, 0.0]])
POSTURES = PostureRow(
    label="0°", original=np.tile(LIMB, (5, 1, 1)), reconstructed=np.tile(LIMB + 20, (5, 1, 1))
)
CAPTION = "Data: synthetic, 80 walkers, 30 eigenwalkers; bands are ±1 standard deviation over walkers. " * 3


def size_of_png(path: Path) -> tuple[int, int]:
    """Width and height from the header of a PNG."""
    head = path.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    return int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")


def lines_of(path: Path) -> list[str]:
    """The d attributes of what an SVG strokes with the colour of a series or a bone."""
    root = ElementTree.parse(path).getroot()
    assert root.tag.endswith("svg")
    strokes = [e for e in root.iter() if e.tag.endswith("path") and "stroke:" in e.get("style", "")]
    return [e.get("d", "") for e in strokes]


def draw_curves(stem: Path) -> None:
    """Two panels above one another, with everything that a panel can have."""
    curves(stem, [PANEL, replace(PANEL, title="(b)")], caption=CAPTION)


def draw_postures(stem: Path) -> None:
    """Two groups of two rows."""
    rows = (POSTURES, replace(POSTURES, label="30°"))
    titles = [f"{p} %" for p in range(0, 100, 20)]
    postures(stem, [("(a)", rows), ("(b)", rows)], BONES, column_titles=titles, caption=CAPTION)


@pytest.mark.parametrize("draw", [draw_curves, draw_postures])
def test_equal_input_gives_equal_bytes_and_no_scraps(tmp_path: Path, draw: Callable[[Path], None]) -> None:
    for name in ("one", "two"):
        draw(tmp_path / name)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["one.png", "one.svg", "two.png", "two.svg"]
    for suffix in ("svg", "png"):
        assert (tmp_path / f"one.{suffix}").read_bytes() == (tmp_path / f"two.{suffix}").read_bytes()
    assert lines_of(tmp_path / "one.svg")


def test_a_persons_own_settings_change_nothing_and_stay(tmp_path: Path) -> None:
    draw_curves(tmp_path / "before")
    with matplotlib.rc_context({"font.size": 30.0, "lines.linewidth": 9.0, "savefig.bbox": "tight"}):
        draw_curves(tmp_path / "after")
        assert matplotlib.rcParams["font.size"] == 30.0
    for suffix in ("svg", "png"):
        assert (tmp_path / f"before.{suffix}").read_bytes() == (tmp_path / f"after.{suffix}").read_bytes()


def test_the_picture_has_200_dots_per_inch_and_room_for_its_caption(tmp_path: Path) -> None:
    curves(tmp_path / "bare", [PANEL, PANEL], columns=2)
    curves(tmp_path / "told", [PANEL, PANEL], columns=2, caption=CAPTION)
    width, height = size_of_png(tmp_path / "bare.png")
    assert (width, height) == (round(200 * 7.5), round(200 * 2.45))
    wide, high = size_of_png(tmp_path / "told.png")
    assert wide == width
    assert high > height + 2 * 200 * CAPTION_SIZE / 72


def test_a_long_caption_stays_inside_the_figure(tmp_path: Path) -> None:
    with house_style():
        figure = new_figure(3.8, 2.4)
        figure.add_subplot().plot([0, 1], [0, 1])
        finish(figure, tmp_path / "a", CAPTION + "$\\sigma^2 = 70\\ \\mathrm{mm}^2$")
        box = figure.texts[0].get_window_extent()
        axes = figure.axes[0].get_tightbbox()
        assert axes is not None
        assert 0 <= box.x0 < box.x1 <= figure.bbox.width
        assert 0 <= box.y0 < box.y1 <= axes.y0


def test_more_series_are_more_lines_and_bands(tmp_path: Path) -> None:
    alone = Panel(series=(replace(LINE, spread=None, label=""),))
    curves(tmp_path / "one", [alone])
    curves(tmp_path / "two", [replace(alone, series=(*alone.series, replace(DASHED, spread=None, label="")))])
    one, two = (lines_of(tmp_path / f"{name}.svg") for name in ("one", "two"))
    assert len(two) == len(one) + 1


def test_every_posture_draws_every_bone_twice(tmp_path: Path) -> None:
    draw_postures(tmp_path / "a")
    segments = [d for d in lines_of(tmp_path / "a.svg") if d.count("M") == 1 and d.count("L") == 1]
    groups, rows, count, kinds = 2, 2, 5, 2
    assert len(segments) == groups * rows * count * kinds * len(BONES)


def test_letters_are_drawn_not_looked_up() -> None:
    assert STYLE["svg.fonttype"] == "path"


BAD_SERIES = [
    (replace(LINE, y=LINE.y[:-1]), r"expected \(181,\), received \(180,\)"),
    (replace(LINE, spread=np.ones(3)), r"spread.*expected \(181,\)"),
    (replace(LINE, spread=-np.ones(181)), "negative"),
    (replace(LINE, y=np.where(X == 0, np.nan, 1.0)), "not finite"),
    (replace(LINE, x=np.empty(0), y=np.empty(0)), "wrong shape"),
    (replace(LINE, style="wavy"), "unknown style"),
    (replace(LINE, colour="pink"), "unknown style or colour"),
]


@pytest.mark.parametrize(("series", "words"), BAD_SERIES)
def test_series_that_do_not_fit_are_refused(tmp_path: Path, series: Series, words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        curves(tmp_path / "a", [Panel(series=(series,))])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("panels", "words"),
    [
        ([], "nothing to draw"),
        ([Panel(series=())], "at least one series"),
        ([replace(PANEL, references=(("z", 1.0, ""),))], "x or y"),
        ([replace(PANEL, yscale="cubic")], "linear or log"),
        ([replace(PANEL, xscale="log")], "without a logarithm"),
    ],
)
def test_panels_that_make_no_sense_are_refused(tmp_path: Path, panels: Sequence[Panel], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        curves(tmp_path / "a", panels)


@pytest.mark.parametrize(
    ("row", "bones", "titles", "words"),
    [
        (replace(POSTURES, reconstructed=POSTURES.original[:4]), BONES, (), r"first \(5, 3, 2\)"),
        (replace(POSTURES, original=POSTURES.original[..., 0]), BONES, (), "wrong shape"),
        (replace(POSTURES, reconstructed=POSTURES.original * np.nan), BONES, (), "not finite"),
        (POSTURES, ((0, 3),), (), "pairs of joints"),
        (POSTURES, BONES, ("0 %",), "one title for each posture"),
    ],
)
def test_postures_that_do_not_fit_are_refused(
    tmp_path: Path, row: PostureRow, bones: Sequence[tuple[int, int]], titles: Sequence[str], words: str
) -> None:
    with pytest.raises(InvalidInput, match=words):
        postures(tmp_path / "a", [("", (row,))], bones, column_titles=titles)


def test_a_missing_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="folder"):
        draw_curves(tmp_path / "nowhere" / "a")
