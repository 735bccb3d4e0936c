"""Phase as one more unknown of the fit, from known views [zhang2007 3.9, 3.15]."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import errors, fourier, observation, reconstruction, walking
from pipeline.core.linear_model import LinearModel, fit, flatten, leave_one_out, unflatten
from pipeline.core.reconstruction import (
    from_known_views_unknown_phase,
    lowest_phase,
)
from pipeline.core.reconstruction.unknown_phase import turned as turned_rows
from pipeline.core.reconstruction.unknown_phase import turning
from pipeline.synthetic import walkers as synthetic
from pipeline.validation import InvalidInput
from tests.core.printed import printed_cost
from tests.core.watched import RATE_HZ, VIEWS, inside, noises, played, watched, wrapped
from tests.strategies import Fold, folds, seeds, walkers

# phase


@given(seed=seeds, harmonics=st.integers(1, 4))
@settings(max_examples=30, deadline=None)
def test_turning_is_the_shift_of_a_representation(seed: int, harmonics: int) -> None:
    generator = np.random.default_rng(seed)
    series = generator.standard_normal((3, 1 + 2 * harmonics, 4))
    phase = generator.uniform(-7, 7, 3)
    f = turning(phase, harmonics)
    flat = (f[:, None] @ turned_rows(series))[:, 0]
    assert np.allclose(flat, fourier.shift(series[..., None], phase)[..., 0].reshape(3, -1), atol=1e-12)


@given(
    seed=seeds,
    harmonics=st.integers(1, 4),
    style=st.sampled_from(["generic", "tied", "flat", "narrow", "tiny"]),
)
@settings(max_examples=100, deadline=None)
def test_no_phase_of_a_fine_grid_is_lower_than_the_lowest(seed: int, harmonics: int, style: str) -> None:
    generator = np.random.default_rng(seed)
    size = 1 + 2 * harmonics
    forms = generator.standard_normal((6, size, size))
    forms = forms + np.swapaxes(forms, 1, 2)  # neither definite nor small: only a trigonometric polynomial
    if style == "tied":  # products of even harmonics alone have every minimum twice, half a cycle apart
        even = np.isin((np.arange(size) + 1) // 2 % 2, [0])
        forms = np.where(np.equal.outer(even, even), forms, 0.0)
    elif style == "flat":
        forms = np.zeros_like(forms)
        forms[:, 0, 0] = 7.0
    elif style == "narrow":  # two minima as near to each other as the degree allows
        forms[:, :-2] *= 1e-3
        forms[:, :, :-2] *= 1e-3
    elif style == "tiny":
        forms *= 1e-12
    found = lowest_phase(forms)
    phase, cost = found.phase_rad, found.cost
    assert phase.shape == cost.shape == (6,)
    assert ((phase > -np.pi) & (phase <= np.pi)).all()
    f = turning(np.linspace(-np.pi, np.pi, 5001), harmonics)
    everywhere = np.einsum("gb,nbc,gc->ng", f, forms, f)
    scale = np.abs(forms).max() * size
    assert (cost <= everywhere.min(axis=1) + 1e-12 * scale).all()
    at = turning(phase, harmonics)
    assert np.allclose(np.einsum("nb,nbc,nc->n", at, forms, at), cost, atol=1e-12 * scale, rtol=0)


# a known view


@given(fold=folds(), noise=noises)
@settings(max_examples=25, deadline=None)
def test_no_phase_of_the_printed_problem_costs_less(fold: Fold, noise: float | None) -> None:
    clip = watched(fold)
    found = from_known_views_unknown_phase(
        fold.model, clip.image, VIEWS, noise_variance=noise, frequency_hz=clip.frequency_hz
    )
    for a in (0, 3):

        def printed(phase: float, a: int = a) -> float:
            return printed_cost(fold.model, clip.image[a], clip.frequency_hz[a], VIEWS[a], phase, noise)

        scale = 1e-9 * float((clip.image[a] ** 2).sum())
        assert found.cost[a] == pytest.approx(printed(found.phase_rad[a]), rel=1e-6, abs=scale)
        assert all(found.cost[a] <= printed(phase) + scale for phase in np.linspace(-np.pi, np.pi, 37))


@given(fold=folds(), noise=noises)
@settings(max_examples=25, deadline=None)
def test_at_the_phase_found_the_reconstruction_is_that_of_a_known_phase(
    fold: Fold, noise: float | None
) -> None:
    clip = watched(fold)
    found = from_known_views_unknown_phase(
        fold.model, clip.image, VIEWS, noise_variance=noise, frequency_hz=clip.frequency_hz
    )
    for a, view in enumerate(VIEWS):
        sample = fourier.shift(clip.coefficients[a], found.phase_rad[a]).ravel()
        if fold.model.mean.size > 225:
            sample = np.append(sample, 2 * np.pi * clip.frequency_hz[a])
        known = reconstruction.from_known_views(fold.model, sample, VIEWS[a : a + 1], noise_variance=noise)
        turned = fourier.shift(found.missing[a][..., None], found.phase_rad[a])[..., 0]
        assert np.allclose(turned, known.missing[0], atol=1e-4)
        assert np.allclose(
            errors.absolute_error(clip.missing[a] - found.missing[a]),
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
        clip = observation.observe(played(unflatten(sample), frequency, phase, 3.1), RATE_HZ, VIEWS)
        found = from_known_views_unknown_phase(
            model, clip.image, VIEWS, noise_variance=None, frequency_hz=clip.frequency_hz
        )
        assert np.abs(wrapped(found.phase_rad - phase)).max() < 1e-5
        known = reconstruction.from_known_views(model, sample, VIEWS, noise_variance=None)
        assert np.allclose(found.coefficients, known.coefficients, atol=1e-2)
        assert np.allclose(found.missing, clip.missing, atol=1e-2)
        assert np.abs(known.delta).max() < 1e-6


def test_where_the_clip_starts_moves_the_phase_and_nothing_else() -> None:
    generator = np.random.default_rng(2)
    people = walkers(generator, 15)
    model = fit(people[1:].reshape(14, -1), 8)
    motion = played(people[0], 0.9, 0.5, 6.0)
    results = []
    for first in (0, 37, 111):
        clip = observation.observe(motion[first : first + 400], RATE_HZ, VIEWS)
        found = from_known_views_unknown_phase(model, clip.image, VIEWS, noise_variance=70.0)
        error = errors.absolute_error(clip.missing - found.missing)
        results.append((found.phase_rad - 2 * np.pi * 0.9 * first / RATE_HZ, found.coefficients, error))
    for phase, k, error in results[1:]:
        assert np.abs(wrapped(phase - results[0][0])).max() < 1e-6
        assert np.allclose(k, results[0][1], rtol=1e-5, atol=1e-3)
        assert np.allclose(error, results[0][2], rtol=1e-5)


def test_noisy_clips_that_are_not_whole_cycles_give_frequency_and_phase() -> None:
    generator = np.random.default_rng(8)
    model = fit(walkers(generator, 40).reshape(40, -1), 10)
    for phase in generator.uniform(-np.pi, np.pi, 10):
        motion = played(unflatten(inside(model, generator)), 0.94, phase, generator.uniform(1.7, 4.0))
        motion += 10.0 * generator.standard_normal(motion.shape)
        clip = observation.observe(motion, RATE_HZ, VIEWS)
        assert np.abs(clip.frequency_hz - 0.94).max() < 0.01
        for noise in (None, 70.0):
            found = from_known_views_unknown_phase(model, clip.image, VIEWS, noise_variance=noise)
            assert np.degrees(np.abs(wrapped(found.phase_rad - phase))).max() < 5.0


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
        clip = observation.observe(clips[r], people.frame_rate_hz, VIEWS)
        assert np.abs(clip.frequency_hz / series[r].frequency_hz - 1).max() < 0.04
        found = from_known_views_unknown_phase(model, clip.image, VIEWS, noise_variance=70.0)
        middle = np.pi * (len(clips[r]) - 1) / people.frame_rate_hz
        ours = found.phase_rad + clip.frequency_hz * middle
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
    profile = np.array([np.pi / 2])
    clip = observation.observe(played(person, 0.9, 0.2, 3.0), RATE_HZ, profile)
    found = from_known_views_unknown_phase(model, clip.image, profile, noise_variance=None)
    assert found.coefficients[0] == pytest.approx([0.0, -25.0], abs=1e-3)
    assert found.phase_rad[0] == pytest.approx(0.2, abs=1e-6)


@pytest.mark.parametrize(
    ("words", "arguments"),
    [
        ("another size than the model", {"image": np.zeros((2, 5, 14, 2))}),
        ("another size than the model", {"image": np.zeros((5, 15, 2))}),
        ("does not give it", {"frequency_hz": None}),
        ("does not give it", {"frequency_hz": np.ones(3)}),
        ("the observation must be finite", {"image": np.full((2, 5, 15, 2), np.nan)}),
        ("the observation must be finite", {"frequency_hz": np.array([1.0, np.nan])}),
        ("noise variance", {"noise_variance": 0.0}),
        ("noise variance", {"noise_variance": np.nan}),
    ],
)
def test_observations_that_do_not_fit_the_model_are_refused(words: str, arguments: dict[str, Any]) -> None:
    people = walkers(np.random.default_rng(0), 6).reshape(6, -1)
    model = fit(np.column_stack([people, np.linspace(5, 6, 6)]), 3)
    given_ = {
        "image": np.zeros((2, 5, 15, 2)),
        "noise_variance": None,
        "frequency_hz": np.ones(2),
    } | arguments
    image = given_.pop("image")
    with pytest.raises(InvalidInput, match=words):
        from_known_views_unknown_phase(model, image, np.zeros(2), **given_)
