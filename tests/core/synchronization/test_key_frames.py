"""Tests of key-frames: they mark starts and ends of movements, show corresponding postures, and align performances."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.core import linear_model, posture
from pipeline.core.synchronization import choose_key_frames, key_frames, resample_by_key_frames
from pipeline.core.synchronization import curvature as curvatures
from pipeline.core.synchronization.curvature import SMOOTHING, curvature
from pipeline.synthetic.bending import BendingPerformances, bending_performances
from pipeline.synthetic.bending.time_warps import correspondence, draw_waves, warp
from tests.rejects import rejects
from tests.strategies import seeds

CORNERS = (0.15, 0.4, 0.5, 0.7, 0.85)


def trapezoids(phase: np.ndarray) -> np.ndarray:
    """Return a movement (F, 2) with linear segments between five corners, in rest and in motion."""
    first = np.interp(phase, [0.0, *CORNERS, 1.0], [0, 0, 3, 3, 0, 0, 2])
    other = np.interp(phase, [0.0, *CORNERS, 1.0], [0, 0, 1, 1, 2, 2, 0])
    return np.stack([first, other], axis=1)


def random_performances(
    seed: int, count: int = 6, spread: float = 0.3
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return random performances of one action with warped timing, and their true phases."""
    generator = np.random.default_rng(seed)
    phases = [warp(draw_waves(generator, spread), int(generator.integers(70, 140))) for _ in range(count)]
    return [trapezoids(p) for p in phases], phases


@pytest.fixture(scope="module")
def bends() -> BendingPerformances:
    return bending_performances(np.random.default_rng(12), performances=20)


@pytest.fixture(scope="module")
def in_aspace(bends: BendingPerformances) -> list[np.ndarray]:
    postures = [posture.postures(p) for p in bends.positions_mm]
    model = linear_model.fit(np.concatenate(postures), 5)
    return [(p - model.mean) @ model.components.T for p in postures]


# --- curvature --------------------------------------------------------------------------------------------


def test_curvature_is_that_of_a_circle_s_graph() -> None:
    t = np.linspace(0.0, 1.0, 2001)
    x = 0.4 * np.sin(2 * np.pi * t)[:, None]
    r = x.std()
    smoothed = 0.4 / r * np.exp(-((2 * np.pi * SMOOTHING) ** 2) / 2)  # what a Gaussian leaves of a sine
    expected = (smoothed * (2 * np.pi) ** 2 * np.abs(np.sin(2 * np.pi * t))) / (
        1 + (smoothed * 2 * np.pi * np.cos(2 * np.pi * t)) ** 2
    ) ** 1.5
    inner = slice(300, -300)
    np.testing.assert_allclose(curvature(x)[inner], expected[inner], rtol=2e-3, atol=1e-2)


@given(seeds, st.floats(1e-6, 1e6))
def test_curvature_knows_no_units(seed: int, scale: float) -> None:
    (x,), _ = random_performances(seed, 1)
    np.testing.assert_allclose(curvature(scale * x + 5.0 * scale), curvature(x), rtol=1e-6, atol=1e-9)
    rotation, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((2, 2)))
    np.testing.assert_allclose(curvature(x @ rotation), curvature(x), rtol=1e-6, atol=1e-9)


def test_more_frames_a_second_change_nothing_but_the_count() -> None:
    coarse, fine = (curvature(trapezoids(np.linspace(0, 1, n))) for n in (101, 401))
    np.testing.assert_allclose(fine[::4], coarse, rtol=0.05, atol=0.05 * coarse.max())


# --- where key-frames lie ---------------------------------------------------------------------------------


@given(seeds)
def test_the_corners_of_an_action_are_found(seed: int) -> None:
    sequences, phases = random_performances(seed, spread=0.05)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(curvatures, "SMOOTHING", 0.01)  # which rounds corners off by less
        result = choose_key_frames(sequences)
    assert result.converged
    at = np.array([p[f] for p, f in zip(phases, result.frames, strict=True)])
    np.testing.assert_allclose(at, np.tile(CORNERS, (6, 1)), atol=0.05)


def test_the_choice_of_one_performance_is_the_best_of_all_choices() -> None:
    (x,), _ = random_performances(4, 1)
    x = x[::4]
    bend = curvature(x)
    distance = int(np.ceil(key_frames.SEPARATION * (len(x) - 1)))
    nodes = range(distance, len(x) - distance)
    best = max(
        (c for c in itertools.combinations(nodes, 3) if min(np.diff(c)) >= distance),
        key=lambda c: (sum(bend[list(c)]), [-f for f in c]),
    )
    np.testing.assert_array_equal(key_frames._best(bend, 3), best)


@given(seeds, st.integers(1, 6))
def test_key_frames_increase_and_keep_their_distance(seed: int, count: int) -> None:
    generator = np.random.default_rng(seed)
    sequences = [np.cumsum(generator.standard_normal((n, 3)), axis=0) for n in (60, 75, 91)]
    result = choose_key_frames(sequences, count=count)
    assert result.frames.shape == (3, count)
    for x, frames in zip(sequences, result.frames, strict=True):
        gaps = np.diff(np.r_[0, frames, len(x) - 1])
        assert gaps.min() >= key_frames.SEPARATION * (len(x) - 1) - 1e-6
    again = choose_key_frames([x.copy() for x in sequences], count=count)
    np.testing.assert_array_equal(again.frames, result.frames)


def test_agreement_makes_the_same_key_frames_of_noisy_performances(
    bends: BendingPerformances, in_aspace: list[np.ndarray]
) -> None:
    def disagreement(frames: Sequence[np.ndarray]) -> float:
        at = np.array([p[f] for p, f in zip(bends.phase, frames, strict=True)])
        return float(at.std(axis=0).max())

    together = choose_key_frames(in_aspace)
    alone = [choose_key_frames([x]).frames[0] for x in in_aspace]
    assert together.converged
    assert disagreement(list(together.frames)) < 0.06
    assert disagreement(alone) > 2.0 * disagreement(list(together.frames))


# --- resampling -------------------------------------------------------------------------------------------


@given(seeds, st.integers(20, 150))
def test_key_frames_and_ends_come_to_common_samples(seed: int, n_samples: int) -> None:
    sequences, _ = random_performances(seed)
    frames = choose_key_frames(sequences).frames
    result = resample_by_key_frames(sequences, frames, n_samples)
    assert result.sequences.shape == (6, n_samples, 2)
    np.testing.assert_allclose(result.warp[:, result.samples], frames, atol=1e-9)
    np.testing.assert_array_equal(result.warp[:, 0], 0)
    np.testing.assert_array_equal(result.warp[:, -1], np.array([len(x) - 1.0 for x in sequences]))
    assert (np.diff(result.warp, axis=1) > 0).all()
    for x, key, s in zip(sequences, frames, result.sequences, strict=True):
        np.testing.assert_allclose(s[result.samples], x[key], atol=1e-9)
        np.testing.assert_allclose(s[[0, -1]], x[[0, -1]], atol=1e-9)


def test_resampling_is_piecewise_linear_by_hand() -> None:
    ramps = [np.arange(5.0)[:, None], np.arange(9.0)[:, None]]
    result = resample_by_key_frames(ramps, np.array([[1], [6]]), 5)
    np.testing.assert_array_equal(result.samples, [2])  # the mean of 1/4 and 6/8
    np.testing.assert_allclose(result.warp, np.array([[0, 0.5, 1, 2.5, 4], [0, 3, 6, 7, 8.0]]))
    np.testing.assert_allclose(result.sequences[..., 0], result.warp)
    three = resample_by_key_frames([np.arange(11.0)[:, None]] * 3, np.array([[1], [2], [9]]), 11)
    assert three.samples.tolist() == [4]  # the mean, not the middle one


@pytest.mark.parametrize("n_samples", [7, 8, 11])
def test_few_samples_still_keep_key_frames_apart(n_samples: int) -> None:
    x = np.cumsum(np.ones((101, 1)), axis=0)
    for frames in ([1, 2, 3, 4, 5], [95, 96, 97, 98, 99], [48, 49, 50, 51, 52]):
        samples = resample_by_key_frames([x], np.array([frames]), n_samples).samples
        assert (np.diff(np.r_[0, samples, n_samples - 1]) >= 1).all()


def test_key_frames_explain_most_of_the_timing(
    bends: BendingPerformances, in_aspace: list[np.ndarray]
) -> None:
    """Key-frames reduce variance and timing error well below those of linear normalisation."""
    result = resample_by_key_frames(in_aspace, choose_key_frames(in_aspace).frames, 100)
    linear = np.array([np.linspace(0, len(x) - 1, 100) for x in in_aspace])
    plain = np.array(
        [
            [np.interp(w, np.arange(len(x)), column) for column in x.T]
            for x, w in zip(in_aspace, linear, strict=True)
        ]
    )
    assert result.sequences.var(axis=0).sum() < 0.75 * plain.var(axis=0).sum()

    def error(warps: np.ndarray) -> float:
        outcome = []
        for n, m in itertools.permutations(range(20), 2):
            phase = np.interp(warps[n], np.arange(len(bends.phase[n])), bends.phase[n])
            moving = (phase > bends.moving_phase[0]) & (phase < bends.moving_phase[1])
            outcome.append(np.abs(correspondence(phase, bends.phase[m]) - warps[m])[moving].mean())
        return float(np.mean(outcome))

    assert error(result.warp) < 0.5 * error(linear)


# --- bad input --------------------------------------------------------------------------------------------


def test_bad_performances_are_refused_in_one_sentence() -> None:
    good = trapezoids(np.linspace(0, 1, 80))
    missing = good.copy()
    missing[7, 1] = np.nan
    with rejects("no_performances"):
        choose_key_frames([])
    with rejects("not_finite", "performance 1, frame 7"):
        choose_key_frames([good, missing])
    with rejects("other_dimension", "performance 1", dimension=1):
        choose_key_frames([good, good[:, :1]])
    with rejects("no_motion", "performance 1"):
        choose_key_frames([good, np.ones((80, 2))])
    with rejects("out_of_range", "frames of the performance", value=2):
        curvature(good[:2])
    with rejects("too_short", "performance 0", frames=6, needed=7):
        choose_key_frames([good[::15]])


def test_bad_choices_are_refused_in_one_sentence() -> None:
    good = trapezoids(np.linspace(0, 1, 80))
    with rejects("out_of_range", "the number of key-frames", value=0):
        choose_key_frames([good], count=0)
    with rejects("wrong_shape", "key-frames", shape=(2, 1)):
        resample_by_key_frames([good], np.array([[3], [4]]), 10)
    with rejects("not_increasing", "performance 0"):
        resample_by_key_frames([good], np.array([[3, 3]]), 10)
    with rejects("not_increasing", "performance 0"):
        resample_by_key_frames([good], np.array([[3, 79]]), 10)
    with rejects("too_few_samples", samples=3):
        resample_by_key_frames([good], np.array([[3, 9]]), 3)
