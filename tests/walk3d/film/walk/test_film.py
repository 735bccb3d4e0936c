"""Tests of films as amateurs make them: standing before the walk, shaking camera, wrong frame rate, or no walk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.walk3d.film.walk.walkers import CLEAN, RATE, clip, motions, prior, walks
from walk3d.film.simulation.activities import Activity, perform, with_standing
from walk3d.film.simulation.filmed import lasting
from walk3d.film.simulation.keypoints import DetectorError, Filming, SimulatedKeypoints, simulate_keypoints
from walk3d.film.walk import Fitting, errors, reconstruct
from walk3d.film.walk.film import Film, FilmResult, reconstruct_film
from walk3d.film.walk.tracks import moving_parts, path_turn_rad

FAR_MM = (6000.0, 8000.0)
USUAL = DetectorError(swaps_per_s=0.0)


def filmed(positions: np.ndarray, seed: int, heading_deg: float, **filming: float) -> SimulatedKeypoints:
    placed = Filming(heading_rad=np.radians(heading_deg), drift_mm_s=0.0, distance_mm=FAR_MM, **filming)
    return simulate_keypoints(np.random.default_rng(seed), positions, RATE, placed, USUAL)


def watched(sim: SimulatedKeypoints, rate_factor: float = 1.0) -> FilmResult:
    observed = np.isfinite(sim.pixels).all(axis=-1).astype(float)
    return reconstruct_film(
        Film(
            sim.pixels,
            observed,
            rate_factor * sim.frame_rate_hz,
            sim.focal_px,
            prior(),
            both_labellings=False,
            focal_sd=0.0,
        )
    )


@pytest.mark.parametrize("heading_deg", [-90.0, 30.0])
def test_who_stands_before_and_after_a_walk_is_cut_to_the_walk(heading_deg: float) -> None:
    walk = lasting(motions()[0], RATE, 3.0)
    sim = filmed(with_standing(walk, RATE, 1200.0, 1.5), 1, heading_deg)
    result = watched(sim)
    (stretch,) = result.stretches
    still, last = round(1.5 * 30), len(sim.pixels) - round(1.5 * 30)
    assert still - 12 < stretch.first_frame < still + 20
    assert last - 20 < stretch.last_frame < last + 12
    assert stretch.judgement.verdict == "walk"
    assert stretch.reconstruction is not None
    assert stretch.reconstruction.candidates[0].frequency_hz == pytest.approx(
        walks()[0].frequency_hz, rel=0.03
    )
    assert any("the rest was ignored" in note for note in result.notes)


def test_a_walk_throughout_is_not_cut() -> None:
    sim = clip(60.0, USUAL)
    assert moving_parts(sim.pixels, 30.0) == [(0, len(sim.pixels))]


def test_the_shake_of_a_hand_is_taken_out_and_a_still_camera_is_left_alone() -> None:
    still = clip(45.0, USUAL)
    shaken = clip(45.0, replace(USUAL, shake_px=25.0))
    fitting = Fitting(both_labellings=False)
    result = [
        reconstruct(sim.pixels, np.ones(sim.pixels.shape[:2]), 30.0, sim.focal_px, prior(), fitting)
        for sim in (still, shaken)
    ]
    assert not result[0].shake_px.any()
    off = shaken.pixels - still.pixels
    # From frame to frame: what is slow may be the path as well.
    true, used = (np.diff(first, axis=0) for first in (np.nanmean(off, axis=1), result[1].shake_px))
    assert float(np.std(used - true)) < 0.35 * float(np.std(true))
    assert result[1].relative_residual < 1.3
    owner = [
        errors.mean_distance_mm(first.posterior.positions_mm, sim.positions_mm)
        for first, sim in zip(result, (still, shaken), strict=True)
    ]
    assert owner[1] < 1.4 * owner[0]
    observed = result[1].keypoints.weights > 0
    assert np.allclose(result[1].filmed_px[observed], shaken.pixels[observed])


@pytest.mark.parametrize("activity", list(Activity))
@pytest.mark.parametrize("heading_deg", [0.0, -60.0, 90.0])
def test_who_does_something_else_does_not_walk(activity: Activity, heading_deg: float) -> None:
    positions = perform(activity, np.random.default_rng(5), motions()[0], RATE, 4.0)
    assert not watched(filmed(positions, 2, heading_deg)).walks


@pytest.mark.parametrize("rate_factor", [0.5, 0.25, 2.0])
def test_a_walk_that_is_none_at_the_rate_that_was_told_is_found_at_another(rate_factor: float) -> None:
    walk = lasting(motions()[0], RATE, 3.0)
    sim = filmed(walk, 3, 60.0, speed_mm_s=1200.0, frame_rate_hz=30.0 / min(rate_factor, 1.0))
    result = watched(sim, rate_factor)
    best = result.stretches[0]
    assert best.reconstruction is not None
    assert best.walks
    stride = best.reconstruction.candidates[0].frequency_hz * sim.frame_rate_hz / result.frame_rate_hz
    if result.frame_rate_hz == pytest.approx(sim.frame_rate_hz):
        assert best.judgement.verdict == "doubtful"
        assert any("frame rate is assumed to be" in note for note in result.notes)
    else:  # half as many strides a second are those of a slow walk
        assert rate_factor == 0.5
        assert result.frame_rate_hz == rate_factor * sim.frame_rate_hz
    assert stride == pytest.approx(walks()[0].frequency_hz, rel=0.03)


def test_a_step_of_slow_motion_from_the_front_is_no_stride() -> None:
    # At the given rate a step, of half the truth's period, passes for a slow stride.
    walk = lasting(motions()[5], RATE, 4.0)
    sim = filmed(walk, 5, 180.0, speed_mm_s=1200.0, frame_rate_hz=120.0)
    result = watched(sim, 0.25)
    best = result.stretches[0].reconstruction
    assert best is not None
    assert result.stretches[0].judgement.verdict == "doubtful"
    stride = best.candidates[0].frequency_hz * sim.frame_rate_hz / result.frame_rate_hz
    assert stride == pytest.approx(walks()[5].frequency_hz, rel=0.03)


def test_a_path_on_a_circle_turns_by_its_angle_and_a_straight_one_does_not() -> None:
    heights = prior().mean[:, 2, 0]
    turn = np.radians(np.linspace(-25.0, 25.0, 90))
    for bend, expected in ((turn, 50.0), (0.0 * turn, 0.0)):
        position = np.cumsum(np.stack([np.cos(bend), np.sin(bend)], axis=-1), axis=0) * 40.0
        position += np.array([-1800.0, 5000.0]) - position[0]
        across = np.broadcast_to(position[:, :1], (90, 15))
        pixels = 900.0 * np.stack([across, -heights + 0.0 * across], axis=-1) / position[:, None, 1:]
        assert np.degrees(abs(path_turn_rad(pixels, heights, 900.0))) == pytest.approx(expected, abs=3.0)


def test_a_noisy_detector_does_not_make_a_walk_into_something_else() -> None:
    sim = clip(60.0, replace(USUAL, white_px=8.0, slow_px=4.0))
    result = reconstruct(
        sim.pixels, np.ones(sim.pixels.shape[:2]), 30.0, sim.focal_px, prior(), Fitting(both_labellings=False)
    )
    residual = (result.fit.objective.residual(result.fit.x, result.keypoints))[result.keypoints.weights > 0]
    assert float(np.sqrt(np.mean(residual**2))) > 1.6 * result.rms_residual_px
    quiet = clip(60.0, replace(CLEAN, slow_px=4.0))
    slow = reconstruct(
        quiet.pixels,
        np.ones(quiet.pixels.shape[:2]),
        30.0,
        quiet.focal_px,
        prior(),
        Fitting(both_labellings=False),
    )
    assert result.rms_residual_px == pytest.approx(slow.rms_residual_px, rel=0.35)
