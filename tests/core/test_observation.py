"""Frequency from one view alone, phase as one more unknown of the fit [zhang2007 3.1, 3.9, 3.15, 4.5, 4.6]."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import (
    camera,
    errors,
    fourier,
    observation,
    reconstruction,
    synthetic,
    viewpoint,
    walking,
)
from pipeline.core.linear_model import LinearModel, fit, flatten, leave_one_out, unflatten
from pipeline.refusal import Refusal
from pipeline.skeleton import WALKER15
from tests.strategies import Fold, folds, seeds, walkers

RATE_HZ = 100.0
VIEWS = np.radians([-90.0, -50.0, 0.0, 30.0, 90.0])
noises = st.sampled_from([None, 1.0, 70.0, 1e4])


def wrapped(angle: np.ndarray) -> np.ndarray:
    return np.mod(angle + np.pi, 2 * np.pi) - np.pi


def played(
    w: np.ndarray, frequency_hz: float, phase_rad: float, seconds: float, *, rate_hz: float = RATE_HZ
) -> np.ndarray:
    """Positions (T, J, 3) of a walker whose phase at the first frame is given."""
    times = np.arange(round(seconds * rate_hz)) / rate_hz
    return fourier.synthesise(fourier.shift(w, -phase_rad), frequency_hz, times)


def watched(fold: Fold, frequency_hz: float = 0.93) -> observation.ViewedClip:
    """A walker whom the model has not seen, at a drawn phase, 2.7 cycles with 3 mm of noise."""
    motion = played(unflatten(fold.sample), frequency_hz, fold.generator.uniform(-np.pi, np.pi), 2.9)
    return observation.observe(motion + 3.0 * fold.generator.standard_normal(motion.shape), RATE_HZ, VIEWS)


def inside(model: LinearModel, generator: np.random.Generator) -> np.ndarray:
    """A sample within the span of the model; a trailing frequency is in rad/s, as samples have it."""
    k = np.sqrt(model.eigenvalues) * generator.standard_normal(len(model.eigenvalues))
    sample = model.mean + k @ model.components
    sample[225:] /= model.last_scale
    return sample


def printed_cost(
    model: LinearModel, image: np.ndarray, frequency_hz: float, view: float, phase: float, noise: float | None
) -> float:
    """[zhang2007 4.5] squared, or [zhang2007 4.6] times 2 sigma², of the observation shifted by a phase."""
    trailing = model.mean.size - 225
    C = camera.projection_matrix(view, trailing=trailing)
    w_hat = fourier.shift(image, phase).ravel()
    if trailing:
        w_hat = np.append(w_hat, model.last_scale * 2 * np.pi * frequency_hz)
    d, E = w_hat - C @ model.mean, C @ model.components.T
    kept = model.eigenvalues > 1e-20 * model.eigenvalues.max()
    E, eigenvalues = E[:, kept], model.eigenvalues[kept]
    if noise is None:
        return float(((d - E @ reconstruction.least_squares(E, d)) ** 2).sum())
    k = reconstruction.maximum_a_posteriori(E, d, eigenvalues, noise_variance=noise)
    return float(((d - E @ k) ** 2).sum() + noise * (k**2 / eigenvalues).sum())


# frequency


@pytest.mark.parametrize("frequency", [0.52, 0.93, 1.37])
@pytest.mark.parametrize("seconds", [2.3, 5.17])
def test_one_view_gives_the_frequency_and_the_series_of_a_clean_walk(
    frequency: float, seconds: float
) -> None:
    w = walkers(np.random.default_rng(3), 1)[0]
    clip = observation.observe(played(w, frequency, 0.8, seconds), RATE_HZ, VIEWS)
    assert np.abs(clip.frequency_hz - frequency).max() < 1e-8
    assert np.abs(clip.coefficients - fourier.shift(w, -0.8)).max() < 1e-4
    assert np.abs(clip.residual_covariance).max() < 1e-6
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

    def left_over(frequency: float) -> float:
        matrix = fourier.design(frequency, times, harmonics)
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

    def left_over(frequency: float) -> float:
        matrix = fourier.design(frequency, times, 2)
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


def test_the_residual_is_the_power_that_the_series_leaves_in_the_missing_dimension() -> None:
    generator = np.random.default_rng(5)
    motion = played(walkers(generator, 1)[0], 0.8, 0.0, 4.0)
    motion += 8.0 * generator.standard_normal(motion.shape)
    clip = observation.observe(motion, RATE_HZ, VIEWS)
    times = np.arange(len(motion)) / RATE_HZ
    for a, view in enumerate(VIEWS):
        series = fourier.synthesise(clip.coefficients[a], float(clip.frequency_hz[a]), times)
        left = camera.missing_dimension(motion - series, view)
        assert np.allclose(clip.residual_power[a], (left**2).mean(axis=0), rtol=1e-8)


# phase


@given(seed=seeds, harmonics=st.integers(1, 4))
@settings(max_examples=30, deadline=None)
def test_turning_is_the_shift_of_a_representation(seed: int, harmonics: int) -> None:
    generator = np.random.default_rng(seed)
    series = generator.standard_normal((3, 1 + 2 * harmonics, 4))
    phase = generator.uniform(-7, 7, 3)
    f = observation.turning(phase, harmonics)
    flat = (f[:, None] @ observation.turned(series))[:, 0]
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
    phase, cost = observation.lowest_phase(forms)
    assert phase.shape == cost.shape == (6,)
    assert ((phase > -np.pi) & (phase <= np.pi)).all()
    f = observation.turning(np.linspace(-np.pi, np.pi, 5001), harmonics)
    everywhere = np.einsum("gb,nbc,gc->ng", f, forms, f)
    scale = np.abs(forms).max() * size
    assert (cost <= everywhere.min(axis=1) + 1e-12 * scale).all()
    at = observation.turning(phase, harmonics)
    assert np.allclose(np.einsum("nb,nbc,nc->n", at, forms, at), cost, atol=1e-12 * scale, rtol=0)


# a known view


@given(fold=folds(), noise=noises)
@settings(max_examples=25, deadline=None)
def test_no_phase_of_the_printed_problem_costs_less(fold: Fold, noise: float | None) -> None:
    clip = watched(fold)
    found = observation.from_known_views(
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
    found = observation.from_known_views(
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
        found = observation.from_known_views(
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
        found = observation.from_known_views(model, clip.image, VIEWS, noise_variance=70.0)
        path = observation.error_path(model, clip, np.array([1.0, 70.0]))
        error = errors.absolute_error(clip.missing - found.missing)
        results.append((found.phase_rad - 2 * np.pi * 0.9 * first / RATE_HZ, found.coefficients, error, path))
    for phase, k, error, path in results[1:]:
        assert np.abs(wrapped(phase - results[0][0])).max() < 1e-6
        assert np.allclose(k, results[0][1], rtol=1e-5, atol=1e-3)
        assert np.allclose(error, results[0][2], rtol=1e-5)
        assert np.allclose(path, results[0][3], rtol=1e-5)


def test_noisy_clips_that_are_not_whole_cycles_give_frequency_and_phase() -> None:
    generator = np.random.default_rng(8)
    model = fit(walkers(generator, 40).reshape(40, -1), 10)
    for phase in generator.uniform(-np.pi, np.pi, 10):
        motion = played(unflatten(inside(model, generator)), 0.94, phase, generator.uniform(1.7, 4.0))
        motion += 10.0 * generator.standard_normal(motion.shape)
        clip = observation.observe(motion, RATE_HZ, VIEWS)
        assert np.abs(clip.frequency_hz - 0.94).max() < 0.01
        for noise in (None, 70.0):
            found = observation.from_known_views(model, clip.image, VIEWS, noise_variance=noise)
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
        found = observation.from_known_views(model, clip.image, VIEWS, noise_variance=70.0)
        middle = np.pi * (len(clips[r]) - 1) / people.frame_rate_hz
        ours = found.phase_rad + clip.frequency_hz * middle
        off.append(np.degrees(wrapped(ours - series[r].phase_rad - series[r].frequency_hz * middle)))
    assert np.median(np.abs(off)) < 1.5
    assert np.abs(off).max() < 12.0


@given(fold=folds())
@settings(max_examples=15, deadline=None)
def test_the_path_holds_the_error_of_each_noise_variance_at_its_own_phase(fold: Fold) -> None:
    clip, sigma2 = watched(fold), np.array([1.0, 9.0, 70.0, 625.0])
    path = observation.error_path(fold.model, clip, sigma2)
    assert path.shape == (len(VIEWS), len(sigma2))
    for s, noise in enumerate(sigma2):
        found = observation.from_known_views(
            fold.model, clip.image, VIEWS, noise_variance=float(noise), frequency_hz=clip.frequency_hz
        )
        naive = errors.walker_error(errors.absolute_error(clip.missing - found.missing))
        assert np.allclose(path[:, s], naive, rtol=1e-6, atol=1e-5)


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
    found = observation.from_known_views(model, clip.image, profile, noise_variance=None)
    assert found.coefficients[0] == pytest.approx([0.0, -25.0], abs=1e-3)
    assert found.phase_rad[0] == pytest.approx(0.2, abs=1e-6)


# an unknown view


@pytest.mark.parametrize("noise", [None, 1e-4])
@pytest.mark.parametrize("trailing", [0, 1])
def test_view_and_phase_of_a_walker_whom_the_model_can_be_are_found(
    noise: float | None, trailing: int
) -> None:
    generator = np.random.default_rng(21)
    people = walkers(generator, 20).reshape(20, -1)
    if trailing:
        people = np.column_stack([people, 2 * np.pi * generator.normal(0.9, 0.08, 20)])
    model = fit(people, 6)
    sample = inside(model, generator)
    frequency = sample[225] / (2 * np.pi) if trailing else 1.02
    view = np.radians([-179.0, -91.0, -13.7, 0.0, 44.0, 90.0, 180.0])
    clip = observation.observe(played(unflatten(sample), frequency, 2.2, 2.9), RATE_HZ, view)
    found = observation.estimate(model, clip.image, noise_variance=noise, frequency_hz=clip.frequency_hz)
    assert found.converged.all()
    assert np.abs(wrapped(found.angle_rad - view)).max() < 1e-4
    assert np.abs(wrapped(found.phase_rad - 2.2)).max() < 1e-4
    assert ((found.angle_rad > -np.pi) & (found.angle_rad <= np.pi)).all()
    known = reconstruction.from_known_views(model, sample, view, noise_variance=noise)
    assert np.allclose(found.coefficients, known.coefficients, atol=0.1)


@given(fold=folds(), noise=noises)
@settings(max_examples=10, deadline=None)
def test_no_view_and_phase_of_the_printed_problem_cost_less(fold: Fold, noise: float | None) -> None:
    clip = watched(fold)
    image, frequency = clip.image[1:2], clip.frequency_hz[1:2]
    found = observation.estimate(fold.model, image, noise_variance=noise, frequency_hz=frequency)

    def printed(view: float, phase: float) -> float:
        return printed_cost(fold.model, image[0], frequency[0], view, phase, noise)

    scale = 1e-8 * float((image**2).sum())
    here = printed(found.angle_rad[0], found.phase_rad[0])
    assert found.cost[0] == pytest.approx(here, rel=1e-6, abs=scale)
    assert found.runner_up_cost[0] >= found.cost[0]
    for view in np.linspace(-np.pi, np.pi, 16, endpoint=False):
        for phase in np.linspace(-np.pi, np.pi, 8, endpoint=False):
            assert found.cost[0] <= printed(view, phase) + scale
    for view, phase in ((1e-3, 0.0), (-1e-3, 0.0), (0.0, 1e-3), (0.0, -1e-3), (1e-3, 1e-3), (-1e-3, 1e-3)):
        assert here <= printed(found.angle_rad[0] + view, found.phase_rad[0] + phase) + scale


@given(fold=folds(styles=("generic",)), noise=noises, angle=st.floats(-np.pi, np.pi))
@settings(max_examples=20, deadline=None)
def test_the_slope_of_the_reduced_cost_is_that_of_finite_differences(
    fold: Fold, noise: float | None, angle: float
) -> None:
    clip = watched(fold)
    white = observation.whiten(fold.model, prior=noise is not None)
    rows = observation._Turned(fold.model, white, clip.image, clip.frequency_hz)
    which = np.arange(len(VIEWS))

    def profile(beta: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        cost, _, slope, phase, _ = observation._profile(
            rows, which, np.full(len(VIEWS), beta), noise or 0.0, bend=False
        )
        return cost, slope, phase

    _, slope, phase = profile(angle)
    off, smooth = [], np.ones(len(VIEWS), dtype=bool)
    for step in (1e-3, 1e-4):
        (above, _, phase_above), (below, _, phase_below) = profile(angle + step), profile(angle - step)
        off.append(np.abs((above - below) / (2 * step) - slope))
        # Where the lowest phase jumps from one valley to another the cost has a kink, and no slope.
        smooth &= np.maximum(np.abs(wrapped(phase_above - phase)), np.abs(wrapped(phase_below - phase))) < 0.1
    rounding = 1e-13 * float((clip.image**2).sum()) / 1e-4
    assert (
        off[1][smooth] <= 0.05 * off[0][smooth] + rounding
    ).all()  # a tenth of the step, a hundredth of the error
    assert (off[1][smooth] <= 1e-4 * np.abs(slope).max() + rounding).all()


def test_with_the_phase_known_the_view_is_that_of_the_papers_way() -> None:
    generator = np.random.default_rng(31)
    people = walkers(generator, 25)
    model = fit(people[1:].reshape(24, -1), 10)
    clip = observation.observe(played(people[0], 0.9, 1.1, 4.0), RATE_HZ, VIEWS)
    for noise, method in ((None, "least_squares"), (70.0, "map")):
        found = observation.estimate(model, clip.image, noise_variance=noise)
        turned = np.stack([fourier.shift(o, p) for o, p in zip(clip.image, found.phase_rad, strict=True)])
        known = viewpoint.estimate(model, turned, method=method, noise_variance=noise)
        assert np.allclose(found.angle_rad, known.angle_rad, rtol=0, atol=1e-8)
        assert np.allclose(found.cost, known.cost, rtol=1e-7)


def test_of_two_minima_the_lower_is_taken_though_the_grid_is_coarse() -> None:
    generator = np.random.default_rng(6)
    model = fit(walkers(generator, 12).reshape(12, -1), 5)
    nobody = 200.0 * generator.standard_normal((400, 5, 15, 2))  # as well seen from here as from there
    coarse, fine = (
        observation.estimate(model, nobody, noise_variance=70.0, grid_step_rad=np.radians(step))
        for step in (30.0, 3.0)
    )
    assert (coarse.cost <= coarse.runner_up_cost).all()
    assert np.mean(np.abs(wrapped(coarse.angle_rad - fine.angle_rad)) < 1e-6) > 0.95
    assert (fine.cost <= coarse.cost * (1 + 1e-9)).all()


def test_candidates_may_be_limited() -> None:
    generator = np.random.default_rng(12)
    people = walkers(generator, 12)
    model = fit(people[1:].reshape(11, -1), 5)
    clip = observation.observe(played(people[0], 0.9, 0.0, 4.0), RATE_HZ, np.radians([60.0, 20.0]))
    limits = (np.radians(-30.0), np.radians(40.0))
    found = observation.estimate(model, clip.image, noise_variance=70.0, angle_range_rad=limits)
    assert np.degrees(found.angle_rad[0]) == pytest.approx(40.0, abs=1e-6)
    assert np.degrees(found.angle_rad[1]) == pytest.approx(20.0, abs=5.0)


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
        ("positions have the wrong shape", {"cut": (slice(None), 0)}),
        ("no harmonics", {"harmonics": 0}),
        ("frame rate is too low for 2 harmonics", {"rate": 6.0}),
        ("frame rate is too low", {"rate": np.inf}),
        ("too short for a walking cycle", {"cut": slice(0, 62)}),
        ("not finite at frame 7, joint 3", {"spoilt": np.inf}),
        ("not those of the joints", {"mirror": tuple(range(14))}),
        ("not those of the joints", {"mirror": (*range(1, 15), 0)}),
        ("left and right do not move apart", {"mirror": tuple(range(15))}),
    ],
)
def test_clips_that_cannot_be_observed_are_refused(words: str, arguments: dict[str, Any]) -> None:
    motion = played(walkers(np.random.default_rng(0), 1)[0], 0.9, 0.0, 3.0)
    if "spoilt" in arguments:
        motion = changed(motion, 7, arguments["spoilt"])
    with pytest.raises(Refusal, match=words):
        observation.observe(
            motion[arguments.get("cut", slice(None))],
            arguments.get("rate", RATE_HZ),
            arguments.get("view", VIEWS),
            harmonics=arguments.get("harmonics", 2),
            mirror=arguments.get("mirror", WALKER15.mirror),
        )


@pytest.mark.parametrize(
    ("words", "arguments"),
    [
        ("another size than the model", {"image": np.zeros((2, 5, 14, 2))}),
        ("another size than the model", {"image": np.zeros((5, 15, 2))}),
        ("does not give it", {"frequency_hz": None}),
        ("does not give it", {"frequency_hz": np.ones(3)}),
        ("an observed value is not finite", {"image": np.full((2, 5, 15, 2), np.nan)}),
        ("an observed value is not finite", {"frequency_hz": np.array([1.0, np.nan])}),
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
    with pytest.raises(Refusal, match=words):
        observation.from_known_views(model, image, np.zeros(2), **given_)
    with pytest.raises(Refusal, match=words):
        observation.estimate(model, image, **given_)


def test_an_empty_range_of_views_and_a_bad_path_are_refused() -> None:
    people = walkers(np.random.default_rng(0), 6)
    model = fit(people.reshape(6, -1), 3)
    clip = observation.observe(played(people[0], 0.9, 0.0, 3.0), RATE_HZ, VIEWS)
    with pytest.raises(Refusal, match="range of view angles is empty"):
        observation.estimate(model, clip.image, noise_variance=None, angle_range_rad=(1.0, 1.0))
    with pytest.raises(Refusal, match="range of view angles is empty"):
        observation.estimate(model, clip.image, noise_variance=None, grid_step_rad=0.0)
    with pytest.raises(Refusal, match="noise variance"):
        observation.error_path(model, clip, np.array([70.0, -1.0]))


def test_nothing_mutates_its_arguments() -> None:
    people = walkers(np.random.default_rng(0), 8)
    model = fit(people[1:].reshape(7, -1), 4)
    motion = played(people[0], 0.9, 0.0, 3.0)
    held = motion.copy()
    clip = observation.observe(motion, RATE_HZ, VIEWS)
    image = clip.image
    before = image.copy(), model.mean.copy(), model.components.copy(), clip.coefficients.copy()
    for noise in (None, 70.0):
        observation.from_known_views(model, image, VIEWS, noise_variance=noise)
        observation.estimate(model, image, noise_variance=noise)
    observation.error_path(model, clip, np.array([70.0]))
    assert np.array_equal(motion, held)
    for one, two in zip(before, (image, model.mean, model.components, clip.coefficients), strict=True):
        assert np.array_equal(one, two)
