"""Tests of the reconstruction from keypoints, with synthetic people who are not part of the model."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
import pytest

from pipeline.skeleton import WALKER15
from tests.rejects import rejects
from tests.walk3d.film.walk.walkers import RATE, clip, motions, prior, walks
from walk3d.film.simulation.keypoints import DetectorError, Filming, SimulatedKeypoints, simulate_keypoints
from walk3d.film.walk import Fitting, errors, reconstruct, reconstruct_followed, view_angle_deg
from walk3d.film.walk.objective import FOCAL_SD, HEADING, LOG_F
from walk3d.film.walk.path import median_of_seen
from walk3d.film.walk.verdict import Verdict, judge


def _error_mm(sim: SimulatedKeypoints, positions: np.ndarray) -> float:
    scale = (positions * sim.positions_mm).sum() / (positions**2).sum()
    return float(np.linalg.norm(scale * positions - sim.positions_mm, axis=-1).mean())


@pytest.mark.parametrize("heading", [0.0, -60.0, 90.0, 150.0])
def test_view_cadence_and_walk_are_found(heading: float) -> None:
    sim = clip(heading, DetectorError(missing=0.05))
    result = reconstruct(sim.pixels, np.ones(sim.pixels.shape[:2]), sim.frame_rate_hz, sim.focal_px, prior())
    turn = (result.fit.x[HEADING] - sim.heading_rad + np.pi) % (2 * np.pi) - np.pi
    assert abs(np.degrees(turn)) < 8.0
    assert np.exp(result.fit.x[LOG_F]) == pytest.approx(walks()[0].frequency_hz, rel=0.02)
    assert not result.labels_exchanged
    assert _error_mm(sim, result.posterior.positions_mm) < 45.0
    assert judge(result).verdict != Verdict.not_a_walk
    truth = errors.level_angles(sim.positions_mm, sim.heading_rad)
    assert np.degrees(np.sqrt(((result.posterior.angles_rad - truth)[:, :2] ** 2).mean())) < 9.0


@pytest.mark.parametrize("heading", [0.0, 30.0])
def test_so_many_frames_a_second_give_up_no_start_too_early(heading: float) -> None:
    sim = clip(heading, DetectorError(), seed=1, frame_rate_hz=480.0)
    result = reconstruct(sim.pixels, np.ones(sim.pixels.shape[:2]), 480.0, sim.focal_px, prior())
    assert not result.labels_exchanged
    assert abs(np.degrees(result.fit.x[HEADING]) - heading) < 8.0


def test_a_wrong_focal_length_moves_the_view_less_if_it_is_an_unknown() -> None:
    sim = clip(90.0)
    described = 2.5 * sim.focal_px
    inputs = sim.pixels + np.array([0.5 * sim.focal_px, 0.0])  # off the middle, where the view depends on it
    finite = clip(90.0).focal_px
    headings = []
    for focal, sd in ((finite, 0.0), (described, 0.0), (described, FOCAL_SD)):
        result = reconstruct(
            inputs,
            np.ones(inputs.shape[:2]),
            sim.frame_rate_hz,
            focal,
            prior(),
            Fitting(both_labellings=False, focal_sd=sd),
        )
        headings.append(np.degrees(result.fit.x[HEADING]))
    assert result.focal_px < 0.75 * described
    assert abs(headings[2] - headings[0]) < 0.5 * abs(headings[1] - headings[0])


def test_labels_exchanged_throughout_are_found() -> None:
    sim = clip(30.0)
    pixels = sim.pixels[:, [0, 1, 5, 6, 7, 2, 3, 4, 8, 12, 13, 14, 9, 10, 11]]
    result = reconstruct(pixels, np.ones(pixels.shape[:2]), sim.frame_rate_hz, sim.focal_px, prior())
    assert result.labels_exchanged
    assert abs(np.degrees(result.fit.x[HEADING]) - 30.0) < 8.0


def test_frames_with_exchanged_legs_are_found() -> None:
    sim = clip(60.0)
    pixels = sim.pixels.copy()
    pixels[20:28, 9:12], pixels[20:28, 12:15] = sim.pixels[20:28, 12:15], sim.pixels[20:28, 9:12]
    result = reconstruct(
        pixels,
        np.ones(pixels.shape[:2]),
        sim.frame_rate_hz,
        sim.focal_px,
        prior(),
        Fitting(both_labellings=False),
    )
    frames = np.flatnonzero(result.fit.exchanged["legs"])
    assert set(frames) <= set(range(20, 28))
    assert len(frames) >= 4  # where the legs pass each other, labels do not matter


@pytest.mark.parametrize(("heading", "seed"), [(-150.0, 0), (45.0, 0), (120.0, 1), (30.0, 1), (90.0, 0)])
def test_legs_alone_exchanged_throughout_are_found(heading: float, seed: int) -> None:
    sim = clip(heading, DetectorError(), seed)
    legs_exchanged = sim.pixels[:, [*range(9), 12, 13, 14, 9, 10, 11]]
    result, right = (
        reconstruct(pixels, np.ones(pixels.shape[:2]), sim.frame_rate_hz, sim.focal_px, prior())
        for pixels in (legs_exchanged, sim.pixels)
    )
    assert not right.labels_exchanged
    error, least = (_error_mm(sim, first.posterior.positions_mm) for first in (result, right))
    assert error < least + 2.0
    # Of both ways to say so, to exchange the legs or to exchange all and the arms again, either will do.
    exchanged = result.fit.exchanged["arms" if result.labels_exchanged else "legs"]
    assert exchanged.mean() > 0.6  # where limbs pass each other, labels do not matter


def test_all_exchanged_and_again_in_most_frames_is_as_given() -> None:
    """A walk whose labels are exchanged as a whole, and again in most frames, is reported with the detected labels.

    From a large distance, a walker and the mirror image look alike, and the search starts with either labels.
    """
    filming = Filming(heading_rad=np.radians(96.0), speed_mm_s=1200.0, distance_mm=(9000.0, 14000.0))
    sim = simulate_keypoints(np.random.default_rng(26), motions()[0], RATE, filming, DetectorError())
    result = reconstruct(sim.pixels, np.ones(sim.pixels.shape[:2]), sim.frame_rate_hz, 1800.0, prior())
    assert _error_mm(sim, result.posterior.positions_mm) < 60.0
    assert not result.labels_exchanged
    assert result.fit.exchanged["legs"].mean() < 0.5


def test_what_is_missing_has_no_say() -> None:
    sim = clip(45.0, DetectorError(missing=0.1))
    weights = np.isfinite(sim.pixels).all(axis=-1).astype(float)
    filled = np.where(weights[..., None] > 0, sim.pixels, 1e5)
    options = Fitting(both_labellings=False, max_starts=1)
    first = reconstruct(sim.pixels, weights, sim.frame_rate_hz, sim.focal_px, prior(), options)
    other = reconstruct(filled, weights, sim.frame_rate_hz, sim.focal_px, prior(), options)
    np.testing.assert_allclose(first.fit.x, other.fit.x, rtol=1e-9)


def test_bars_are_wider_where_nothing_is_seen() -> None:
    sim = clip(90.0)
    weights = np.ones(sim.pixels.shape[:2])
    weights[:, 2:5] = 0.0  # the left arm
    result = reconstruct(
        sim.pixels, weights, sim.frame_rate_hz, sim.focal_px, prior(), Fitting(both_labellings=False)
    )
    sd = result.posterior.sd_mm.mean(axis=(0, 2))
    assert sd[4] > 1.2 * sd[7]
    assert (sd[8] == 0).all()


def test_somebody_who_stands_does_not_walk() -> None:
    sim = clip(0.0)
    rng = np.random.default_rng(0)
    still = np.repeat(sim.pixels[:1], len(sim.pixels), axis=0) + rng.normal(scale=2.0, size=sim.pixels.shape)
    result = reconstruct(still, np.ones(still.shape[:2]), sim.frame_rate_hz, sim.focal_px, prior())
    assert judge(result).verdict != Verdict.walk


@pytest.mark.parametrize(
    ("change", "rejection"),
    [
        (lambda pixels: pixels[:5], rejects("too_short", frames=5)),
        (lambda pixels: pixels[:14], rejects("too_short")),
        (lambda pixels: -pixels, rejects("not_upright")),
        (lambda pixels: pixels * np.nan, rejects("too_few_joints")),
        (lambda pixels: pixels[:, :10], rejects("wrong_shape", "pixels", shape=(84, 10, 2))),
    ],
)
def test_what_cannot_be_used_is_refused(change, rejection: AbstractContextManager) -> None:  # type: ignore[no-untyped-def]
    pixels = change(clip(0.0).pixels)
    with rejection:
        reconstruct(pixels, np.ones(pixels.shape[:2]), 30.0, 800.0, prior())


def test_the_papers_frontal_view_is_seen_from_behind() -> None:
    assert view_angle_deg(np.pi) == pytest.approx(0.0)
    assert view_angle_deg(np.pi / 2) == pytest.approx(90.0)


def test_nothing_is_refined_of_feet_that_move_together() -> None:
    sim = clip(90.0)
    pixels = sim.pixels.copy()
    for joint in ("knee", "ankle"):
        left, right = (WALKER15.index(f"{side}_{joint}") for side in ("left", "right"))
        pixels[:, right] = pixels[:, left] + [5.0, 0.0]
    inputs = np.ones(pixels.shape[:2]), sim.frame_rate_hz, sim.focal_px, prior()
    assert reconstruct(pixels, *inputs).starts.ankles_together > 0.9
    assert reconstruct(sim.pixels, *inputs, Fitting(max_ankle_correlation=0.5)).starts.ankles_together < 0.0
    with rejects("feet_together"):
        reconstruct_followed(pixels, *inputs)


def test_the_median_of_what_is_seen_is_that_without_the_rest() -> None:
    generator = np.random.default_rng(0)
    values, observed = generator.normal(size=(20, 2, 9)), generator.random((20, 1, 9)) < 0.7
    observed[..., 0] = True
    expected = np.nanmedian(np.where(observed, values, np.nan), axis=-1)
    np.testing.assert_array_equal(median_of_seen(values, observed), expected)
