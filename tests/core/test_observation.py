"""What one view shows of a clip, and its frequency [zhang2007 3.1]."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import camera, fourier, observation
from pipeline.core.fourier import frequency
from pipeline.validation import InvalidInput
from tests.core.watched import RATE_HZ, VIEWS, played
from tests.strategies import seeds, walkers


@pytest.mark.parametrize("frequency", [0.52, 0.93, 1.37])
@pytest.mark.parametrize("seconds", [2.3, 5.17])
def test_one_view_gives_the_frequency_and_the_series_of_a_clean_walk(
    frequency: float, seconds: float
) -> None:
    w = walkers(np.random.default_rng(3), 1)[0]
    clip = observation.observe(played(w, frequency, 0.8, seconds), RATE_HZ, VIEWS)
    assert np.abs(clip.frequency_hz - frequency).max() < 1e-8
    assert np.abs(clip.coefficients - fourier.shift(w, -0.8)).max() < 1e-4
    assert np.allclose(clip.image[2], camera.project(clip.coefficients[2], VIEWS[2]))
    again = camera.combine(clip.image[3], clip.missing[3], VIEWS[3])
    assert np.allclose(again, clip.coefficients[3])


@given(seed=seeds, harmonics=st.integers(1, 3), view=st.floats(-np.pi, np.pi))
@settings(max_examples=25, deadline=None)
def test_no_other_frequency_nearby_explains_more_of_the_view(seed: int, harmonics: int, view: float) -> None:
    generator = np.random.default_rng(seed)
    motion = played(walkers(generator, 1)[0], generator.uniform(0.6, 1.2), 0.3, 4.1)
    motion += 5.0 * generator.standard_normal(motion.shape)
    clip = observation.observe(motion, RATE_HZ, np.array([view]), harmonics=harmonics)
    image = camera.project(motion, view).reshape(len(motion), -1)
    times = np.arange(len(motion)) / RATE_HZ

    def left_over(hertz: float) -> float:
        matrix = frequency.design(hertz, times, harmonics)
        return float(((image - matrix @ np.linalg.lstsq(matrix, image, rcond=None)[0]) ** 2).sum())

    found = float(clip.frequency_hz[0])
    lowest = left_over(found)
    assert all(lowest <= left_over(found + step) + 1e-9 * lowest for step in np.linspace(-0.02, 0.02, 41))
    # The slope is zero: a step either way costs the same.
    up, down = left_over(found + 1e-4) - lowest, left_over(found - 1e-4) - lowest
    assert abs(up - down) < 1e-3 * (up + down)


def test_a_slow_drift_does_not_pass_for_half_the_frequency() -> None:
    w = walkers(np.random.default_rng(0), 1)[0]
    motion = played(w, 1.0, 0.4, 2.2)
    times = np.arange(len(motion)) / RATE_HZ
    motion[..., 0] += 60.0 * np.sin(2 * np.pi * 0.5 * times)[:, None]  # veering, seen from in front
    image = camera.project(motion, 0.0).reshape(len(motion), -1)

    def left_over(hertz: float) -> float:
        matrix = frequency.design(hertz, times, 2)
        return float(((image - matrix @ np.linalg.lstsq(matrix, image, rcond=None)[0]) ** 2).sum())

    assert left_over(0.5) < left_over(1.0)  # all joints together would choose it
    assert observation.observe(motion, RATE_HZ, np.zeros(1)).frequency_hz[0] == pytest.approx(1.0, abs=0.05)


@given(seed=seeds, view=st.floats(-np.pi, np.pi))
@settings(max_examples=20, deadline=None)
def test_what_the_view_does_not_show_changes_nothing(seed: int, view: float) -> None:
    generator = np.random.default_rng(seed)
    motion = played(walkers(generator, 1)[0], 0.9, 1.0, 3.3)
    away = np.array([-np.sin(view), np.cos(view), 0.0])
    other = motion + generator.normal(0, 300.0, (*motion.shape[:2], 1)) * away
    one, two = (observation.observe(m, RATE_HZ, np.array([view])) for m in (motion, other))
    assert np.abs(one.frequency_hz - two.frequency_hz).max() < 1e-9
    assert np.abs(one.image - two.image).max() < 1e-5
    assert np.abs(one.missing - two.missing).max() > 1.0


# refusals


def changed(positions: np.ndarray, frame: int, value: float) -> np.ndarray:
    copy = positions.copy()
    copy[frame, 3, 1] = value
    return copy


@pytest.mark.parametrize(
    ("words", "arguments"),
    [
        ("no list of finite view angles", {"view": np.array([0.0, np.nan])}),
        ("no list of finite view angles", {"view": np.empty(0)}),
        ("positions must have shape", {"cut": (slice(None), 0)}),
        ("harmonics must be a whole number at least 1", {"harmonics": 0}),
        ("frame rate is too low for 2 harmonics", {"rate": 6.0}),
        ("frame rate is too low", {"rate": np.inf}),
        ("too short for a walking cycle", {"cut": slice(0, 62)}),
        ("not finite at frame 7, joint 3", {"spoilt": np.inf}),
        ("left and right do not move apart", {"cut": np.zeros(200, dtype=int)}),
    ],
)
def test_clips_that_cannot_be_observed_are_refused(words: str, arguments: dict[str, Any]) -> None:
    motion = played(walkers(np.random.default_rng(0), 1)[0], 0.9, 0.0, 3.0)
    if "spoilt" in arguments:
        motion = changed(motion, 7, arguments["spoilt"])
    with pytest.raises(InvalidInput, match=words):
        observation.observe(
            motion[arguments.get("cut", slice(None))],
            arguments.get("rate", RATE_HZ),
            arguments.get("view", VIEWS),
            harmonics=arguments.get("harmonics", 2),
        )
