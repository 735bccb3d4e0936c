"""Tests that two readers read the written BVH files, with and without position channels."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pipeline.core import fourier
from pipeline.formats import bvh
from pipeline.skeleton import WALKER15
from pipeline.synthetic import walkers
from tests.formats.bvh import independent
from tests.formats.contract import FIXTURES
from walk3d.export.bvh import write as write_bvh

HZ = 50.0


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    """Return the joints (T, 15, 3), mm, of a walker who moves forwards, with two harmonics and y upwards.

    The limbs have nearly constant length.
    """
    output = walkers.walking_population(
        np.random.default_rng(3), male=1, female=0, duration_s=3.0, frame_rate_hz=HZ
    )
    series = fourier.represent(output.positions_mm[0], HZ)
    times = np.arange(60) / HZ
    positions = fourier.synthesise(series.coefficients, series.frequency_hz, times)[..., [1, 2, 0]]
    positions[..., 0] += 1200.0 * times[:, None]
    return np.asarray(positions)


def second_reader(path: Path, names: tuple[str, ...], **options: bool) -> np.ndarray:
    """Return the positions (T, P, 3), mm, that the second reader reads."""
    result, seconds = independent.read(path, **options)
    assert seconds == pytest.approx(1 / HZ)
    return np.swapaxes([result[name] for name in names], 0, 1) * 10.0


def test_both_readers_give_back_what_was_written(walk: np.ndarray, tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    write_bvh(path, WALKER15.joints, walk, HZ, WALKER15.parents)
    ours = bvh.read(path)
    position = [ours.names.index(joint) for joint in WALKER15.joints]
    np.testing.assert_allclose(ours.positions_mm[:, position], walk, atol=1e-9)
    np.testing.assert_allclose(second_reader(path, WALKER15.joints), walk, atol=1e-9)


def test_rotations_alone_show_the_walk_with_limbs_of_constant_length(
    walk: np.ndarray, tmp_path: Path
) -> None:
    path = tmp_path / "a.bvh"
    write_bvh(path, WALKER15.joints, walk, HZ, WALKER15.parents)
    result = second_reader(path, WALKER15.joints, rotations_only=True)
    off = np.linalg.norm(result - walk, axis=-1)
    np.testing.assert_allclose(off[:, WALKER15.index("pelvis")], 0, atol=1e-9)
    swing = np.linalg.norm((walk - walk[:, [8]]) - (walk - walk[:, [8]]).mean(axis=0), axis=-1)
    left, right = WALKER15.index("left_ankle"), WALKER15.index("right_ankle")
    assert swing[:, [left, right]].max() > 250
    assert off[:, [left, right]].max() < 40
    assert off.max() < 60


def test_points_without_parents_are_roots(walk: np.ndarray, tmp_path: Path) -> None:
    write_bvh(tmp_path / "a.bvh", WALKER15.joints, walk, HZ)
    np.testing.assert_allclose(second_reader(tmp_path / "a.bvh", WALKER15.joints), walk, atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    style=st.sampled_from(["free", "still", "coincident", "opposite", "plane"]),
)
@example(seed=2708, style="plane")  # nearly opposite directions
def test_any_tree_in_any_posture(seed: int, style: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    rng = np.random.default_rng(seed)
    points = int(rng.integers(1, 9))
    parents = [-1] + [int(rng.integers(-1, k)) for k in range(1, points)]
    positions = rng.normal(size=(4, points, 3)) * 300
    if style == "still":
        positions[:] = positions[0]
    elif style == "coincident":
        positions[:, 1:] = positions[:, :1]
    elif style == "opposite":
        positions[2:] = -positions[:2]
    elif style == "plane":
        positions[..., 1] = 0
    names = tuple(f"p{k}" for k in range(points))
    path = tmp_path_factory.mktemp("bvh") / "a.bvh"
    write_bvh(path, names, positions, HZ, parents)
    np.testing.assert_allclose(second_reader(path, names), positions, atol=1e-8)
    ours = bvh.read(path)
    np.testing.assert_allclose(
        ours.positions_mm[:, [ours.names.index(n) for n in names]], positions, atol=1e-8
    )


def test_the_second_reader_on_the_file_made_by_hand(tmp_path: Path) -> None:
    text = (FIXTURES / "bvh_by_hand.bvh").read_text(encoding="utf-8").replace("Left Arm", "Left_Arm")
    (tmp_path / "a.bvh").write_text(text, encoding="utf-8")
    ours = bvh.read(tmp_path / "a.bvh")
    for name, positions in independent.read(tmp_path / "a.bvh")[0].items():
        np.testing.assert_allclose(
            ours.positions_mm[:, ours.names.index(name)], np.array(positions) * 10, atol=1e-9
        )


@pytest.mark.parametrize(
    "name", ["cmu_12_01_walk.bvh", "dataset-1_walk_normal_001.bvh", "rokoko_walking.bvh", "mixamo_names.bvh"]
)
def test_the_second_reader_on_recordings(name: str, tmp_path: Path) -> None:
    path = Path(os.environ.get("WILD_RECORDINGS") or "no such folder") / name
    if not path.is_file():
        pytest.skip("needs WILD_RECORDINGS")
    head, _, motion = path.read_text(encoding="utf-8").partition("MOTION")
    rows = [row for row in motion.split("\n") if row.strip()]
    few = ["Frames: 5", rows[1], *rows[20:25]]
    (tmp_path / name).write_text(head + "MOTION\n" + "\n".join(few) + "\n", encoding="utf-8")
    ours = bvh.read(tmp_path / name, units="cm")
    result, _ = independent.read(tmp_path / name)
    assert len(result) > 15
    for joint, positions in result.items():
        np.testing.assert_allclose(
            ours.positions_mm[:, ours.names.index(joint)], np.array(positions) * 10, atol=1e-6
        )
