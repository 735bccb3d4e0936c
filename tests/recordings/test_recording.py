"""Tests of recordings: a file contains all data that were added, or it is not written."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rerun.chunk import RrdReader

from pipeline.charts import Axis, Chart, Reference
from pipeline.core.pinhole import Pinhole
from pipeline.palette import Style, hex_colour
from pipeline.recordings import Recording, viewing
from pipeline.recordings.layout import GROUND, Extent, framed, image_bounds
from pipeline.scenes import Bars, Columns, Image2D, Matrix, Notes, Plot, Rows, Space3D, Tabs
from pipeline.skeleton import WALKER15
from tests.processes import finished
from tests.recordings.reading import digest, entities, read_column, views
from tests.recordings.viewer import PROGRAM, screenshot, verify
from tests.rejects import rejects

BONES = WALKER15.bones
ANGLES = np.arange(-90, 91, 30)


def walker(frames: int, seed: int = 0) -> np.ndarray:
    """Return random positions (T, 15, 3), mm, of the size of a person."""
    return np.random.default_rng(seed).uniform(-900.0, 900.0, size=(frames, 15, 3))


def write_gait(path: Path, *, positions: np.ndarray, colour: str = "original", edition: str = "") -> None:
    """Write a recording of two walkers and their image over time, with one hidden walker."""
    times = np.arange(len(positions)) / 120.0
    with Recording(path, name="gait", about="# Gait", edition=edition, at=times) as recording:
        recording.skeleton("world/original/walker_07", positions, BONES, colour=colour)
        recording.skeleton("world/original/walker_08", positions + 5.0, BONES)
        recording.image_points("image/observed", positions[..., [0, 2]], BONES)
        displayed = ("world/original/walker_07",)
        views = [Space3D(name="space", focus=displayed), Image2D(name="image"), Notes()]
        recording.blueprint(Columns(*views, shares=(3, 1, 1)), playing=True)


def write_curves(path: Path, *, error: np.ndarray, sd: np.ndarray) -> None:
    """Write a recording of curves over the view angle, with a bar chart and a matrix."""
    with Recording(path, name="curves", about="# Curves", timeline="view_angle_deg") as recording:
        recording.curve("curves/error/map", ANGLES, error, sd=sd, label="MAP")
        recording.curve("curves/ratio/map", ANGLES, error / 7.0, label="MAP", colour="orange")
        recording.bars("spectrum/fraction", np.array([0.7, 0.2, 0.1]), np.array([1, 2, 3]))
        path_over = {"best": (np.array([[0, 0], [1, 2]]), "optimal_path")}
        recording.matrix("matrices/distances", np.arange(6.0).reshape(2, 3), paths=path_over)
        plots = Rows(Plot(name="error", origin="curves/error"), Plot(name="all", y_range=(0, 9)))
        others = Tabs(Bars(name="spectrum"), Matrix(name="distances"), Notes())
        recording.blueprint(Columns(plots, others))


def test_joints_that_nobody_measured_are_spheres_of_wire(tmp_path: Path) -> None:
    positions, estimated = walker(4), np.isin(np.arange(15), (0, 4))
    with Recording(tmp_path / "a.rrd", name="gait", about="# Gait", at=np.arange(4) / 30.0) as recording:
        recording.skeleton("world/a", positions, BONES, estimated=estimated)
        recording.skeleton("world/b", positions, BONES, estimated=np.zeros(15, dtype=bool))
        recording.blueprint(Space3D(name="space"))
    assert {"world/a", "world/a/estimated", "world/b"} <= set(entities(tmp_path / "a.rrd"))
    assert "world/b/estimated" not in entities(tmp_path / "a.rrd")
    _, centres = read_column(tmp_path / "a.rrd", "world/a/estimated", "Ellipsoids3D:centers", "time")
    result = np.stack([np.stack(list(cell)) for cell in centres])
    np.testing.assert_allclose(result, positions[:, estimated] / 1000.0, rtol=1e-6)
    verify(tmp_path / "a.rrd")


def test_skeletons_are_read_back_in_metres_at_their_times(tmp_path: Path) -> None:
    positions = walker(6)
    write_gait(tmp_path / "a.rrd", positions=positions)
    at, joints = read_column(tmp_path / "a.rrd", "world/original/walker_07", "Points3D:positions", "time")
    np.testing.assert_allclose(at, np.arange(6) / 120.0, atol=1e-9)
    assert joints.dtype == np.float32
    np.testing.assert_array_equal(joints, (positions / 1000.0).astype(np.float32))
    _, ends = read_column(tmp_path / "a.rrd", "world/original/walker_07", "LineStrips3D:strips", "time")
    assert ends.shape == (6, 14, 2, 3)
    for b, (parent, child) in enumerate(BONES):
        np.testing.assert_array_equal(ends[:, b, 0], joints[:, parent])
        np.testing.assert_array_equal(ends[:, b, 1], joints[:, child])


def test_images_are_stored_with_their_vertical_axis_down(tmp_path: Path) -> None:
    positions = walker(2)
    write_gait(tmp_path / "a.rrd", positions=positions)
    _, points = read_column(tmp_path / "a.rrd", "image/observed", "Points2D:positions", "time")
    np.testing.assert_allclose(points[..., 0], positions[..., 0] / 1000.0, rtol=1e-6)
    np.testing.assert_allclose(points[..., 1], -positions[..., 2] / 1000.0, rtol=1e-6)


def test_a_camera_stands_where_it_was_and_its_frustum_looks_at_what_it_saw(tmp_path: Path) -> None:
    turn = np.radians(30.0)
    right, away = np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([-np.sin(turn), np.cos(turn), 0.0])
    camera = Pinhole(
        np.diag([1000.0, 1000.0, 1.0]), np.array([right, [0.0, 0.0, -1.0], away]), -4000.0 * away
    )
    body = np.linspace(0.0, 1.0, 15)[None, :, None] * [300.0, 100.0, 500.0]
    image = camera.project(body) * 4.0 * [1.0, -1.0]
    with Recording(tmp_path / "a.rrd", name="a", about="a camera", at=[0]) as rec:
        rec.skeleton("world/body", body)
        rec.camera("world/camera", camera.matrix[None], image, distance_mm=4000.0)
        rec.blueprint(Columns(Space3D(name="b"), Image2D(name="i", origin="world/camera")))
    path = tmp_path / "a.rrd"
    at = {
        name: read_column(path, entity, component, index)[1]
        for name, entity, component, index in (
            ("seen", "world/camera/seen", "Points2D:positions", "time"),
            ("place", "world/camera", "Transform3D:translation", "time"),
            ("axes", "world/camera", "Transform3D:mat3x3", "time"),
            ("matrix", "world/camera", "Pinhole:image_from_camera", None),
        )
    }
    axes, matrix = (np.reshape(at[name], (3, 3)) for name in ("axes", "matrix"))  # columns after one another
    observed = (1e-3 * body[0] - np.reshape(at["place"], 3)) @ axes.T @ matrix
    np.testing.assert_allclose(observed[:, :2] / observed[:, 2:], np.reshape(at["seen"], (15, 2)), atol=1e-5)


def test_a_film_is_seen_through_its_camera(tmp_path: Path) -> None:
    """The camera of a recorded film is read back with the same orientation, position and focal length."""
    inner = np.array([[50.0, 0.0, 32.0], [0.0, 50.0, 24.0], [0.0, 0.0, 1.0]])
    # Right, down, away: the camera looks along +y, pitched by 0.2, from 1 m above the ground.
    c, s = np.cos(0.2), np.sin(0.2)
    axes = np.array([[1.0, 0, 0], [0, -s, -c], [0, c, -s]])
    centre = np.array([100.0, -3000.0, 1000.0])
    matrix = np.column_stack([inner @ axes, -inner @ axes @ centre])
    path, at = tmp_path / "film.rrd", [0.5, 0.6, 0.8]
    content = (Path(__file__).parent / "three_pictures.mp4").read_bytes()
    with Recording(path, name="film", about="# Film", at=at) as recording:
        recording.film("image", matrix, np.array([64.0, 48.0]), frustum_mm=700.0, content=content, at=at)
        recording.image_points("image/seen", 1e3 * np.array([[[8.0, -4.0], [56.0, -40.0]]] * 3), [(0, 1)])
        recording.skeleton("walked", walker(3))
        recording.blueprint(
            Columns(Image2D(name="i"), Space3D(name="s", origin="walked", contents=("walked", "image")))
        )
    verify(path)
    back = read_column(path, "image", "Transform3D:mat3x3")[1].reshape(3, 3)  # columns after one another
    np.testing.assert_allclose(back, axes, atol=1e-6)
    np.testing.assert_allclose(
        read_column(path, "image", "Transform3D:translation")[1].ravel(), centre / 1e3, rtol=1e-6
    )
    np.testing.assert_allclose(
        read_column(path, "image", "Pinhole:image_from_camera")[1].reshape(3, 3).T, inner, atol=1e-4
    )
    assert read_column(path, "image", "Pinhole:resolution")[1].ravel().tolist() == [64.0, 48.0]
    assert read_column(path, "image", "Pinhole:image_plane_distance")[1].ravel() == pytest.approx(0.7)
    times, stamps = read_column(path, "image/film", "VideoFrameReference:timestamp", "time")
    assert times.tolist() == at
    assert stamps.ravel().tolist() == [0, 40_000_000, 80_000_000]
    assert bytes(read_column(path, "image/film", "AssetVideo:blob")[1].ravel().tolist()) == content


def test_missing_joints_stay_missing(tmp_path: Path) -> None:
    positions = walker(3)
    positions[1, 4] = np.nan
    write_gait(tmp_path / "a.rrd", positions=positions)
    _, joints = read_column(tmp_path / "a.rrd", "world/original/walker_07", "Points3D:positions", "time")
    assert np.isnan(joints[1, 4]).all()
    assert np.isfinite(np.delete(joints.reshape(-1, 3), 15 + 4, axis=0)).all()


def test_curves_are_read_back_to_the_last_bit_over_negative_angles(tmp_path: Path) -> None:
    error, sd = np.pi * np.arange(7.0), np.full(7, 1 / 3)
    write_curves(tmp_path / "c.rrd", error=error, sd=sd)
    at, values = read_column(tmp_path / "c.rrd", "curves/error/map", "Measurements:values", "view_angle_deg")
    np.testing.assert_array_equal(at, ANGLES)
    np.testing.assert_array_equal(values[:, 0], error)
    _, variances = read_column(
        tmp_path / "c.rrd", "curves/error/map", "Measurements:variances", "view_angle_deg"
    )
    np.testing.assert_array_equal(variances[:, 0], sd**2)
    _, ratio = read_column(tmp_path / "c.rrd", "curves/ratio/map", "Scalars:scalars", "view_angle_deg")
    np.testing.assert_array_equal(ratio[:, 0], error / 7.0)
    _, label = read_column(tmp_path / "c.rrd", "curves/ratio/map", "SeriesLines:names")
    assert label.tolist() == [["MAP"]]


TABLE = pd.DataFrame(
    {
        "view_angle_deg": [30.0, 0.0, 0.0, 30.0 - 1e-9],
        "method": ["map", "map", "baseline", "baseline"],
        "error": [1.0, 2.0, 3.0, 4.0],
        "error_sd": [0.1, 0.2, 0.3, 0.4],
    }
)
STYLES = {"baseline": Style("average walker", "baseline"), "map": Style("approach II", "map")}


ERROR = Chart(x="view_angle_deg", y="error", by="method", styles=STYLES, label="Error", unit="mm")


def write_charts(path: Path, *charts: Chart, table: Any = TABLE, timeline: str = "view_angle_deg") -> None:
    """Write a recording that contains only charts."""
    inputs: dict[str, Any] = {"timeline": timeline, "charts": charts, "tables": {"table": table}}
    with Recording(path, name="curves", about="# Curves", **inputs) as recording:
        recording.blueprint(Rows(*recording.plots))


def test_a_chart_over_the_timeline_gives_a_curve_to_each_series(tmp_path: Path) -> None:
    path = tmp_path / "c.rrd"
    lines = replace(ERROR, where={"method": "map"}, name="lines")
    write_charts(path, replace(ERROR, band="error_sd"), lines, replace(ERROR, x="error", name="elsewhere"))
    assert set(entities(path)) == {"about", "curves/error/map", "curves/error/baseline", "curves/lines/map"}
    at, values = read_column(path, "curves/error/map", "Measurements:values", "view_angle_deg")
    np.testing.assert_array_equal(at, [0, 30])
    np.testing.assert_array_equal(values[:, 0], [2, 1])
    _, variances = read_column(path, "curves/error/baseline", "Measurements:variances", "view_angle_deg")
    np.testing.assert_allclose(variances[:, 0], np.array([0.3, 0.4]) ** 2, rtol=1e-12)
    _, values = read_column(path, "curves/lines/map", "Scalars:scalars", "view_angle_deg")
    np.testing.assert_array_equal(values[:, 0], [2, 1])
    _, label = read_column(path, "curves/error/map", "Measurements:names")
    assert label.tolist() == [["approach II"]]
    _, colour = read_column(path, "curves/error/map", "Measurements:colors")
    assert int(colour[0, 0]) >> 8 == int(hex_colour("map")[1:], 16), "the colour that it has in pictures"


def test_intervals_are_bands_about_their_middle_where_both_ends_are_known(tmp_path: Path) -> None:
    path, nothing = tmp_path / "c.rrd", [np.nan] * 4
    table = TABLE.assign(error_low=[0.5, np.nan, 2.0, 3.0], error_high=[2.5, 3.0, 5.0, 4.5])
    styles = {"baseline": Style("average walker", "baseline", interval=False), "map": STYLES["map"]}
    other = table.assign(other=1.0, other_low=nothing, other_high=nothing)
    write_charts(path, *(replace(ERROR, y=y, styles=styles) for y in ("error", "other")), table=other)
    bands = [entity for entity in entities(path) if entity.endswith("interval")]
    assert bands == ["curves/error/map/interval"]  # not of a series without bands, nor of unknown ends
    at, middle = read_column(path, bands[0], "Measurements:values", "view_angle_deg")
    _, variance = read_column(path, bands[0], "Measurements:variances", "view_angle_deg")
    half = np.sqrt(variance[:, 0])
    np.testing.assert_array_equal(at, [30])
    np.testing.assert_allclose([middle[:, 0] - half, middle[:, 0] + half], [[0.5], [2.5]])
    _, label = read_column(path, bands[0], "Measurements:names")
    assert label.tolist() == [["approach II"]]  # one entry of the legend for both
    verify(path)


def test_logarithms_and_references_are_curves_too(tmp_path: Path) -> None:
    table = {"scale": [0.1, 1.0, 10.0], "error": [1e-9, 0.1, 1.0]}
    level = Reference(y=0.1, label="µ = 0", published=True)
    chart = Chart(x="scale", y="error", label="Error",
    abscissa=Axis(log=True),
    log_y=True, least=1e-3, references=[level],
                  timeline="log10_scale_per_mille")  # fmt: skip
    write_charts(tmp_path / "a.rrd", chart, table=table, timeline=chart.timeline)
    for series, target in (("error", [-3.0, -1.0, 0.0]), ("mu_0", [-1.0, -1.0, -1.0])):
        at, values = read_column(
            tmp_path / "a.rrd", f"curves/log10_error/{series}", "Scalars:scalars", chart.timeline
        )
        np.testing.assert_array_equal(at, [-1000, 0, 1000])
        np.testing.assert_allclose(values[:, 0], target, atol=1e-12)


def test_joints_that_nobody_measured_are_rings_in_an_image(tmp_path: Path) -> None:
    points, estimated = walker(3)[..., [0, 2]], np.isin(np.arange(15), (2, 7))
    with Recording(tmp_path / "a.rrd", name="gait", about="# Gait", at=np.arange(3) / 30.0) as recording:
        recording.image_points("image/a", points, BONES, estimated=estimated)
        recording.blueprint(Image2D(name="image"))
    _, insides = read_column(tmp_path / "a.rrd", "image/a/estimated", "Points2D:positions", "time")
    np.testing.assert_allclose(insides, points[:, estimated] * [1e-3, -1e-3], rtol=1e-6)
    _, colour = read_column(tmp_path / "a.rrd", "image/a/estimated", "Points2D:colors")
    assert int(np.ravel(colour)[0]) >> 8 == int("{:02x}{:02x}{:02x}".format(*GROUND), 16)
    verify(tmp_path / "a.rrd")


def test_a_view_and_the_image_beside_it_show_a_body_at_one_height() -> None:
    extents = {
        "world": Extent((-0.3, -0.5, 0.0), (0.3, 0.5, 1.8)),
        "image": Extent((-0.3, -1.75), (0.3, 0.05)),
    }
    space = Space3D(name="space", aspect=2.0)
    (left, top), (right, bottom) = image_bounds(Image2D(name="image", next_to=space), extents)
    eye, target = framed(space, extents)
    alone_top, alone_bottom = (c[1] for c in image_bounds(Image2D(name="image"), extents))
    np.testing.assert_allclose(bottom - top, alone_bottom - alone_top)  # of the same body, the same share
    np.testing.assert_allclose((top + bottom) / 2.0, (-1.75 + 0.05) / 2.0)
    assert right - left < bottom - top  # so that the height decides
    # Three bodies side by side are seen from farther away, and so is the image.
    wide = {**extents, "world": Extent((-3.0, -0.5, 0.0), (3.0, 0.5, 1.8))}
    far, _ = framed(space, wide)
    (_, high), (_, low) = image_bounds(Image2D(name="image", next_to=space), wide)
    np.testing.assert_allclose(
        (low - high) / (bottom - top), np.linalg.norm(far - target) / np.linalg.norm(eye - target)
    )


@pytest.mark.parametrize(
    ("change", "code", "where"),
    [
        ({"y": "err"}, "no_column", "err"),
        ({"table": "other"}, "no_table", "other"),
        ({"name": "error's"}, "unsafe_path", "error's"),
    ],
)
def test_charts_that_do_not_fit_are_refused(
    tmp_path: Path, change: dict[str, Any], code: str, where: str
) -> None:
    with rejects(code, where):
        write_charts(tmp_path / "a.rrd", replace(ERROR, **change))


def test_a_recording_opens_on_its_layout_and_lists_its_entities(tmp_path: Path) -> None:
    write_curves(tmp_path / "c.rrd", error=np.ones(7), sd=np.ones(7))
    assert entities(tmp_path / "c.rrd") == (
        "about",
        "curves/error/map",
        "curves/ratio/map",
        "matrices/distances",
        "matrices/distances/best",
        "spectrum/fraction",
    )
    assert views(tmp_path / "c.rrd") == (
        ("2D", "distances"),
        ("BarChart", "spectrum"),
        ("TextDocument", "about"),
        ("TimeSeries", "all"),
        ("TimeSeries", "error"),
    )


def test_walkers_that_are_not_shown_start_hidden(tmp_path: Path) -> None:
    write_gait(tmp_path / "a.rrd", positions=walker(2))
    reader, visible = RrdReader(tmp_path / "a.rrd"), {}
    for layout in reader.blueprints():
        for chunk in reader.stream(store=layout).to_chunks():
            row = chunk.to_record_batch().to_pydict()
            if "EntityBehavior:visible" in row:
                entity = chunk.entity_path.split("/overrides/")[1].removesuffix("/visualizers")
                visible[entity] = row["EntityBehavior:visible"][0][0]
    assert visible == {"world": False, "world/original/walker_07": True}


def test_nothing_in_a_recording_tells_the_time_of_day(tmp_path: Path) -> None:
    write_gait(tmp_path / "a.rrd", positions=walker(2))
    for chunk in RrdReader(tmp_path / "a.rrd").stream().to_chunks():
        assert set(chunk.timeline_names) <= {"time"}
        assert not [n for n in chunk.to_record_batch().schema.names if "start_time" in n]


def test_equal_recordings_have_equal_digests_and_a_micrometre_shows(tmp_path: Path) -> None:
    positions = walker(4)
    for name, edition in (("a", ""), ("b", ""), ("c", "another edition")):
        write_gait(tmp_path / f"{name}.rrd", positions=positions, edition=edition)
    assert digest(tmp_path / "a.rrd") == digest(tmp_path / "b.rrd") == digest(tmp_path / "c.rrd")
    moved = positions.copy()
    moved[2, 7, 1] += 1e-3
    write_gait(tmp_path / "d.rrd", positions=moved)
    write_gait(tmp_path / "e.rrd", positions=positions, colour="blue")
    assert len({digest(tmp_path / f"{name}.rrd") for name in "ade"}) == 3


def test_the_command_line_agrees_with_the_digest(tmp_path: Path) -> None:
    positions = walker(4)
    for name, shift in (("a", 0.0), ("b", 0.0), ("c", 10.0)):
        write_gait(tmp_path / f"{name}.rrd", positions=positions + shift)
    compare = [str(PROGRAM), "rrd", "compare", "--unordered", str(tmp_path / "a.rrd")]
    same, other = (finished([*compare, str(tmp_path / f"{name}.rrd")]) for name in "bc")
    assert (same.returncode, other.returncode) == (0, 1)


def test_complete_recordings_verify_and_damaged_ones_are_refused(tmp_path: Path) -> None:
    whole, cut, missing = (tmp_path / f"{name}.rrd" for name in ("whole", "cut", "missing"))
    write_curves(whole, error=np.ones(7), sd=np.ones(7))
    verify(whole)
    cut.write_bytes(whole.read_bytes()[:-200])
    for damaged in (cut, missing):
        for check in (verify, entities, digest):
            with rejects("damaged" if damaged is cut or check is verify else "no_recording", damaged.name):
                check(damaged)
    with rejects("no_column", "curves/error/map"):
        read_column(whole, "curves/error/map", "Scalars:scalars", "time")


def test_a_recording_without_a_layout_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    with pytest.raises(ZeroDivisionError), Recording(path, name="gait", about="# Gait"):
        raise ZeroDivisionError
    with rejects("no_layout", "gait"), Recording(path, name="gait", about="# Gait"):
        pass


GOOD = walker(3)
TIMES = np.arange(3.0)


@pytest.mark.parametrize(
    ("call", "code", "values"),
    [
        (lambda r: r.skeleton("world/a", GOOD[..., 0], BONES, at=TIMES), "wrong_shape", {"shape": (3, 15)}),
        (lambda r: r.skeleton("world/a", np.empty((0, 15, 3)), BONES, at=TIMES), "not_finite", {}),
        (lambda r: r.skeleton("world/a", np.full((3, 15, 3), np.nan), BONES, at=TIMES), "not_finite", {}),
        (lambda r: r.skeleton("world/a", GOOD * np.inf, BONES, at=TIMES), "not_finite", {}),
        (lambda r: r.skeleton("world/a", GOOD, [(0, 15)], at=TIMES), "not_pairs_of_joints", {}),
        (lambda r: r.skeleton("world/a", GOOD, [], at=TIMES), "not_pairs_of_joints", {}),
        (
            lambda r: r.skeleton("world/a", GOOD, BONES, at=TIMES, colour="pink"),
            "unknown_choice",
            {"value": "pink"},
        ),
        (lambda r: r.skeleton("world/a", GOOD, BONES), "no_values", {}),
        (
            lambda r: r.skeleton("world/a", GOOD, BONES, at=np.arange(4.0)),
            "not_increasing",
            {"rows": 3},
        ),
        (lambda r: r.skeleton("world/a", GOOD, BONES, at=np.zeros(3)), "not_increasing", {"rows": 3}),
        (lambda r: r.skeleton("world/a b", GOOD, BONES, at=TIMES), "unsafe_path", {}),
        (lambda r: r.skeleton("about", GOOD, BONES, at=TIMES), "duplicate_name", {}),
        (
            lambda r: r.curve("curves/a", np.arange(3), np.arange(4.0), label="a"),
            "not_increasing",
            {"rows": 4},
        ),
        (lambda r: r.curve("curves/a", np.arange(2), np.array([1, np.nan]), label="a"), "not_finite", {}),
        (
            lambda r: r.curve("curves/a", np.arange(2), np.ones(2), label="a", sd=-np.ones(2)),
            "invalid_deviation",
            {},
        ),
        (
            lambda r: r.curve("curves/a", np.arange(2), np.ones(2), label="a", sd=np.ones(3)),
            "invalid_deviation",
            {},
        ),
        (lambda r: r.bars("spectrum", np.ones(3), np.ones(2)), "wrong_shape", {"shape": (2,)}),
        (lambda r: r.matrix("matrices/a", np.ones(3)), "wrong_shape", {"shape": (3,)}),
        (lambda r: r.matrix("matrices/a", np.full((2, 2), np.nan)), "not_finite", {"index": (0, 0)}),
        (
            lambda r: r.matrix("matrices/a", np.eye(2), paths={"p": (np.ones(2), "blue")}),
            "wrong_shape",
            {"shape": (2,)},
        ),
        (lambda r: r.blueprint(Space3D(name="empty")), "nothing_to_show", {"path": "world"}),
        (lambda r: r.blueprint(Plot(name="text", origin="about")), "nothing_shown", {}),
        (lambda r: r.blueprint(Rows(Notes(), shares=(1, 2))), "other_length", {}),
    ],
)
def test_what_the_library_would_let_pass_is_refused(
    tmp_path: Path, call: Callable[[Recording], object], code: str, values: dict[str, Any]
) -> None:
    with (
        rejects(code, **values),
        Recording(tmp_path / "a.rrd", name="bad", about="# Bad") as recording,
    ):
        call(recording)


def test_a_timeline_that_is_not_time_has_whole_numbers(tmp_path: Path) -> None:
    with (
        rejects("not_whole", "world/a on frame"),
        Recording(tmp_path / "a.rrd", name="a", about="# A", timeline="frame", at=TIMES + 0.5) as recording,
    ):
        recording.skeleton("world/a", GOOD)


def test_eighty_walkers_and_two_reconstructions_stay_under_ten_megabytes(tmp_path: Path) -> None:
    with Recording(tmp_path / "many.rrd", name="many", about="# Many", at=np.arange(60) / 60.0) as recording:
        for number in range(80):
            for k, group in enumerate(("original", "reconstructed/least_squares", "reconstructed/map")):
                positions = walker(60, seed=3 * number + k)  # noise, which does not compress
                recording.skeleton(f"world/{group}/walker_{number:02d}", positions, BONES)
        recording.blueprint(Space3D(name="walkers", focus=("world/original/walker_00",)))
    assert len(entities(tmp_path / "many.rrd")) == 241
    assert (tmp_path / "many.rrd").stat().st_size < 10e6


def test_a_machine_that_cannot_draw_is_told_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_gait(tmp_path / "a.rrd", positions=walker(2))
    for variable in ("VK_ICD_FILENAMES", "VK_DRIVER_FILES"):
        monkeypatch.setenv(variable, str(tmp_path / "no_driver.json"))
    with rejects("viewer_stopped", panicked=True):
        screenshot(tmp_path / "a.rrd", tmp_path / "a.png")
    assert not (tmp_path / "a.png").exists()


def ordinates(path: Path) -> list[tuple[float, float]]:
    """Return the ordinate ranges of all plots in a recording's layout, sorted."""
    reader = RrdReader(path)
    rows = [
        chunk.to_record_batch().to_pydict()
        for layout in reader.blueprints()
        for chunk in reader.stream(store=layout).to_chunks()
    ]
    return sorted(tuple(row["ScalarAxis:range"][0][0]) for row in rows if "ScalarAxis:range" in row)


def test_a_legend_has_its_own_space_above_the_curves(tmp_path: Path) -> None:
    """A legend of four names gets 90 screen points above the curves, whether its plot is 375 or 800 points high."""
    curves = {f"s{k}": np.array([0.0, 100.0 + k]) for k in range(4)}
    for name, rows in (("half", 2), ("whole", 1)):
        with Recording(tmp_path / f"{name}.rrd", name="a", about="# A", timeline="step") as recording:
            for key, values in curves.items():
                recording.curve(f"curves/{key}", np.arange(2), values, label=key, interval=(values, values))
            recording.blueprint(Rows(*(Plot(name=f"p{k}") for k in range(rows))))
    low, high = -0.05 * 103.0, 1.05 * 103.0
    for name, height, count in (("half", 375.0, 2), ("whole", 800.0, 1)):
        shares = [(top - high) / (top - low) for _, top in ordinates(tmp_path / f"{name}.rrd")]
        assert shares == pytest.approx([(4 * 19.0 + 14.0) / height] * count, rel=1e-6)


@pytest.mark.parametrize("timeline", ["view_angle_deg", "time"])
def test_the_viewer_starts_at_the_frontal_view(timeline: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The viewer starts at the frontal view; a recording over time is not moved."""
    calls, requested = [0], []

    class Client:
        def get_state(self) -> SimpleNamespace:
            calls[0] += 1
            if calls[0] < 3:
                raise RuntimeError("not listening")
            recording = SimpleNamespace(current_timeline=timeline)
            return SimpleNamespace(views=[1], loading=[], recordings=[recording])

        def set_time(self, name: str, *, sequence: int) -> None:
            requested.append((name, sequence))

    process = SimpleNamespace(poll=lambda: None)
    monkeypatch.setattr(viewing.subprocess, "Popen", lambda command: process)
    monkeypatch.setattr(viewing.ViewerClient, "connect", lambda url: Client())
    assert viewing.open_viewer(Path("a.rrd"))[0] is process
    assert requested == ([("view_angle_deg", 0)] if timeline == "view_angle_deg" else [])


DRIVERS = [*Path("/usr/share/vulkan/icd.d").glob("*.json"), *Path("/etc/vulkan/icd.d").glob("*.json")]


@pytest.mark.skipif(not DRIVERS, reason="needs a Vulkan driver: install mesa-vulkan-drivers")
def test_the_viewer_draws_every_view_without_complaint(tmp_path: Path) -> None:
    write_gait(tmp_path / "a.rrd", positions=walker(3))
    write_curves(tmp_path / "c.rrd", error=np.arange(7.0), sd=np.ones(7))
    for name, timeline, value in (("a", "time", 1 / 120), ("c", "view_angle_deg", -30)):
        png = tmp_path / f"{name}.png"
        complaints = screenshot(
            tmp_path / f"{name}.rrd", png, size=(800, 600), timeline=timeline, value=value
        )
        assert complaints == ()
        assert png.read_bytes()[16:24] == (800).to_bytes(4, "big") + (600).to_bytes(4, "big")


def test_what_is_shown_in_space_is_framed_wherever_it_is_and_however_large() -> None:
    small = Extent((4.0, -0.3, 0.0), (4.4, 0.3, 1.8))
    large = Extent((-9.0, -9.0, 0.0), (9.0, 9.0, 3.0))
    view = Space3D(name="one", focus=("world/small",))
    eye, target = framed(view, {"world/small": small, "world/large": large})
    np.testing.assert_allclose(target, [4.2, 0.0, 0.9])
    assert 2.0 < np.linalg.norm(eye - target) < 3.5
    way = np.array(view.eye_mm) - np.array(view.target_mm)
    np.testing.assert_allclose((eye - target) / np.linalg.norm(eye - target), way / np.linalg.norm(way))
    far, _ = framed(Space3D(name="all"), {"world/small": small, "world/large": large})
    assert np.linalg.norm(far) > 20.0
