"""Phase as one more unknown of the fit, from known views [zhang2007 3.9, 3.15]."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import camera, errors, fourier, reconstruction, walking
from pipeline.core.linear_model import LinearModel, fit, flatten, leave_one_out, unflatten
from pipeline.core.reconstruction import from_known_view_unknown_phase
from pipeline.core.reconstruction.unknown_phase import lowest_phase
from pipeline.synthetic import walkers as synthetic
from pipeline.validation import InvalidInput
from tests.core.printed import printed_cost
from tests.core.watched import (
    RATE_HZ,
    VIEWS,
    Watched,
    found_in,
    inside,
    noises,
    played,
    seen,
    watched,
    wrapped,
)
from tests.strategies import Fold, folds, seeds, walkers

# phase


@given(
    seed=seeds, degree=st.integers(1, 8), style=st.sampled_from(["generic", "tied", "flat", "narrow", "tiny"])
)
@settings(max_examples=100, deadline=None)
def test_no_phase_of_a_fine_grid_is_lower_than_the_lowest(seed: int, degree: int, style: str) -> None:
    generator = np.random.default_rng(seed)
    series = generator.standard_normal((2, degree))
    if style == "tied":  # even harmonics alone have every minimum twice, half a cycle apart
        series[:, ::2] = 0.0
    elif style == "flat":
        series[:] = 0.0
    elif style == "narrow":  # minima as near to each other as the degree allows
        series[:, :-1] *= 1e-3
    elif style == "tiny":
        series *= 1e-12
    order = np.arange(1, degree + 1)

    def cost(phase: float) -> float:
        return float(series[0] @ np.cos(order * phase) + series[1] @ np.sin(order * phase))

    found = lowest_phase(cost, degree)
    everywhere = [cost(phase) for phase in np.linspace(-np.pi, np.pi, 2001)]
    assert -np.pi <= found <= np.pi
    assert cost(found) <= min(everywhere) + 1e-12 * np.abs(series).sum()


# a known view


@given(fold=folds(), noise=noises)
@settings(max_examples=25, deadline=None)
def test_no_phase_of_the_printed_problem_costs_less(fold: Fold, noise: float | None) -> None:
    for view in VIEWS[[0, 3]]:
        clip = watched(fold, view)
        found = found_in(fold.model, clip, noise)

        def printed(phase: float, clip: Watched = clip) -> float:
            return printed_cost(fold.model, clip.image, clip.frequency_hz, clip.view_rad, phase, noise)

        lowest, scale = printed(found.phase_rad), 1e-9 * float((clip.image**2).sum())
        assert all(lowest <= printed(phase) + scale for phase in np.linspace(-np.pi, np.pi, 37))


@given(fold=folds(), noise=noises)
@settings(max_examples=25, deadline=None)
def test_at_the_phase_found_the_reconstruction_is_that_of_a_known_phase(
    fold: Fold, noise: float | None
) -> None:
    for view in VIEWS:
        clip = watched(fold, view)
        found = found_in(fold.model, clip, noise)
        sample = fourier.shift(clip.coefficients, found.phase_rad).ravel()
        if fold.model.mean.size > 225:
            sample = np.append(sample, 2 * np.pi * clip.frequency_hz)
        known = reconstruction.from_known_views(fold.model, sample, np.array([view]), noise_variance=noise)
        turned = fourier.shift(found.missing[..., None], found.phase_rad)[..., 0]
        assert np.allclose(turned, known.missing[0], atol=1e-4)
        assert np.allclose(
            errors.absolute_error(clip.missing - found.missing),
            errors.absolute_error(known.delta[0]),
            rtol=1e-5,
            atol=1e-6,
        ), np.degrees(view)


@pytest.mark.parametrize("trailing", [0, 1])
def test_a_walker_whom_the_model_can_be_is_found_with_phase_and_frequency(trailing: int) -> None:
    generator = np.random.default_rng(11)
    people = walkers(generator, 20).reshape(20, -1)
    if trailing:
        people = np.column_stack([people, 2 * np.pi * generator.normal(0.9, 0.08, 20)])
    model = fit(people, 6)
    sample = inside(model, generator)
    frequency = sample[225] / (2 * np.pi) if trailing else 0.87
    for phase in (-3.0, -0.7, 0.0, 1.6, 3.1):
        for view in VIEWS:
            clip = seen(played(unflatten(sample), frequency, phase, 3.1), view)
            assert clip.frequency_hz == pytest.approx(frequency, abs=1e-7)
            found = found_in(model, clip, None)
            assert np.abs(wrapped(found.phase_rad - phase)) < 1e-5
            known = reconstruction.from_known_views(model, sample, np.array([view]), noise_variance=None)
            assert np.allclose(found.coefficients, known.coefficients[0], atol=1e-2)
            assert np.allclose(found.missing, clip.missing, atol=1e-2)
            assert np.abs(known.delta).max() < 1e-6


@pytest.mark.parametrize("view", VIEWS)
def test_where_the_clip_starts_moves_the_phase_and_nothing_else(view: float) -> None:
    generator = np.random.default_rng(2)
    people = walkers(generator, 15)
    model = fit(people[1:].reshape(14, -1), 8)
    motion = played(people[0], 0.9, 0.5, 6.0)
    results = []
    for first in (0, 37, 111):
        clip = seen(motion[first : first + 400], view)
        found = found_in(model, clip, 70.0)
        error = errors.absolute_error(clip.missing - found.missing)
        results.append((found.phase_rad - 2 * np.pi * 0.9 * first / RATE_HZ, found.coefficients, error))
    for phase, k, error in results[1:]:
        assert np.abs(wrapped(phase - results[0][0])) < 1e-5
        assert np.allclose(k, results[0][1], rtol=1e-4, atol=1e-2)
        assert np.allclose(error, results[0][2], rtol=1e-4)


def test_noisy_clips_that_are_not_whole_cycles_give_frequency_and_phase() -> None:
    generator = np.random.default_rng(8)
    model = fit(walkers(generator, 40).reshape(40, -1), 10)
    for phase in generator.uniform(-np.pi, np.pi, 10):
        motion = played(unflatten(inside(model, generator)), 0.94, phase, generator.uniform(1.7, 4.0))
        motion += 10.0 * generator.standard_normal(motion.shape)
        for view in VIEWS:
            clip = seen(motion, view)
            assert abs(clip.frequency_hz - 0.94) < 0.01
            for noise in (None, 70.0):
                found = found_in(model, clip, noise)
                assert np.degrees(np.abs(wrapped(found.phase_rad - phase))) < 5.0


def test_walkers_whom_the_model_has_not_seen_give_frequency_and_phase() -> None:
    people = synthetic.walking_population(np.random.default_rng(2007), male=12, female=18, duration_s=3.3)
    clips = [
        walking.treadmill_equivalent(p, people.frame_rate_hz, locomotion="treadmill")
        for p in people.positions_mm
    ]
    series = [fourier.represent(clip, people.frame_rate_hz) for clip in clips]
    samples = flatten(np.stack([s.coefficients for s in series]))
    off = []
    for model, r in leave_one_out(samples, 15):
        middle = np.pi * (len(clips[r]) - 1) / people.frame_rate_hz
        for view in VIEWS:
            clip = seen(clips[r], view, rate_hz=people.frame_rate_hz)
            assert abs(clip.frequency_hz / series[r].frequency_hz - 1) < 0.04
            ours = found_in(model, clip, 70.0).phase_rad + clip.frequency_hz * middle
            off.append(np.degrees(wrapped(ours - series[r].phase_rad - series[r].frequency_hz * middle)))
    assert np.median(np.abs(off)) < 1.5
    assert np.abs(off).max() < 12.0


def test_an_eigenwalker_that_the_view_does_not_show_stays_at_zero() -> None:
    generator = np.random.default_rng(4)
    average = walkers(generator, 1)[0]
    components = np.zeros((2, 5, 15, 3))
    components[0, ..., 0] = generator.standard_normal((5, 15))  # across the walk alone
    components[1, ..., 2] = generator.standard_normal((5, 15))
    components /= np.linalg.norm(components.reshape(2, -1), axis=1)[:, None, None, None]
    model = LinearModel(average.ravel(), components.reshape(2, -1), np.array([900.0, 400.0]), 1300.0)
    person = average + 40.0 * components[0] - 25.0 * components[1]
    found = found_in(model, seen(played(person, 0.9, 0.2, 3.0), np.pi / 2), None)
    assert found.coefficients == pytest.approx([0.0, -25.0], abs=1e-3)
    assert found.phase_rad == pytest.approx(0.2, abs=1e-6)


@pytest.mark.parametrize(
    ("words", "arguments"),
    [
        ("the walker", {"image": np.zeros((5, 14, 2))}),
        ("the walker must be finite", {"image": np.full((5, 15, 2), np.nan)}),
        ("the walker must be finite", {"frequency_hz": np.nan}),
        ("noise variance", {"noise_variance": 0.0}),
        ("noise variance", {"noise_variance": np.nan}),
    ],
)
def test_observations_that_do_not_fit_the_model_are_refused(words: str, arguments: dict[str, Any]) -> None:
    people = walkers(np.random.default_rng(0), 6).reshape(6, -1)
    model = fit(np.column_stack([people, np.linspace(5, 6, 6)]), 3)
    given_ = {"image": np.zeros((5, 15, 2)), "noise_variance": None, "frequency_hz": 1.0} | arguments
    with pytest.raises(InvalidInput, match=words):
        from_known_view_unknown_phase(model, view_angle_rad=0.0, **given_)  # type: ignore[arg-type]


# the frequency that a view gives


@given(seed=seeds, harmonics=st.integers(1, 3), view=st.floats(-np.pi, np.pi))
@settings(max_examples=25, deadline=None)
def test_no_other_frequency_nearby_explains_more_of_the_view(seed: int, harmonics: int, view: float) -> None:
    generator = np.random.default_rng(seed)
    motion = played(walkers(generator, 1)[0], generator.uniform(0.6, 1.2), 0.3, 4.1)
    motion += 5.0 * generator.standard_normal(motion.shape)
    found = seen(motion, view, harmonics=harmonics).frequency_hz
    lowest = left_over(motion, view, found, harmonics)
    assert all(
        lowest <= left_over(motion, view, found + step, harmonics) + 1e-9 * lowest
        for step in np.linspace(-0.02, 0.02, 41)
    )


def test_a_slow_drift_does_not_pass_for_half_the_frequency() -> None:
    motion = played(walkers(np.random.default_rng(0), 1)[0], 1.0, 0.4, 2.2)
    times = np.arange(len(motion)) / RATE_HZ
    motion[..., 0] += 60.0 * np.sin(2 * np.pi * 0.5 * times)[:, None]  # veering, seen from in front
    assert left_over(motion, 0.0, 0.5, 2) < left_over(motion, 0.0, 1.0, 2)  # all joints would choose it
    assert seen(motion, 0.0).frequency_hz == pytest.approx(1.0, abs=0.05)


def left_over(motion: np.ndarray, view: float, hertz: float, harmonics: int) -> float:
    image = camera.project(motion, view).reshape(len(motion), -1)
    matrix = fourier.design(hertz, np.arange(len(motion)) / RATE_HZ, harmonics)
    return float(((image - matrix @ np.linalg.lstsq(matrix, image, rcond=None)[0]) ** 2).sum())
