"""Tests that no model is trained on the tested person, and that half of the views give the results of all views."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.study import Grid, SweepInputs
from tests.rejects import rejects
from tests.strategies import walkers
from walk3d.anatomy.prior import Noise, Shrinkage
from walk3d.anatomy.study.model import AnatomicalModel
from walk3d.anatomy.study.people_intervals import PeopleResampled
from walk3d.anatomy.study.sweeps.held_out import CHOOSING_VIEWS_DEG, People
from walk3d.anatomy.study.sweeps.occlusion import Occlusion, covered_by_bars
from walk3d.anatomy.study.sweeps.setting import PLAIN, Setting, anatomical_setting, approach_two
from walk3d.anatomy.study.sweeps.structure import Structure, errors_of

COUNT = 7


def samples(seed: int = 0) -> FourierSamples:
    """Return eight walks of seven people; of the first person's two walks, the second is described better."""
    rng = np.random.default_rng(seed)
    coefficients = walkers(rng, COUNT + 1)
    residual = np.abs(rng.standard_normal((COUNT + 1, 15, 1, 1))) * np.eye(3)
    shares = np.tile([0.9, 0.05], (COUNT + 1, 1))
    shares[1] = 0.92, 0.06
    person = np.array(["a", "a", *"bcdefg"])
    return FourierSamples(
        coefficients=coefficients,
        frequency_hz=np.ones(COUNT + 1),
        phase_rad=np.zeros(COUNT + 1),
        variance_fractions=shares,
        residual_fraction=1 - shares.sum(axis=1),
        residual_covariance=residual,
        temporal_covariance=residual,
        walk=np.arange(COUNT + 1),
        scale=np.ones(COUNT + 1),
        person=person,
        clip=np.array([f"{who}{n}" for n, who in enumerate(person)]),
        source=np.array(["one"] * 4 + ["two"] * 4),
        unmeasured=np.zeros((COUNT + 1, 15), dtype=bool),
        frequency=False,
        words="",
    )


def people(data: FourierSamples | None = None) -> People:
    data = data or samples()
    return People(data, AnatomicalModel().learn(data, workers=1))


WHOLE = anatomical_setting(AnatomicalModel(), 2)


def spoiled(walk: int) -> FourierSamples:
    """Return the walks of `samples`, with one walk changed."""
    data = samples()
    coefficients = data.coefficients.copy()
    coefficients[walk] *= 1.5
    return replace(data, coefficients=coefficients)


def test_the_walk_that_is_tested_is_the_best_described_one() -> None:
    model = AnatomicalModel().learn(samples(), workers=1)
    assert model.people.tolist() == list("abcdefg")
    assert model.tested.tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert model.sources.tolist() == ["one"] * 3 + ["two"] * 4


@pytest.mark.parametrize("setting", [WHOLE, approach_two(70.0)], ids=["whole", "map"])
@pytest.mark.parametrize("walk", [0, 1])
def test_no_walk_of_a_person_reaches_the_fold_without_that_person(setting: Setting, walk: int) -> None:
    before, after = (people(data).fold(0).prior(setting) for data in (samples(), spoiled(walk)))
    np.testing.assert_array_equal(before.mean, after.mean)
    np.testing.assert_array_equal(before.covariance, after.covariance)
    np.testing.assert_array_equal(before.length_variance, after.length_variance)


def test_no_walk_of_a_person_chooses_for_that_person() -> None:
    candidates = [approach_two(value) for value in (10.0, 100.0, 1000.0)] + [WHOLE]
    errors, with_other = (people(data).errors_on_others(candidates, 4, 1) for data in (samples(), spoiled(1)))
    np.testing.assert_array_equal(errors[0], with_other[0])
    assert (errors[1:] != with_other[1:]).any()
    assert people().select(candidates, 4, 1) == [candidates[best] for best in errors.argmin(axis=1)]


def test_no_walk_of_a_person_chooses_any_setting_for_that_person() -> None:
    alternatives = [
        lambda s: [replace(s, pairs=factor) for factor in (0.5, 2.0, np.inf)],
        lambda s: [s.with_noise(value) for value in (1.0, 100.0, 10_000.0)],
        lambda s: [replace(s, harmonics=number) for number in (1, 2)],
    ]
    everybody, with_other = people(), people(spoiled(1))
    start = [replace(WHOLE, within=1.0 + person) for person in range(COUNT)]
    result = everybody.select_in_turn(start, alternatives, 4, 1)
    assert result[0] == with_other.select_in_turn(start, alternatives, 4, 1)[0]
    assert [setting.within for setting in result] == [setting.within for setting in start], (
        "no alternative changes this setting"
    )
    for person, setting in enumerate(result):  # the last choice of each, from what is tried at once
        errors = everybody.errors_on_others([replace(setting, harmonics=number) for number in (1, 2)], 4, 1)[
            person
        ]
        assert setting.harmonics == 1 + errors.argmin()
    first = everybody.select_in_turn(start, alternatives[:1], 4, 1)
    for person, setting in enumerate(start):
        assert first[person] == everybody.select(alternatives[0](setting), 4, 1)[person]


def test_what_fewer_harmonics_leave_out_is_part_of_the_error() -> None:
    data = samples()
    fundamental = data.coefficients.copy()
    fundamental[:, 3:] = 0.0
    few = replace(WHOLE.linear, harmonics=1)
    errors, without = (
        people(each).errors_on_others([few], COUNT - 1, 1)[:, 0]
        for each in (data, replace(data, coefficients=fundamental))
    )
    everybody = people(data)
    view = np.radians([CHOOSING_VIEWS_DEG[(0 + person) % 4] for person in range(1, COUNT)])
    left_out = [
        0.5 * (everybody.missing(person, view[[person - 1]])[0, :, 3:] ** 2).sum(axis=-1).mean()
        for person in range(1, COUNT)
    ]
    assert errors[0] - without[0] == pytest.approx(np.mean(left_out))
    assert (errors > without).all()


def test_settings_reconstruct_alike_alone_and_in_company() -> None:
    settings = [
        WHOLE,
        replace(WHOLE, within=3.0),
        replace(WHOLE, pairs=np.inf),
        WHOLE.linear,
        approach_two(70.0),
    ]
    view = np.radians([0.0, 40.0])
    everybody = people()
    walkers_seen = np.stack([everybody.walker(0), everybody.walker(3)])
    together = everybody.fold(0).reconstruct(settings, walkers_seen, view, with_covariance=True)
    for setting, result in zip(settings, together, strict=True):
        (alone,) = everybody.fold(0).reconstruct([setting], walkers_seen, view, with_covariance=True)
        np.testing.assert_allclose(result.estimated, alone.estimated, atol=1e-6)
        np.testing.assert_allclose(result.covariance, alone.covariance, atol=1e-5)


def test_everybody_is_in_as_many_pairs() -> None:
    pairs = people().pairs(4)
    assert len(pairs) == len(set(map(frozenset, pairs))) == 2 * COUNT
    assert np.bincount(np.ravel(pairs)).tolist() == [4] * COUNT
    assert len(people().pairs(100)) == COUNT * (COUNT - 1) // 2, "at most everybody with everybody"


@pytest.mark.parametrize(
    "setting", [WHOLE, replace(WHOLE, within=np.inf, pairs=np.inf)], ids=["lengths", "linear"]
)
def test_half_of_the_views_serve_all(setting: Setting) -> None:
    everybody = people()
    view = np.radians([-90.0, -35.0, 0.0, 35.0, 90.0])
    together = everybody.fold(2).errors([setting], 2, view)[0]
    alone = [everybody.fold(2).errors([setting], 2, view[[a, a]])[0][0] for a in range(5)]
    np.testing.assert_allclose(together, np.stack(alone), rtol=1e-6)


def test_the_average_walker_does_not_look_at_the_image() -> None:
    everybody = people()
    setting = approach_two(1e12)
    view = np.radians([0.0, 50.0])
    fold = everybody.fold(1)
    baseline = errors_of(everybody, fold, {"average_walker": setting}, 1, view)[0]
    blind = fold.errors([setting], 1, view)[0]
    np.testing.assert_allclose(baseline, blind, rtol=1e-4)


def test_only_one_source_is_learnt_from() -> None:
    everybody = people()
    setting = replace(approach_two(70.0), shrinkage=replace(PLAIN, extra_variance=1.0))
    without = [n for n, source in enumerate(everybody.model.sources) if source == "two"]
    first = everybody.fold(*without).prior(setting)
    np.testing.assert_allclose(
        np.moveaxis(first.mean, -1, 0), samples().coefficients[[1, 2, 3]].mean(axis=0), atol=1e-9
    )


# --- intervals and bars -----------------------------------------------------------------------------------


def test_differences_between_methods_are_paired() -> None:
    rng = np.random.default_rng(0)
    errors = rng.exponential(100.0, 40)
    resampled = PeopleResampled(40, 1)
    reduction = resampled.reduction_percent(0.7 * errors, errors, "less")
    np.testing.assert_allclose(list(reduction.values()), 30.0)
    mean = resampled.mean(errors, "error_mm")
    assert list(mean) == ["error_mm", "error_mm_low", "error_mm_high"]
    assert mean["error_mm_low"] < errors.mean() == mean["error_mm"] < mean["error_mm_high"]
    expected = 1.96 * errors.std() / np.sqrt(40)
    assert mean["error_mm_high"] - mean["error_mm_low"] == pytest.approx(2 * expected, rel=0.15)


def test_bars_that_are_right_cover_and_bars_that_are_not_are_put_right() -> None:
    rng = np.random.default_rng(2)
    error = np.abs(rng.standard_normal((20, 3, 4, 3, 8)))
    for factor in (1.0, 0.3):
        bars = np.stack([error, np.full_like(error, factor)], axis=1)
        covered, half = covered_by_bars(bars)
        assert covered[1].mean() == pytest.approx(0.95, abs=0.01)
        assert half[1].mean() == pytest.approx(1.96, abs=0.05)
        assert covered[0].mean() == pytest.approx({1.0: 0.95, 0.3: 0.443}[factor], abs=0.02)


# --- options ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("sweep", "changes", "where"),
    [
        (Structure, {"partners": 1}, "sweep.partners"),
        (Occlusion, {"partners": 1}, "sweep.partners"),
    ],
)
def test_options_out_of_range_are_refused(sweep: type, changes: dict, where: str) -> None:
    grid = Grid(start=-90, stop=90, step=30)
    with rejects("out_of_range", where, value=1):
        sweep(seen_from_deg=grid, **changes).validate()


def test_views_must_lie_alike_on_both_sides() -> None:
    lopsided = Structure(seen_from_deg=Grid(start=-90, stop=80, step=10), partners=4)
    with rejects("not_mirrored", "sweep.seen_from_deg"):
        lopsided.validate()


def test_the_ladder_needs_every_harmonic_of_its_rows() -> None:
    data = samples()
    model = AnatomicalModel()
    inputs = SweepInputs(None, data, model.learn(data, workers=1), model, 1, 0)
    with rejects("out_of_range", "dataset.harmonics", value=2):
        Structure(seen_from_deg=Grid(start=-90, stop=90, step=90), partners=4).measure(inputs)


def test_a_prior_needs_four_people_and_no_frequency() -> None:
    data = samples()
    with rejects("too_few_people", count=3):
        AnatomicalModel().learn(replace(data, person=np.array(["a", "b", "c"] * 2 + ["a", "b"])), workers=1)
    with rejects("frequency_not_modelled", "dataset.frequency"):
        AnatomicalModel().learn(replace(data, frequency=True), workers=1)
    with rejects("out_of_range", "model.diagonal", value=0.5):
        AnatomicalModel(within_harmonic=0.8, diagonal=0.5).validate()
    assert Noise(bias=3.0, slow=2.0).floor(5).tolist() == [9.0, 2.0, 2.0, 2.0, 2.0]
    assert Shrinkage().mirror
