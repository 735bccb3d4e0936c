"""Tests of stick-figure pictures: every bone is drawn, and invalid positions are rejected."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.charts import Axis, Chart, Sheet
from pipeline.pictures.motions import draw_motion
from pipeline.pictures.postures import draw_postures
from pipeline.pictures.skeletons import draw_skeletons
from pipeline.pictures.style import Canvas
from pipeline.scenes import MotionScene, PostureRow, SkeletonRow
from tests.rejects import rejects

BONES = ((0, 1), (1, 2))
LIMB = np.array([[0.0, 1700.0], [50.0, 900.0], [-200.0, 0.0]])
POSTURES = PostureRow(
    label="0°", original=np.tile(LIMB, (5, 1, 1)), reconstructed=np.tile(LIMB + 20, (5, 1, 1))
)
SKELETONS = SkeletonRow(label="frame 1", centre=LIMB, others=np.tile(LIMB + 20, (4, 1, 1)))


def segments(path: Path) -> int:
    """Return the number of lines with two points in an SVG file: bones and ground lines."""
    paths = [e for e in ElementTree.parse(path).getroot().iter() if e.tag.endswith("path")]
    drawn = [e.get("d", "") for e in paths if "stroke:" in e.get("style", "")]
    return sum(d.count("M") == d.count("L") == 1 for d in drawn)


def draw(stem: Path) -> None:
    """Draw two groups of postures with two rows each."""
    rows = (POSTURES, replace(POSTURES, label="30°"))
    draw_postures(Canvas(stem, caption="Data: none."), [("(a)", rows), ("(b)", rows)], BONES)


def test_equal_postures_give_equal_bytes(tmp_path: Path) -> None:
    for name in ("one", "two"):
        draw(tmp_path / name)
    for suffix in ("svg", "png"):
        assert (tmp_path / f"one.{suffix}").read_bytes() == (tmp_path / f"two.{suffix}").read_bytes()


def test_every_posture_draws_every_bone_twice(tmp_path: Path) -> None:
    draw(tmp_path / "a")
    groups, rows, count, kinds = 2, 2, 5, 2
    assert segments(tmp_path / "a.svg") == groups * rows * count * kinds * len(BONES)


def test_joints_that_nobody_measured_are_rings(tmp_path: Path) -> None:
    hollow = replace(POSTURES, estimated=np.array([True, False, False]))
    draw_postures(Canvas(tmp_path / "a"), [("", [hollow])], BONES)
    draw_postures(Canvas(tmp_path / "b"), [("", [POSTURES])], BONES)
    white = [(tmp_path / f"{name}.svg").read_text().count("fill: #ffffff; stroke") for name in "ab"]
    count, kinds, legend = 5, 2, 1
    assert white[0] - white[1] == count * kinds + legend


def test_skeletons_are_drawn_one_by_one_over_the_posture_that_they_vary(tmp_path: Path) -> None:
    draw_skeletons(Canvas(tmp_path / "a"), [SKELETONS, SKELETONS], BONES, legend=("mean", "sample"))
    rows, centres, others, ground = 2, 5, 4, 1
    assert segments(tmp_path / "a.svg") == rows * ((centres + others) * len(BONES) + ground)


def test_a_width_at_which_postures_cannot_be_read_is_rejected(tmp_path: Path) -> None:
    with rejects("too_narrow", "figure.width_mm"):
        draw_postures(Canvas(tmp_path / "a", width_mm=20.0), [("", [POSTURES])], BONES)


def test_a_gap_is_not_drawn_in_silence(tmp_path: Path) -> None:
    gaps = replace(POSTURES, reconstructed=POSTURES.original * np.nan)
    with rejects("not_finite"):
        draw_postures(Canvas(tmp_path / "a"), [("", (gaps,))], BONES)
    with rejects("not_finite"):
        draw_skeletons(
            Canvas(tmp_path / "a"),
            [replace(SKELETONS, centre=LIMB * np.nan)],
            BONES,
            legend=("mean", "sample"),
        )
    with rejects("not_finite"):
        draw_motion(
            Canvas(tmp_path / "a", BELOW),
            replace(SCENE, rows=[("", SCENE.image * np.nan, SCENE.image, "blue")]),
            BONES,
        )
    assert list(tmp_path.iterdir()) == []


SCENE = MotionScene(
    image=np.tile(LIMB, (2, 1, 1)),
    rows=[("from aside", np.tile(LIMB + 20, (2, 1, 1)), np.tile(LIMB, (2, 1, 1)), "blue")] * 2,
    ground=np.zeros((3, 2)),
    cameras=[("still", "orange", np.zeros((3, 2)), np.eye(3, 2))],
)
BELOW = Sheet(
    charts=[
        Chart(
            table={"step": ["before", "after"], "clip": [0, 0], "error_mm": [2.0, 1.0]}, x="step", y="error_mm",
            abscissa=Axis(words={"before": "before", "after": "after"}), strands="clip",
        )
    ]
)  # fmt: skip


def test_a_motion_shows_every_bone_in_the_image_and_twice_in_each_row(tmp_path: Path) -> None:
    draw_motion(Canvas(tmp_path / "a", BELOW), SCENE, BONES)
    draw_motion(Canvas(tmp_path / "b", BELOW), replace(SCENE, rows=SCENE.rows[:1]), BONES)
    instants, kinds = 2, 2
    assert segments(tmp_path / "a.svg") - segments(tmp_path / "b.svg") == instants * kinds * len(BONES)
