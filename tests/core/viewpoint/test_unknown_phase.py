"""View angle and phase together, from the image and its frequency [zhang2007 4.5, 4.6]."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.core import fourier, observation, reconstruction, viewpoint
from pipeline.core.linear_model import fit, unflatten
from pipeline.core.reconstruction import TurnedObservations, gram_of
from pipeline.core.viewpoint import estimate_unknown_phase, unknown_phase
from pipeline.validation import InvalidInput
from tests.core.printed import printed_cost
from tests.core.watched import RATE_HZ, VIEWS, inside, noises, played, watched, wrapped
from tests.strategies import Fold, folds, walkers


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
    found = estimate_unknown_phase(model, clip.image, noise_variance=noise, frequency_hz=clip.frequency_hz)
    assert found.converged.all()
    assert np.abs(wrapped(found.angle_rad - view)).max() < 1e-4
    assert np.abs(wrapped(found.phase_rad - 2.2)).max() < 1e-4
    assert ((found.angle_rad > -np.pi) & (found.angle_rad <= np.pi)).all()
    known = reconstruction.from_known_views(model, sample, view, noise_variance=noise)
    assert np.allclose(found.coefficients, known.coefficients, atol=0.1)


def test_where_the_cost_has_one_minimum_there_is_no_runner_up() -> None:
    generator = np.random.default_rng(22)
    model = fit(walkers(generator, 20).reshape(20, -1), 6)
    view = np.radians([30.0])
    clip = observation.observe(played(unflatten(inside(model, generator)), 1.02, 2.2, 2.9), RATE_HZ, view)
    found = estimate_unknown_phase(
        model,
        clip.image,
        noise_variance=None,
        frequency_hz=clip.frequency_hz,
        angle_range_rad=(np.radians(20.0), np.radians(40.0)),
    )
    assert np.abs(found.angle_rad - view).max() < 1e-4
    assert np.isinf(found.runner_up_cost).all()


@given(fold=folds(), noise=noises)
@settings(max_examples=10, deadline=None)
def test_no_view_and_phase_of_the_printed_problem_cost_less(fold: Fold, noise: float | None) -> None:
    clip = watched(fold)
    image, frequency = clip.image[1:2], clip.frequency_hz[1:2]
    found = estimate_unknown_phase(fold.model, image, noise_variance=noise, frequency_hz=frequency)

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
    gram = gram_of(fold.model, noise)
    rows = TurnedObservations(fold.model, gram.white, clip.image, clip.frequency_hz)
    which = np.arange(len(VIEWS))

    def profile(beta: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        found, phase = unknown_phase._profile(gram, rows, which, np.full(len(VIEWS), beta), noise, bend=False)
        return found.cost, found.slope, phase

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
        found = estimate_unknown_phase(model, clip.image, noise_variance=noise)
        turned = np.stack([fourier.shift(o, p) for o, p in zip(clip.image, found.phase_rad, strict=True)])
        known = viewpoint.estimate(model, turned, method=method, noise_variance=noise)
        assert np.allclose(found.angle_rad, known.angle_rad, rtol=0, atol=1e-8)
        assert np.allclose(found.cost, known.cost, rtol=1e-7)


def test_of_two_minima_the_lower_is_taken_though_the_grid_is_coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    generator = np.random.default_rng(6)
    model = fit(walkers(generator, 12).reshape(12, -1), 5)
    nobody = 200.0 * generator.standard_normal((400, 5, 15, 2))  # as well seen from here as from there
    found = []
    for step in (30.0, 3.0):
        monkeypatch.setattr(unknown_phase, "_GRID_STEP_RAD", np.radians(step))
        found.append(estimate_unknown_phase(model, nobody, noise_variance=70.0))
    coarse, fine = found
    assert (coarse.cost <= coarse.runner_up_cost).all()
    assert np.mean(np.abs(wrapped(coarse.angle_rad - fine.angle_rad)) < 1e-6) > 0.95
    assert (fine.cost <= coarse.cost * (1 + 1e-9)).all()


def test_candidates_may_be_limited() -> None:
    generator = np.random.default_rng(12)
    people = walkers(generator, 12)
    model = fit(people[1:].reshape(11, -1), 5)
    clip = observation.observe(played(people[0], 0.9, 0.0, 4.0), RATE_HZ, np.radians([60.0, 20.0]))
    limits = (np.radians(-30.0), np.radians(40.0))
    found = estimate_unknown_phase(model, clip.image, noise_variance=70.0, angle_range_rad=limits)
    assert np.degrees(found.angle_rad[0]) == pytest.approx(40.0, abs=1e-6)
    assert np.degrees(found.angle_rad[1]) == pytest.approx(20.0, abs=5.0)


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
        estimate_unknown_phase(model, image, **given_)


def test_an_empty_range_of_views_is_refused() -> None:
    people = walkers(np.random.default_rng(0), 6)
    model = fit(people.reshape(6, -1), 3)
    clip = observation.observe(played(people[0], 0.9, 0.0, 3.0), RATE_HZ, VIEWS)
    with pytest.raises(InvalidInput, match="range of view angles is empty"):
        estimate_unknown_phase(model, clip.image, noise_variance=None, angle_range_rad=(1.0, 1.0))


def test_nothing_mutates_its_arguments() -> None:
    people = walkers(np.random.default_rng(0), 8)
    model = fit(people[1:].reshape(7, -1), 4)
    motion = played(people[0], 0.9, 0.0, 3.0)
    held = motion.copy()
    clip = observation.observe(motion, RATE_HZ, VIEWS)
    image = clip.image
    before = image.copy(), model.mean.copy(), model.components.copy(), clip.coefficients.copy()
    for noise in (None, 70.0):
        reconstruction.from_known_views_unknown_phase(model, image, VIEWS, noise_variance=noise)
        estimate_unknown_phase(model, image, noise_variance=noise)
    reconstruction.error_path_unknown_phase(model, clip, np.array([70.0]))
    assert np.array_equal(motion, held)
    for one, two in zip(before, (image, model.mean, model.components, clip.coefficients), strict=True):
        assert np.array_equal(one, two)
