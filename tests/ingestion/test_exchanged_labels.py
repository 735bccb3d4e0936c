"""Tests that exchanged left and right points are detected and exchanged back, and correct points are unchanged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline import represent
from pipeline.formats.points import trc
from pipeline.ingestion.joints import EXCHANGED, MAX_EXCHANGED, exchanged_back
from pipeline.skeleton import WALKER15
from pipeline.skeleton.complaint import remarks_of
from pipeline.skeleton.recorded import MotionCapture
from pipeline.synthetic.walkers import walking_population

HZ, EVERY = 60.0, range(len(WALKER15.joints))


def walk() -> np.ndarray:
    output = walking_population(np.random.default_rng(2), male=1, female=0, duration_s=4.0, frame_rate_hz=HZ)
    return output.positions_mm[0]


def exchanged(positions: np.ndarray, joint: str, first: int, count: int) -> np.ndarray:
    pair = [WALKER15.index(f"{side}_{joint}") for side in ("left", "right")]
    frames = np.arange(first, first + count)
    original = positions.copy()
    original[np.ix_(frames, pair)] = positions[np.ix_(frames, pair[::-1])]
    return original


def recorded(positions: np.ndarray) -> MotionCapture:
    return MotionCapture(WALKER15.joints, positions, np.isfinite(positions).all(axis=-1), HZ, "mm")


@pytest.mark.parametrize("joint", ["ankle", "knee", "hip", "wrist", "shoulder"])
@pytest.mark.parametrize(("first", "count"), [(100, 10), (0, 5), (77, 1), (230, 10)])
def test_labels_are_exchanged_back(joint: str, first: int, count: int) -> None:
    truth = walk()
    assert exchanged_back(recorded(truth), EVERY).notes == ()
    result = exchanged_back(recorded(exchanged(truth, joint, first, count)), EVERY)
    np.testing.assert_array_equal(result.positions_mm, truth)
    (note,) = remarks_of(EXCHANGED, result.notes)
    assert f"left_{joint} and right_{joint} have exchanged labels: {count} frames from {first} to" in note


def test_points_that_were_never_looked_at_and_halves_of_a_walk_stay() -> None:
    output = recorded(exchanged(walk(), "ankle", 100, 10))
    assert exchanged_back(output, range(9)).notes == ()
    half = exchanged(walk(), "ankle", 100, round(MAX_EXCHANGED * 240) + 2)
    result = exchanged_back(recorded(half), EVERY)
    np.testing.assert_array_equal(result.positions_mm, half)
    assert "the labels change at frame 100" in remarks_of(EXCHANGED, result.notes)[0]


def test_a_walk_is_as_it_was_and_a_warning_says_why(tmp_path: Path) -> None:
    truth = walk()
    for name, positions in (("truth", truth), ("a", exchanged(truth, "ankle", 100, 10))):
        trc.write(tmp_path / f"{name}.trc", WALKER15.joints, positions, HZ)
    expected = represent(tmp_path / "truth.trc").coefficients
    with pytest.warns(UserWarning, match=r"a\.trc: left_ankle and right_ankle have exchanged labels"):
        result = represent(tmp_path / "a.trc").coefficients
    np.testing.assert_array_equal(result, expected)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_frame_rate_that_makes_steps_unusual_is_doubted(tmp_path: Path, factor: float) -> None:
    trc.write(tmp_path / "a.trc", WALKER15.joints, walk(), factor * HZ)
    with pytest.warns(
        UserWarning, match=rf"steps a minute .*usual for legs .*{factor * HZ:g} Hz, or {HZ:g} Hz\?"
    ):
        represent(tmp_path / "a.trc")
