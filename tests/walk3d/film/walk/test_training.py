"""Tests of the model of walkers: mean, structured covariance, and mirror images."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.skeleton import WALKER15
from tests.rejects import rejects
from tests.walk3d.film.walk.walkers import CLEAN, RATE, motions, prior, walks
from walk3d.anatomy.prior import BONES, PAIRS, bone_lengths, definitions, mirror_image, stance_rows
from walk3d.film.simulation.keypoints import Filming, simulate_keypoints
from walk3d.film.walk import Fitting, compact, expand, moments, prepare, reconstruct, train, training_walk
from walk3d.film.walk.errors import headings, level_angles
from walk3d.film.walk.prior import Detector
from walk3d.film.walk.sagittal_angles import ANGLES
from walk3d.film.walk.training import HEIGHT_MM

KNEES = [number for number, angle in enumerate(ANGLES) if angle.endswith("knee")]


def test_every_walker_has_the_same_height() -> None:
    for walk in walks():
        rest = walk.walker[:, 2, 0]
        assert rest[0] - min(rest[11], rest[14]) == pytest.approx(HEIGHT_MM, rel=0.08)


def test_the_model_of_mirrored_people_is_the_same() -> None:
    people = np.arange(len(walks()))
    first = train(list(walks()), people)
    mirrored = [
        type(w)(mirror_image(w.walker), w.frequency_hz, w.aperiodic_variance, w.height_mm) for w in walks()
    ]
    other = train(mirrored, people)
    np.testing.assert_allclose(other.mean, first.mean, atol=1e-8)
    np.testing.assert_allclose(other.covariance, first.covariance, atol=1e-6)
    np.testing.assert_allclose(first.aperiodic_variance[list(WALKER15.mirror)], first.aperiodic_variance)
    np.testing.assert_allclose(mirror_image(first.mean), first.mean, atol=1e-8)


def test_who_is_twice_as_tall_is_the_same_walker() -> None:
    motion = motions()[0] + np.random.default_rng(0).normal(scale=5.0, size=motions()[0].shape)
    first, other = (training_walk(size * motion, RATE, size * 1600.0) for size in (1.0, 2.0))
    np.testing.assert_allclose(other.walker, first.walker, atol=1e-6)
    np.testing.assert_allclose(other.aperiodic_variance, first.aperiodic_variance, rtol=1e-6)


def test_walks_of_one_person_count_as_one_person() -> None:
    people = np.arange(len(walks()))
    once = train(list(walks()), people)
    twice = train([*walks(), walks()[0]], np.append(people, 0))
    np.testing.assert_allclose(twice.mean, once.mean, atol=1e-9)


def test_feet_on_the_ground_move_backwards_at_the_belt_speed() -> None:
    model = prior().model
    rows, belt = stance_rows(model.mean)
    flat = model.mean.ravel()
    assert belt @ flat > 0
    assert np.abs(rows @ flat).max() < 0.5 * (belt @ flat)


def test_bones_are_those_of_the_tree_and_pairs_are_mirror_images() -> None:
    assert len(BONES) == 16
    lengths = bone_lengths(walks()[0].walker[None])[0].mean(axis=-1)
    np.testing.assert_allclose(lengths[PAIRS[:, 0]], lengths[PAIRS[:, 1]], rtol=0.1)


def test_a_detector_without_bias_gives_nothing_back() -> None:
    exact = prepare(prior().model, Detector(floor_mm=np.zeros(15)))
    biased = prior()
    W = prior().mean.ravel() + 5.0
    assert (
        np.abs(exact.bias_gain @ (W - exact.mean.ravel()) - 5.0).max()
        < np.abs(biased.bias_gain @ (W - biased.mean.ravel()) - 5.0).max()
    )
    assert np.linalg.eigvalsh(biased.remaining).min() > -1e-6


def test_one_person_is_no_population() -> None:
    with rejects("too_few_people", count=1):
        train([walks()[0], walks()[0]], np.array([1, 1]))


def test_a_compact_model_keeps_the_variance_and_leading_eigenwalkers() -> None:
    whole = moments(list(walks()), np.arange(len(walks())))
    small = compact(whole, 5)
    back = expand(small)
    assert np.trace(back.covariance) == pytest.approx(np.trace(whole.covariance))
    assert np.linalg.eigvalsh(back.covariance).min() > -1e-6 * np.trace(back.covariance)
    for component in small.components:
        assert component @ back.covariance @ component >= component @ whole.covariance @ component * (
            1 - 1e-9
        )
    assert small.components.shape == (5, whole.covariance.shape[0])
    with rejects("out_of_range", "the number of eigenwalkers", value=7):
        compact(whole, 7)


def test_an_unfamiliar_laboratory_widens_constants_alone() -> None:
    model = prior().model
    plain, wider = (prepare(model, Detector(), unfamiliar=share) for share in (0.0, 0.4))
    np.testing.assert_array_equal(plain.covariance, model.covariance)
    gained = (wider.covariance - model.covariance).reshape(15, 3, 9, 15, 3, 9)
    np.testing.assert_allclose(gained[:, :, 0, :, :, 0], 0.4 * definitions(across=False), atol=1e-9)
    gained[:, :, 0, :, :, 0] = 0.0
    assert not gained.any()
    assert wider.model is model  # walkers themselves do not differ by more


@pytest.mark.parametrize("shift_mm", [-40.0, 40.0])
def test_knees_that_a_laboratory_puts_elsewhere_are_seen_from_the_side(shift_mm: float) -> None:
    def moved(motion: np.ndarray) -> np.ndarray:
        return motion + shift_mm * np.array([[j.endswith("knee")] for j in WALKER15.joints]) * [0.0, 1.0, 0.0]

    errors = []
    for unfamiliar in (0.0, 1.0):
        filming = Filming(heading_rad=np.radians(90.0), speed_mm_s=1200.0)
        sim = simulate_keypoints(np.random.default_rng(0), moved(motions()[0]), RATE, filming, CLEAN)
        result = reconstruct(
            sim.pixels, np.ones(sim.pixels.shape[:2]), sim.frame_rate_hz, sim.focal_px,
            prepare(prior().model, Detector(), unfamiliar=unfamiliar), Fitting(both_labellings=False),
        )  # fmt: skip
        of_knees = [
            level_angles(positions, at)[:, KNEES]
            for positions, at in (
                (result.posterior.positions_mm, headings(result)), (sim.positions_mm, sim.heading_rad),
            )
        ]  # fmt: skip
        errors.append(abs(np.degrees(of_knees[0] - of_knees[1]).mean()))
    assert errors[1] < 0.6 * errors[0]
