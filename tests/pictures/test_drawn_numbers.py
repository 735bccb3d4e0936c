"""Tests of the numbers, limits, ticks, labels and legends in a drawn picture."""

from __future__ import annotations

import base64
import gzip
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox
from PIL import Image

from pipeline.charts import Axis, Chart, Reference, Sheet
from pipeline.palette import Style, hex_colour
from pipeline.pictures import style as look
from pipeline.pictures.charts import draw_charts
from pipeline.pictures.embedding import embedded, packed_vector, reduced
from pipeline.pictures.matrix import draw_heat_map
from pipeline.pictures.motions import draw_motion
from pipeline.pictures.postures import draw_postures
from pipeline.pictures.skeletons import draw_skeletons
from pipeline.pictures.style import Canvas
from pipeline.pictures.tallies import draw_tallies
from pipeline.pictures.walking import draw_walking
from pipeline.scenes import HeatMap, MotionScene, PostureRow, SkeletonRow

BONES = ((0, 1), (1, 2))
LIMB = np.array([[0.0, 1700.0], [60.0, 900.0], [-210.0, 0.0]])
RISING = {"x": [0.0, 0.25, 0.5, 0.75, 1.0], "y": [0.0, 0.25, 0.5, 0.75, 1.0]}


class Drawn:
    """Figures that were drawn, with the entries of their legends."""

    def __init__(self) -> None:
        self.figures: list[Figure] = []
        self.entries: list[Mapping[str, Any]] = []

    def finish(self, figure: Figure, canvas: Canvas, entries: Mapping[str, Any], **options: Any) -> None:
        self.figures.append(figure)
        self.entries.append(entries)
        FINISH(figure, canvas, entries, **options)

    @property
    def axes(self) -> list[Any]:
        return self.figures[-1].axes

    @property
    def handles(self) -> list[Any]:
        """Drawn object of each legend entry, without the patches of its bands."""
        return [each[-1] if isinstance(each, tuple) else each for each in self.entries[-1].values()]

    @property
    def legend(self) -> list[tuple[str, str]]:
        """Name and colour of each legend entry."""
        colours = [h.get_color() if hasattr(h, "get_color") else h.get_facecolor() for h in self.handles]
        return [(name, to_hex(colour)) for name, colour in zip(self.entries[-1], colours, strict=True)]


FINISH = look.finish


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> Drawn:
    """Collection of the drawn figures and legends, for which no files are written."""
    result = Drawn()
    monkeypatch.setattr("pipeline.pictures.style.finish", result.finish)
    monkeypatch.setattr("pipeline.pictures.style._write", lambda *_: None)
    return result


def shown_colour(name: str) -> str:
    """Return the hexadecimal code of a palette colour."""
    return str(to_hex(hex_colour(name)))


def chart(table: Any = RISING, **options: Any) -> Chart:
    """Return a chart of the columns y over x."""
    return Chart(**{"table": table, "x": "x", "y": "y", "styles": Style("series", "blue"), **options})


def draw(*charts: Chart, **options: Any) -> None:
    """Draw charts as the panels of one picture."""
    draw_charts(Canvas(Path("picture"), Sheet(charts=charts, **options)))


def segments(axes: Any) -> np.ndarray:
    """Return the ends (N, 2, 2) of all line segments in axes, such as bones and error bars."""
    parts = [c.get_segments() for c in axes.collections if isinstance(c, LineCollection)]
    return np.array([segment for each in parts for segment in each])


def corners(area: Any) -> set[tuple[float, float]]:
    """Return the corners (x, y) of the area of a drawn band."""
    (outline,) = area.get_paths()
    return {(x, y) for x, y in np.round(outline.vertices, 9).tolist()}


def size_of(axes: Any) -> np.ndarray:
    """Return width and height of axes, points."""
    return np.array(axes.bbox.size) * 72.0 / axes.figure.dpi


def box_of(text: Any) -> Bbox:
    """Return the bounding box of a label relative to the lower left corner of its axes, points."""
    left, low = np.array(text.get_position()) * size_of(text.axes)
    assert (text.get_transform(), text.get_ha(), text.get_va()) == (text.axes.transAxes, "left", "bottom")
    wide = text.get_window_extent().width * 72.0 / text.axes.figure.dpi
    return Bbox.from_bounds(left, low, wide, 1.25 * look.NOTE_SIZE * (1 + text.get_text().count("\n")))


def covers(box: Bbox, axes: Any, points: Any) -> bool:
    """Return whether a box covers a part of a line, whose points are given as fractions of the axes."""
    points = np.asarray(points) * size_of(axes)
    fine, numbers = np.linspace(0, len(points) - 1, 1000), np.arange(len(points))
    return any(
        box.contains(*at) for at in np.column_stack([np.interp(fine, numbers, v) for v in points.T]).tolist()
    )


# --- charts ------------------------------------------------------------------------------------------------


def test_a_line_has_its_numbers_band_and_interval(drawn: Drawn) -> None:
    table = RISING | {
        "sd": [0.1] * 5,
        "y_low": [-0.2, 0.2, 0.4, 0.7, 0.9],
        "y_high": [0.2, 0.3, 0.6, 0.8, 1.3],
    }
    draw(chart(table, band="sd", styles=Style("series", "blue", line="dashed")))
    (axes,) = drawn.axes
    (line,) = axes.lines
    np.testing.assert_array_equal(line.get_xydata(), np.column_stack([RISING["x"], RISING["y"]]))
    assert (line.get_color(), line.get_linestyle(), line.get_marker()) == (hex_colour("blue"), "--", "none")
    ends = {
        "band-0": [(x, y + sign * 0.1) for x, y in line.get_xydata() for sign in (-1, 1)],
        "interval-0": [
            (x, y) for name in ("y_low", "y_high") for x, y in zip(RISING["x"], table[name], strict=True)
        ],
    }
    assert {area.get_gid(): corners(area) for area in axes.collections} == {
        name: {(x, y) for x, y in np.round(points, 9).tolist()} for name, points in ends.items()
    }
    opacities = [look.BAND_OPACITY, look.INTERVAL_OPACITY]
    assert [area.get_alpha() for area in axes.collections] == opacities
    assert axes.get_xlim() == (0.0, 1.0)
    assert axes.get_ylim() == pytest.approx((-0.2 - 0.05 * 1.5, 1.3 + 0.05 * 1.5))
    assert (axes.get_xlabel(), axes.get_title(loc="left"), axes.get_ylabel()) == ("x", "y", "")
    (entry,) = drawn.entries[-1].values()
    assert [patch.get_alpha() for patch in entry[:-1]] == opacities
    assert (drawn.legend, entry[-1].get_linestyle()) == ([("series", shown_colour("blue"))], "--")


def test_a_series_of_one_point_and_a_series_of_points_have_marks_and_whiskers(drawn: Drawn) -> None:
    lonely = {"x": [2.0], "y": [3.0], "y_low": [2.5], "y_high": [4.0]}
    draw(chart(lonely, styles=Style("lonely")), chart(styles=Style("series", "blue", line="points")))
    for axes in drawn.axes:
        (line,) = axes.lines
        assert (line.get_marker(), line.get_linestyle()) == ("o", "None")
    np.testing.assert_array_equal(segments(drawn.axes[0]), [[[2.0, 2.5], [2.0, 4.0]]])
    assert drawn.axes[1].get_xlim() == pytest.approx((-0.03, 1.03))
    assert [(entry.get_label(), entry.get_marker()) for entry in drawn.handles] == [
        ("lonely", "o"),
        ("series", "o"),
    ]


@pytest.mark.parametrize(
    ("abscissa", "limits", "ticks", "labels"),
    [
        (Axis(ticks=0.25), (0.0, 1.0), [0.0, 0.25, 0.5, 0.75, 1.0], None),
        (Axis(ticks=0.4, limits=(0.4, 1.3)), (0.4, 1.3), [0.4, 0.8, 1.2], None),
        (Axis(ticks=[0.1, 0.7]), (0.0, 1.0), [0.1, 0.7], None),
        (Axis(ticks=[0.5, 1.0], log=True, limits=(0.25, 2.0)), (0.25, 2.0), [0.5, 1.0], ["0.5", "1"]),
    ],
)
def test_the_abscissa_has_these_limits_and_ticks(
    drawn: Drawn, abscissa: Axis, limits: tuple[float, float], ticks: list[float], labels: list[str] | None
) -> None:
    draw(chart(abscissa=abscissa))
    (axes,) = drawn.axes
    assert axes.get_xlim() == limits
    np.testing.assert_allclose(axes.get_xticks(), ticks, atol=1e-12)
    assert axes.get_xscale() == ("log" if abscissa.log else "linear")
    if labels:
        assert [label.get_text() for label in axes.get_xticklabels()] == labels


@pytest.mark.parametrize(
    ("options", "top"),
    [
        ({}, 1.05 * 1.0),
        ({"band": "sd"}, 1.05 * 1.5),
        ({"band": "sd", "times": 1.0, "references": [Reference(y=1.8, published=True)]}, 1.05 * 1.8),
        ({"references": [Reference(y=1.8)]}, 1.05 * 1.8),
        ({"band": "wide"}, 1.05 * 2.0),
    ],
)
def test_an_ordinate_from_zero_ends_above_the_lines(
    drawn: Drawn, options: dict[str, Any], top: float
) -> None:
    draw(chart(RISING | {"sd": [0.5] * 5, "wide": [7.0] * 5}, zero=True, **options))
    assert drawn.axes[0].get_ylim() == pytest.approx((0.0, top))
    draw(chart(RISING | {"sd": [0.5] * 5, "wide": [7.0] * 5}, zero=True, limits=(-1.0, 3.0), **options))
    assert drawn.axes[0].get_ylim() == (-1.0, 3.0)


def test_panels_stand_in_rows_with_letters_and_one_ordinate(drawn: Drawn) -> None:
    draw(*[chart(title=name) for name in ("one", "two", "")], columns=2, share_y=True, panel_size=(2.0, 1.5))
    assert [axes.get_title(loc="left") for axes in drawn.axes] == ["(a) one\ny", "(b) two", "(c) y"]
    assert [axes.yaxis.get_tick_params()["labelleft"] for axes in drawn.axes] == [True, False, True]
    cells = [axes.get_subplotspec() for axes in drawn.axes]
    assert [(cell.rowspan.start, cell.colspan.start) for cell in cells] == [(0, 0), (0, 1), (1, 0)]
    assert drawn.figures[0].get_size_inches().tolist() == pytest.approx([4.1, 3.1])
    draw(chart(title="alone"))
    assert drawn.axes[0].get_title(loc="left") == "alone\ny"
    draw(chart(title="one"), chart(title="two"), letters=False, columns=2)
    assert [axes.get_title(loc="left") for axes in drawn.axes] == ["one\ny", "two\ny"]


def test_names_are_rows_from_the_top_with_numbers_along_the_abscissa(drawn: Drawn) -> None:
    table = {"x": ["a", "c"], "y": [1.0, 4.0], "y_low": [0.5, 3.0], "y_high": [2.0, 5.0]}
    names = Axis(words={"a": "first", "b": "heading", "c": "last"})
    rows = chart(table, abscissa=names, zero=True, label="Error", unit="mm")
    draw(rows, rows, columns=2)
    left, right = drawn.axes
    assert [label.get_text() for label in left.get_yticklabels()] == ["first", "heading", "last"]
    assert [label.get_fontweight() for label in left.get_yticklabels()] == ["normal", "bold", "normal"]
    assert left.get_ylim() == (2.5, -0.5)
    np.testing.assert_array_equal(left.lines[0].get_xydata(), [[1.0, 0.0], [4.0, 2.0]])
    np.testing.assert_array_equal(segments(left), [[[0.5, 0.0], [2.0, 0.0]], [[3.0, 2.0], [5.0, 2.0]]])
    assert left.get_xlim()[0] == 0.0
    assert [axes.get_xlabel() for axes in (left, right)] == ["Error (mm)"] * 2
    assert [axes.get_title(loc="left") for axes in (left, right)] == ["(a)", "(b)"]
    assert not right.yaxis.get_tick_params()["labelleft"]
    assert [(entry.get_marker(), entry.get_linestyle()) for entry in drawn.handles] == [("o", "-")]


@pytest.mark.parametrize(
    ("reference", "ends", "edges"),
    [
        # Limits are 0 to 1. An edge of the label is at a fraction of the axes, and so many points from there.
        ({"x": 0.1}, [[0.1, 0.0], [0.1, 1.0]], {"x0": (0.1, 3.0), "y1": (1.0, -3.0)}),
        ({"x": 0.9}, [[0.9, 0.0], [0.9, 1.0]], {"x1": (0.9, -3.0), "y1": (1.0, -3.0)}),
        ({"y": 0.1}, [[0.0, 0.1], [1.0, 0.1]], {"x1": (1.0, -3.0), "y0": (0.1, 3.0)}),
        ({"y": 0.85}, [[0.0, 0.85], [1.0, 0.85]], {"x0": (0.0, 3.0), "y0": (0.85, 3.0)}),
        ({"y": 0.95}, [[0.0, 0.95], [1.0, 0.95]], {"x0": (0.0, 3.0), "y1": (0.95, -3.0)}),
        ({"x": 0.3, "y": 0.4}, [[0.3, 0.4]], {"x0": (0.3, 6.0), "y0": (0.4, 3.0)}),
        ({"x": 0.5, "y": 0.5}, [[0.5, 0.5]], {"x1": (0.5, -6.0), "y0": (0.5, 3.0)}),
    ],
)
def test_a_reference_is_labelled_beside_it_and_away_from_the_data(
    drawn: Drawn,
    reference: dict[str, Any],
    ends: list[list[float]],
    edges: dict[str, tuple[float, float]],
) -> None:
    draw(chart(references=[Reference(label="note", **reference)], limits=(0.0, 1.0)))
    (axes,) = drawn.axes
    line, mark = axes.lines
    np.testing.assert_allclose(mark.get_xydata(), ends)
    (text,) = axes.texts
    box = box_of(text)
    assert text.get_text() == "note"
    for edge, (fraction, distance) in edges.items():
        expected = fraction * size_of(axes)["xy".index(edge[0])] + distance
        assert getattr(box, edge) == pytest.approx(expected, abs=1.0), edge
    assert not covers(box, axes, line.get_xydata())
    assert not covers(box, axes, mark.get_xydata())


@pytest.mark.parametrize(
    "places", [{"x": (0.3, 0.32)}, {"y": (0.3, 0.34)}, {"x": (0.3, 0.31), "y": (0.4, 0.42)}]
)
def test_labels_of_neighbours_cover_neither_each_other_nor_the_data(
    drawn: Drawn, places: dict[str, Any]
) -> None:
    references = [
        Reference(label=label, **dict(zip(places, at, strict=True)))
        for label, at in zip(
            ("a first note", "a second note"), zip(*places.values(), strict=True), strict=True
        )
    ]
    draw(chart(references=references, limits=(0.0, 1.0)))
    (axes,) = drawn.axes
    first, second = (box_of(text) for text in axes.texts)
    assert not first.overlaps(second)
    for box in (first, second):
        assert (np.asarray(box.min) >= 0.0).all()
        assert (np.asarray(box.max) <= size_of(axes)).all()
        assert not any(covers(box, axes, line.get_xydata()) for line in axes.lines)
    gap = 3.0 * len(places)  # a point has a mark
    for box, reference in zip((first, second), references, strict=True):
        axis = "x" if "x" in places else "y"
        at = getattr(reference, axis) * size_of(axes)["xy".index(axis)]
        sides = [getattr(box, f"{axis}0") - at, at - getattr(box, f"{axis}1")]
        assert max(sides) == pytest.approx(gap, abs=1.0)


def test_lines_through_the_origin_and_below_a_series_are_in_the_legend(drawn: Drawn) -> None:
    references = [
        Reference(slope=0.5, label="half"),
        Reference(below="y", percent=20.0, label="a fifth below", published=True),
    ]
    draw(chart(references=references, styles={"y": Style("series", "blue")}))
    _, half, below = drawn.axes[0].lines
    np.testing.assert_allclose(half.get_xydata(), [[0.0, 0.0], [1.0, 0.5]])
    np.testing.assert_allclose(below.get_ydata(), 0.8 * np.array(RISING["y"]))
    assert drawn.legend == [
        ("series", shown_colour("blue")),
        ("half", shown_colour("reference")),
        ("a fifth below", shown_colour("published")),
    ]
    assert list(drawn.axes[0].texts) == []


# --- other pictures ----------------------------------------------------------------------------------------


def test_a_heat_map_is_over_its_samples_with_the_path_and_the_closed_outline(drawn: Drawn) -> None:
    matrix = HeatMap(
        values=np.array([[0.0, 1.0, 4.0], [np.nan, 9.0, 2.0]]), x=np.arange(3), y=np.arange(-1, 1),
        path=np.array([0, -1, 0]), outline=np.array([[0.0, -1.0], [2.0, -1.0], [2.0, 0.0]]), title="costs",
        xlabel="sample", ylabel="disparity", bar="cost", path_label="path", outline_label="trellis",
    )  # fmt: skip
    draw_heat_map(Canvas(Path("picture"), Sheet(charts=[chart(), chart()])), matrix)
    axes = drawn.axes[0]
    (image,) = axes.images
    assert tuple(image.get_extent()) == (-0.5, 2.5, -1.5, 0.5)
    assert (axes.get_xlim(), axes.get_ylim()) == ((-0.5, 2.5), (-1.5, 0.5))
    assert (image.norm.vmin, image.norm.vmax, image.norm(2.25)) == (0.0, 9.0, pytest.approx(0.5))
    assert image.get_array()[1, 0] is np.ma.masked
    outline, path = (line.get_xydata().tolist() for line in axes.lines)
    assert outline == [[0.0, -1.0], [2.0, -1.0], [2.0, 0.0], [0.0, -1.0]]
    assert path == [[0.0, 0.0], [1.0, -1.0], [2.0, 0.0]]
    assert [name for name, _ in drawn.legend] == ["path", "trellis", "series"]
    assert [cell.rowspan.start for cell in (a.get_subplotspec() for a in drawn.axes[2:4])] == [0, 1]


def test_postures_share_a_scale_and_the_middle_of_the_original(drawn: Drawn) -> None:
    row = PostureRow(
        label="0°", original=np.tile(LIMB, (3, 1, 1)), reconstructed=np.tile(LIMB + 20, (3, 1, 1))
    )
    aside = np.array([500.0, 0.0])
    moved = replace(row, label="30°", original=row.original + aside, reconstructed=row.reconstructed + aside)
    rings = replace(moved, estimated=np.array([False, True, False]))
    draw_postures(Canvas(Path("picture")), [("(a)", [row, rings])], BONES)
    (axes,) = drawn.axes
    # The widest figure reaches 180 from its middle, and a figure is 1720 high: 0.45 of that is the larger step.
    step, drop = 0.45 * 1720.0, 1.12 * 1720.0
    centred = LIMB + np.array([50.0, 0.0])
    expected = [
        np.stack([centred[a], centred[b]]) + [step * k, -drop * i] + (20.0 if which else 0.0)
        for i in range(2)
        for which in range(2)
        for k in range(3)
        for a, b in BONES
    ]
    np.testing.assert_allclose(segments(axes), expected)
    ringed = np.array([line.get_xydata() for line in axes.lines])
    np.testing.assert_allclose(ringed[0], [centred[1] + [step * k, -drop] for k in range(3)])
    np.testing.assert_allclose(ringed[1], ringed[0] + 20.0)
    assert [text.get_text() for text in axes.texts] == ["0°", "30°"]
    assert [text.get_position()[1] for text in axes.texts] == pytest.approx([860.0, 860.0 - drop])
    low, high = axes.get_ylim()
    assert high == pytest.approx(1720.0 + 0.02 * drop)
    assert low == pytest.approx(0.94 * 1720.0 + 0.08 * drop - 2 * drop)
    assert [name for name, _ in drawn.legend] == ["original", "reconstructed", "joint that was not measured"]


def test_skeletons_are_drawn_one_by_one_over_the_mean(drawn: Drawn) -> None:
    others = LIMB + 10.0 * np.arange(1, 5)[:, None, None]
    row = SkeletonRow(label="frame 1", centre=LIMB, others=others)
    draw_skeletons(Canvas(Path("picture")), [row], BONES, legend=("mean", "sample"))
    (axes,) = drawn.axes
    left, right = -210.0, 60.0 + 40.0
    step = 1.04 * (right - left)
    next_one = np.array([step, 0.0])
    bones = np.array([[LIMB[a], LIMB[b]] for a, b in BONES])
    expected = [
        *[bones + n * next_one for n in range(5)],
        *[bones + 10.0 * n + n * next_one for n in range(1, 5)],
    ]
    np.testing.assert_allclose(segments(axes), np.concatenate(expected))
    assert axes.get_xlim() == pytest.approx((left, left + 5 * step))
    low, high = axes.get_ylim()
    assert low < 0.0 < 1740.0 < high < 1.3 * 1740.0
    assert drawn.legend == [("mean", shown_colour("silver")), ("sample", shown_colour("reconstruction"))]
    (label,) = axes.texts
    assert (label.get_text(), *label.get_position()) == ("frame 1", left, high)
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), [0.0, 0.0])


def test_a_motion_is_drawn_side_by_side_over_the_truth_with_its_plan(drawn: Drawn) -> None:
    truth = np.tile(LIMB, (2, 1, 1))
    ground = np.array([[0.0, 0.0], [100.0, 300.0]])
    path, footprint = np.array([[5.0, 1.0], [9.0, 4.0]]), np.array([[5.0, 1.0], [0.0, 8.0], [8.0, 8.0]])
    scene = MotionScene(
        image=truth, rows=[("from aside", truth + 20.0, truth, "blue")], ground=ground,
        cameras=[("first", "orange", path, footprint), ("second", "orange", path + 1.0, footprint)],
    )  # fmt: skip
    draw_motion(Canvas(Path("picture"), Sheet(charts=[chart()])), scene, BONES)
    image, row, plan = drawn.axes[:3]
    assert [axes.get_title() or axes.get_title(loc="left") for axes in (image, row, plan)] == [
        "what the camera saw", "from aside", "from above",
    ]  # fmt: skip
    middle = LIMB.mean(axis=0)
    bones = np.array([[LIMB[a] - middle, LIMB[b] - middle] for a, b in BONES])
    original, body = segments(row)[:4], segments(row)[4:]
    step = original[2, 0, 0] - original[0, 0, 0]
    np.testing.assert_allclose(original, np.concatenate([bones, bones + np.array([step, 0.0])]))
    np.testing.assert_allclose(body, original + 20.0)
    tall = 2.1 * middle[1]  # the feet are farther from the middle than the head
    assert row.get_ylim() == pytest.approx((-0.5 * tall, 0.5 * tall))
    assert row.get_xlim() == pytest.approx((-0.5 * step, 1.5 * step))
    assert step == pytest.approx(tall * 5.0 / (1.3 * 2))
    walked, *cameras, scale = [line.get_xydata().tolist() for line in plan.lines]
    assert walked == ground.tolist()
    assert cameras == [path.tolist(), [[5.0, 1.0]], (path + 1.0).tolist(), [[5.0, 1.0]]]
    assert scale == [[0.0, -299.0], [1000.0, -299.0]]
    assert [(note.get_text(), *note.xy) for note in plan.texts] == [
        ("first", 5.0, 1.0), ("second", 10.0, 5.0), ("1 m", 500.0, -299.0),
    ]  # fmt: skip
    assert [patch.get_xy()[:3].tolist() for patch in plan.patches] == [footprint.tolist()] * 2
    assert [name for name, _ in drawn.legend] == ["truth", "series"]


def test_counts_are_stacked_bars(drawn: Drawn) -> None:
    rows = [("one paper", {"agrees": 3, "differs": 1}), ("another", {"agrees": 5}), ("none", {"differs": 0})]
    draw_tallies(Canvas(Path("picture")), rows, {"agrees": "green", "differs": "amber", "unknown": "grey"})
    (axes,) = drawn.axes
    bars = [(p.get_x(), p.get_width(), p.get_y() + 0.5 * p.get_height()) for p in axes.patches]
    assert bars == [(0, 3, 0.0), (3, 1, 0.0), (0, 5, 1.0)]
    numbers = [(text.get_text(), *text.get_position(), text.get_color()) for text in axes.texts]
    assert numbers == [("3", 1.5, 0, "white"), ("1", 3.5, 0, "black"), ("5", 2.5, 1, "white")]
    assert (axes.get_xlim(), axes.get_ylim()) == ((0.0, 5.0), (2.5, -0.5))
    assert [label.get_text() for label in axes.get_yticklabels()] == ["one paper", "another", "none"]
    assert drawn.legend == [("agrees", shown_colour("green")), ("differs", shown_colour("amber"))]
    assert drawn.figures[0].get_size_inches()[1] == pytest.approx(1.0 + look.LEGEND_LINE)


def test_a_walker_fills_most_of_the_height_and_stays_upright(tmp_path: Path) -> None:
    draw_walking(
        tmp_path / "a.svg", bones=BONES, observed=LIMB[None], original=LIMB[None], reconstructed=LIMB[None],
        seconds=1.0, estimated=np.zeros(3, bool), words=(("left", "below"), ("right", "under")), still=0,
    )  # fmt: skip
    text = (tmp_path / "a.svg").read_text(encoding="utf-8")
    dots = [part for part in text.split('d="') if "h0" in part.partition('"')[0]]
    points, body = (
        np.array(
            [
                [float(v) for v in dot.split()]
                for dot in part.partition('"')[0][1:].replace("h0", "").split("M")
            ]
        )
        for part in dots
    )
    scale = (points[2, 1] - points[0, 1]) / 1700.0
    np.testing.assert_allclose(points - points[0], scale * (LIMB - LIMB[0]) * [1, -1], atol=0.11)
    np.testing.assert_allclose(body - body[0], points - points[0], atol=0.11)
    assert body[0, 0] > points[0, 0] + 100.0
    rise = float(text.partition('viewBox="0 0 ')[2].split()[1].rstrip('"'))
    assert 0.6 * rise < points[2, 1] - points[0, 1] < 0.95 * rise


# --- files that pages embed --------------------------------------------------------------------------------


def test_a_picture_is_made_narrower_and_never_wider(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    Image.new("RGB", (401, 150), (10, 200, 30)).save(path)
    assert reduced(path, 100)[1:] == (100, 37)
    assert reduced(path, 401)[1:] == reduced(path, 9999)[1:] == (401, 150)
    described = embedded(path, 100)
    assert (described["width"], described["height"]) == (100, 37)
    kind, _, text = described["uri"].partition(",")
    assert (kind, base64.b64decode(text)[8:12]) == ("data:image/webp;base64", b"WEBP")


def test_a_vector_picture_is_packed_with_its_size_if_it_is_short(tmp_path: Path) -> None:
    path = tmp_path / "a.svg"
    path.write_text('<svg xmlns="x" width="100.6pt" height="50.2pt">' + "<g/>" * 50 + "</svg>")
    described = packed_vector(path, 9999)
    assert described is not None
    assert (described["width"], described["height"]) == (101, 50)
    assert gzip.decompress(base64.b64decode(described["packed"])) == path.read_bytes()
    assert packed_vector(path, len(described["packed"])) == described
    assert packed_vector(path, len(described["packed"]) - 1) is None
    path.write_text("<svg></svg>")
    assert packed_vector(path, 9999) is None


def test_a_legend_has_as_many_columns_as_fit() -> None:
    heights = {}
    with look.applied_style():
        for name in ("short", "a name of a series that takes about a third of the width"):
            figure = Canvas(Path("picture")).new_figure(99.0, 3.0)
            assert figure.get_size_inches().tolist() == [look.MAX_WIDTH, 3.0]
            entries = {f"{name} {n}": look.legend_handle(name, "black") for n in range(6)}
            heights[name] = look._legend_above(figure, entries)
            (legend,) = figure.legends
            assert [text.get_text() for text in legend.get_texts()] == list(entries)
    # Six short names are one line; of the long ones two are side by side.
    assert list(heights.values()) == pytest.approx([0.24, 0.24 + 2 * 1.65 * 7 / 72])
