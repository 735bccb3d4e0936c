"""Tests of the steady part of a walk: clips generated from a treadmill walker give the treadmill walker back."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import fourier, walking
from pipeline.skeleton import WALKER15
from tests.core.walks import (
    HIP_MM,
    LEFT_HIP,
    RATE_HZ,
    RIGHT_HIP,
    SPEED_MM_S,
    STRIDE_HZ,
    Clip,
    overground,
    turned,
)
from tests.rejects import rejects
from tests.strategies import seeds, walker

PATHS = ("cubic", "moving_average")
CLIPS: dict[str, dict[str, Any]] = {
    "curve": {},
    "veering": {"veer": 0.6},
    "long standing": {"standing_s": (8.0, 8.0), "walking_s": 6.0},
    "stop on the way": {"walking_s": 16.0, "stop_s": 2.0},
    "stands nearly all the time": {"standing_s": (40.0, 40.0), "walking_s": 5.5},
}


def whole(positions: np.ndarray) -> np.ndarray:
    return np.ones(len(positions), dtype=bool)


@pytest.mark.parametrize("name", CLIPS)
@pytest.mark.parametrize("seed", range(3))
def test_the_steady_stretch_lies_within_the_steady_walk(name: str, seed: int) -> None:
    clip = overground(seed, **CLIPS[name])
    stretch = walking.steady_stretch(clip.positions, whole(clip.positions), RATE_HZ)
    assert stretch.locomotion == "overground"
    assert clip.steady[stretch.start : stretch.stop].all()
    edges = np.diff(np.concatenate([[0], clip.steady.astype(int), [0]]))
    longest = (np.flatnonzero(edges < 0) - np.flatnonzero(edges > 0)).max()
    # A speed over one cycle sees the ramps up to half a cycle away on either side.
    assert stretch.stop - stretch.start >= longest - 1.05 * RATE_HZ / STRIDE_HZ
    assert stretch.speed_mm_s == pytest.approx(SPEED_MM_S, rel=0.01)
    assert stretch.cycles == pytest.approx((stretch.stop - stretch.start) / RATE_HZ * STRIDE_HZ, rel=0.05)


def test_the_speed_is_that_of_the_stretch_and_not_of_a_spurt_beside_it() -> None:
    times = np.arange(1200) / RATE_HZ
    positions = fourier.synthesise(walker(np.random.default_rng(0), individual=0.3), STRIDE_HZ, times)
    speed = np.where(times < 9.0, 1200.0, 1500.0)
    positions[..., 1] += np.cumsum(speed)[:, None] / RATE_HZ
    stretch = walking.steady_stretch(positions, whole(positions), RATE_HZ)
    assert stretch.stop < 1000
    assert stretch.speed_mm_s == pytest.approx(1200.0, rel=0.01)


@pytest.mark.parametrize("name", CLIPS)
@pytest.mark.parametrize("path", PATHS)
def test_the_treadmill_walker_comes_back(name: str, path: str) -> None:
    clip = overground(1, **CLIPS[name])
    stretch = walking.steady_stretch(clip.positions, whole(clip.positions), RATE_HZ)
    level = walking.treadmill_equivalent(
        clip.positions[stretch.start : stretch.stop], RATE_HZ, locomotion="overground", path=path
    )
    truth = clip.treadmill[stretch.start : stretch.stop] + np.array([0, 0, HIP_MM])
    wrong = level - truth
    wrong -= wrong.mean(axis=(0, 1))
    assert np.sqrt(np.mean(wrong**2)) < 4.0
    # The ends are worst: there a cubic takes some of the sway, and a mean over one cycle has only half of one.
    assert np.abs(wrong[50:-50]).max() < 30.0
    series = fourier.represent(walking.set_origin(level, origin="pelvis_mean"), RATE_HZ)
    assert series.frequency_hz == pytest.approx(STRIDE_HZ, rel=1e-3)
    assert series.residual_fraction < 0.01
    assert np.abs(series.coefficients - clip.coefficients).max() < 5.0
    assert np.sqrt(np.mean((series.coefficients - clip.coefficients) ** 2)) < 1.5


@pytest.mark.parametrize("path", PATHS)
def test_the_walk_ends_up_along_y_with_the_right_hip_at_plus_x(path: str) -> None:
    clip = overground(2, heading=2.5)
    stretch = walking.steady_stretch(clip.positions, whole(clip.positions), RATE_HZ)
    level = walking.treadmill_equivalent(
        clip.positions[stretch.start : stretch.stop], RATE_HZ, locomotion="overground", path=path
    )
    hips = (level[:, RIGHT_HIP] - level[:, LEFT_HIP]).mean(axis=0)
    assert hips[0] > 150.0
    assert abs(np.degrees(np.arctan2(hips[1], hips[0]))) < 3.0
    np.testing.assert_allclose(walking.facing(level).mean(axis=0), [0.0, 1.0], atol=0.06)


@given(seed=seeds, heading=st.floats(-3.1, 3.1), path=st.sampled_from(PATHS))
@settings(max_examples=8, deadline=None)
def test_the_direction_of_the_walk_does_not_matter(seed: int, heading: float, path: str) -> None:
    clip = overground(seed, walking_s=6.0)
    other = turned(clip.positions, heading) + np.array([5000.0, -3000.0, 0.0])
    levels = []
    for positions in (clip.positions, other):
        stretch = walking.steady_stretch(positions, whole(positions), RATE_HZ)
        levels.append(
            walking.treadmill_equivalent(
                positions[stretch.start : stretch.stop], RATE_HZ, locomotion=stretch.locomotion, path=path
            )
        )
    np.testing.assert_allclose(levels[1], levels[0], rtol=0, atol=1e-6)


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("facing_deg", [0.0, 90.0, -130.0])
def test_a_treadmill_is_known_and_its_walker_turned_to_face_along_y(path: str, facing_deg: float) -> None:
    coefficients = walker(np.random.default_rng(0), individual=0.3)
    t = np.arange(900) / RATE_HZ
    body = fourier.synthesise(coefficients, STRIDE_HZ, t)
    drift = np.stack([30 * np.sin(0.7 * t), 60 * np.sin(0.4 * t), 0 * t], axis=1)
    positions = turned(body, np.radians(facing_deg) - np.pi / 2) + drift[:, None] + [0, 0, HIP_MM]
    stretch = walking.steady_stretch(positions, whole(positions), RATE_HZ)
    assert (stretch.locomotion, stretch.start, stretch.stop) == ("treadmill", 0, 900)
    assert (stretch.speed_mm_s, stretch.turn_rad) == (0.0, 0.0)
    assert stretch.cycles == pytest.approx(8.1, rel=0.05)
    level = walking.treadmill_equivalent(positions, RATE_HZ, locomotion="treadmill", path=path)
    # The body is taken to face where its hips do, on average; this one's are not quite across.
    across = (body[:, RIGHT_HIP] - body[:, LEFT_HIP])[:, :2]
    mean = (across / np.linalg.norm(across, axis=1, keepdims=True)).mean(axis=0)
    skew = np.arctan2(mean[1], mean[0])
    assert abs(skew) < 0.3
    series = fourier.represent(walking.set_origin(level, origin="pelvis_mean"), RATE_HZ)
    expected = turned(coefficients, -skew)
    assert np.abs(series.coefficients - expected).max() < 8.0
    assert np.sqrt(np.mean((series.coefficients - expected) ** 2)) < 1.5


def test_the_kind_of_locomotion_may_be_given() -> None:
    clip = overground(0)
    stretch = walking.steady_stretch(clip.positions, whole(clip.positions), RATE_HZ, locomotion="overground")
    assert stretch == walking.steady_stretch(clip.positions, whole(clip.positions), RATE_HZ)


def test_frames_in_which_a_joint_is_hidden_end_the_stretch() -> None:
    clip = overground(0, walking_s=12.0)
    observed = whole(clip.positions)
    observed[500] = False
    positions = clip.positions.copy()
    positions[500] = np.nan
    stretch = walking.steady_stretch(positions, observed, RATE_HZ)
    assert observed[stretch.start : stretch.stop].all()
    assert stretch.start == 501  # the longer part, up to the hidden frame


@pytest.mark.parametrize("origin", ["pelvis_mean", "floor"])
def test_origins(origin: str) -> None:
    positions = overground(3).positions
    moved = walking.set_origin(positions, origin=origin)
    pelvis = moved[:, WALKER15.index("pelvis")].mean(axis=0)
    np.testing.assert_allclose(pelvis[:2], 0.0, atol=1e-8)
    np.testing.assert_allclose(np.diff(moved, axis=0), np.diff(positions, axis=0), atol=1e-9)
    if origin == "pelvis_mean":
        assert pelvis[2] == pytest.approx(0.0, abs=1e-8)
    else:
        ankles = moved[:, [WALKER15.index("left_ankle"), WALKER15.index("right_ankle")], 2]
        assert (ankles < 0).mean() == pytest.approx(0.02, abs=0.01)


# Refusals


def refused(clip: Clip, rejection: AbstractContextManager, **options: Any) -> None:
    with rejection:
        walking.steady_stretch(clip.positions, whole(clip.positions), RATE_HZ, **options)


def test_walking_backwards_is_refused() -> None:
    refused(overground(0, backwards=True), rejects("not_forwards"))


@pytest.mark.parametrize(
    ("locomotion", "code"),
    [("auto", "feet_hardly_pass"), ("treadmill", "feet_hardly_pass"), ("overground", "too_short")],
)
def test_standing_is_refused(locomotion: str, code: str) -> None:
    generator = np.random.default_rng(0)
    positions = walker(generator, individual=0.3)[0] + 0.5 * generator.standard_normal((600, 15, 3))
    still = Clip(positions, positions, whole(positions), positions)
    refused(still, rejects(code), locomotion=locomotion)


def test_somebody_who_is_carried_along_is_refused() -> None:
    refused(
        overground(0, excursion=0.0), rejects("feet_hardly_pass", distance_mm=pytest.approx(0.0, abs=0.5))
    )
    refused(overground(0, excursion=0.1), rejects("feet_hardly_pass"))


def test_too_short_a_walk_is_refused() -> None:
    refused(overground(0, walking_s=2.4), rejects("too_short"), cycles=1.5)
    clip = overground(0)
    refused(clip, rejects("too_short", cycles=pytest.approx(6.5, abs=0.5)), cycles=7.0)
    observed = np.zeros(len(clip.positions), dtype=bool)
    observed[100:130] = True
    with rejects("too_few_frames", frames=30):
        walking.steady_stretch(clip.positions, observed, RATE_HZ)
    with rejects("too_few_frames", frames=0):
        walking.steady_stretch(clip.positions, np.zeros(len(observed), dtype=bool), RATE_HZ)
    with rejects("rate_too_low", frame_rate_hz=0.02):
        walking.steady_stretch(clip.positions, np.ones(len(observed), dtype=bool), 0.02)


def test_a_circle_is_refused_when_turns_must_be_slow() -> None:
    clip = overground(0, veer=6.0)
    refused(clip, rejects("too_short"), turn_rad_s=np.radians(20.0), cycles=4.0)


def test_unknown_choices_are_refused() -> None:
    clip = overground(0)
    refused(clip, rejects("unknown_choice", "locomotion", value="indoors"), locomotion="indoors")
    with rejects("unknown_choice", "path", value="straight"):
        walking.treadmill_equivalent(clip.positions, RATE_HZ, locomotion="overground", path="straight")
    with rejects("unknown_choice", "origin", value="head"):
        walking.set_origin(clip.positions, origin="head")


@given(st.floats(-1.2, 1.2), st.integers(0, 2**16))
def test_the_heading_of_the_steps_turns_with_the_walker(angle: float, seed: int) -> None:
    """The estimated direction of the steps rotates with the walker."""
    rng = np.random.default_rng(seed)
    coefficients = rng.normal(0.0, 100.0, size=(5, 15, 3))
    left, right = WALKER15.index("left_ankle"), WALKER15.index("right_ankle")
    swing = np.array([0.0, 300.0, 20.0, 30.0, -10.0])
    coefficients[:, left, :2] = np.stack([0.0 * swing, swing], axis=-1)
    coefficients[:, right, :2] = -coefficients[:, left, :2]
    assert walking.step_heading(coefficients) == pytest.approx(0.0, abs=1e-12)
    turned = walking.turn_about_vertical(coefficients, angle)
    assert walking.step_heading(turned) == pytest.approx(angle, abs=1e-9)
    np.testing.assert_allclose(walking.turn_about_vertical(turned, -angle), coefficients, atol=1e-9)
