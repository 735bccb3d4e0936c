"""Tests that calibration on a few people of a laboratory reduces the errors for all other people of this laboratory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.core import fourier
from pipeline.skeleton import WALKER15
from tests.rejects import rejects
from tests.walk3d.film.walk.walkers import walks
from walk3d.anatomy import prior as anatomical
from walk3d.film.reconstruct import model_file
from walk3d.film.reconstruct.own_laboratory import calibrated
from walk3d.film.training_command import train_model
from walk3d.film.walk import CompactMoments, compact, moments


@pytest.fixture(scope="module")
def small() -> CompactMoments:
    return compact(moments(walks()[4:], np.arange(len(walks()) - 4)), 4)


@pytest.fixture(scope="module")
def elsewhere() -> np.ndarray:
    """Return walkers (4, 9, 15, 3) of a laboratory that places both knees 40 mm further forward."""
    each = anatomical.by_block(np.stack([walk.walker for walk in walks()[:4]]))
    both = (each + fourier.mirrored(each)) / 2.0
    both[:, 0, [WALKER15.index("left_knee"), WALKER15.index("right_knee")], 1] += 40.0
    return both


def test_somebody_else_of_that_laboratory_is_nearer_with_every_known_person(
    small: CompactMoments, elsewhere: np.ndarray
) -> None:
    *finite, tested = elsewhere
    knees = [WALKER15.index("left_knee"), WALKER15.index("right_knee")]
    off = [abs(small.mean[knees, 1, 0] - tested[0, knees, 1]).mean()]
    for count in (1, 3):
        moved = calibrated(small, np.stack(finite[:count]), 1.0).mean
        off.append(abs(moved[knees, 1, 0] - tested[0, knees, 1]).mean())
    assert off[0] > 30.0
    assert off[2] < off[1] < off[0]
    assert off[2] < 0.75 * off[0]


def test_constants_move_left_and_right_alike_and_nothing_else(
    small: CompactMoments, elsewhere: np.ndarray
) -> None:
    moved = calibrated(small, elsewhere, 1.0)
    distance = moved.mean - small.mean
    np.testing.assert_array_equal(distance[..., 1:], 0.0)
    np.testing.assert_allclose(distance[WALKER15.index("pelvis")], 0.0, atol=1e-9)
    np.testing.assert_allclose(
        distance[list(WALKER15.mirror), :, 0], distance[..., 0] * [-1.0, 1.0, 1.0], atol=1e-6
    )
    assert moved.components is small.components
    same = calibrated(small, anatomical.by_block(small.mean)[None], 1.0)
    np.testing.assert_allclose(same.mean, small.mean, atol=1e-6)


def test_two_people_in_a_folder_calibrate_the_model_that_ships(tmp_path: Path) -> None:
    few = ["data=synthetic", "scale=smoke", "data.walkers=2"]
    before = (model_file.SHIPPED / "manifest.json").read_bytes()
    with rejects("few_people", "output", needed=29, people=2):
        train_model(few)
    assert (model_file.SHIPPED / "manifest.json").read_bytes() == before
    assert train_model([*few, f"output={tmp_path / 'mine'}"]) == 0
    mine, ours = model_file.load(tmp_path / "mine"), model_file.load()
    assert mine.about["calibrated_on"] == {"people": 2, "walks": 2}
    assert mine.unfamiliar == 0.5 * ours.unfamiliar  # what is each one's own stays
    assert abs(mine.compact.mean - ours.compact.mean).max() > 5.0
    np.testing.assert_array_equal(mine.compact.components, ours.compact.components)
