"""Tests with two simulated laboratories that differ by 25 mm in joint positions and by 10 % in body size."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

from pipeline.clips.options import SyntheticPeople
from pipeline.clips.walks import synthetic_walks
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.samples import FourierDataset, FourierSamples
from pipeline.studies.study import SweepInputs
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.prior import Differences
from walk3d.anatomy.study.figures.laboratories import LearningCurves
from walk3d.anatomy.study.model import AnatomicalModel
from walk3d.anatomy.study.sweeps.held_out import People as Everybody
from walk3d.anatomy.study.sweeps.laboratories import (
    LABORATORY,
    PERSON,
    Laboratories,
    LaboratoryErrors,
    left_out,
    simulated_laboratories,
)
from walk3d.anatomy.study.sweeps.setting import anatomical_setting

PEOPLE = 12


class People(SyntheticPeople):
    def request(self, *_: object) -> None: ...  # type: ignore[override]


@pytest.fixture(scope="module")
def walkers() -> FourierSamples:
    options = People(name="synthetic", population=PEOPLE, duration_s=4.0, frame_rate_hz=60.0)
    return FourierDataset(harmonics=4).build(synthetic_walks(options, 11, 1), workers=1)


@pytest.fixture(scope="module")
def measured(walkers: FourierSamples) -> LaboratoryErrors:
    options = AnatomicalModel()
    inputs = SweepInputs(None, walkers, options.population(walkers), options, 1, 5)
    return Laboratories(partners=2).measure(inputs)


def test_the_size_and_the_offsets_of_two_laboratories_are_found(walkers: FourierSamples) -> None:
    sizes, offsets = [], []
    for seed in range(20):
        distance = simulated_laboratories(walkers, np.random.default_rng(seed))
        walks = distance.coefficients, distance.person, distance.source
        result = anatomical.learn_differences(*walks, Differences(), worth=0.0)
        sizes.append(result.size**2)
        offsets.append(np.square(result.offset_mm[1:]))
    # Two laboratories give one contrast, whose variance is twice theirs: over many draws it is right.
    np.testing.assert_allclose(np.sqrt(np.mean(sizes)), 0.1, rtol=0.15)
    np.testing.assert_allclose(np.sqrt(np.mean(offsets)), 25.0, rtol=0.15)


def test_laboratories_of_people_alike_in_size_do_not_say_that_the_next_is(walkers: FourierSamples) -> None:
    alike = simulated_laboratories(walkers, np.random.default_rng(1), offset_mm=0.0, size=0.0)
    walks = alike.coefficients, alike.person, alike.source
    assert anatomical.learn_differences(*walks, Differences()).size < 0.095, "what these two alone would say"
    options = AnatomicalModel()
    people = Everybody(alike, options.population(alike))
    whole = anatomical_setting(options, people.harmonics)
    ours, anybody = (
        people.learn(s, (0,)) for s in (whole, replace(whole, differences=Differences(offset_mm=(0.0,) * 7)))
    )
    mean = ours.mean.ravel()
    more = (anybody.covariance - ours.covariance).reshape(len(mean), -1)
    owner = np.delete(alike.source, 0)
    share = anatomical.concentration(np.full(len(owner), 1.0 / len(owner)), owner)
    assert mean @ more @ mean >= share * (0.1 * mean @ mean) ** 2 * (1.0 - 1e-9)


def test_simulated_laboratories_differ_by_what_they_are_told(walkers: FourierSamples) -> None:
    same = simulated_laboratories(walkers, np.random.default_rng(1), offset_mm=0.0, size=0.0)
    np.testing.assert_allclose(same.coefficients, walkers.coefficients)
    distance = simulated_laboratories(walkers, np.random.default_rng(1), size=0.0)
    moved = distance.coefficients - walkers.coefficients
    np.testing.assert_allclose(moved[:, 1:], 0.0, atol=1e-9)
    np.testing.assert_allclose(moved[0], -moved[1])
    np.testing.assert_allclose(moved[0, 0], moved[0, 0][list(WALKER15.mirror)] * [-1.0, 1.0, 1.0], atol=1e-9)
    assert set(distance.source) == {"laboratory_1", "laboratory_2"}


def mean(rows: pd.DataFrame, learnt_from: str, method: str, column: str = "absolute_error_mm2") -> float:
    fixed = (rows["learnt_from"] == learnt_from) & (rows["method"] == method)
    return float(rows.loc[fixed, column].mean())


def test_what_laboratories_differ_by_lowers_errors_and_makes_bars_hold(measured: LaboratoryErrors) -> None:
    rows = measured.rows
    assert mean(rows, LABORATORY, "anybody") < 0.9 * mean(rows, LABORATORY, "anatomical")
    assert mean(rows, LABORATORY, "anatomical", "covered_95") < 0.8
    assert 0.88 < mean(rows, LABORATORY, "anybody", "covered_95") <= 0.98
    # Of people of laboratories that train it takes little.
    assert mean(rows, PERSON, "anybody") < 1.1 * mean(rows, PERSON, "anatomical")


def test_nobody_is_learnt_from_whose_laboratory_is_left_out(walkers: FourierSamples) -> None:
    options = AnatomicalModel()
    data = simulated_laboratories(walkers, np.random.default_rng(3))
    inside = data.source == "laboratory_2"
    changed = replace(data, coefficients=np.where(inside[:, None, None, None], 1.3, 1.0) * data.coefficients)
    setting = replace(anatomical_setting(options, 4), differences=Differences())
    person = int(np.flatnonzero(inside)[0])
    for source, unchanged in ((LABORATORY, True), (PERSON, False)):
        priors = []
        for walks in (data, changed):
            people = Everybody(walks, options.population(walks))
            left = dict(left_out(people.model.sources, person))[source]
            priors.append(people.fold(*np.flatnonzero(left).tolist()).prior(setting))
        assert np.array_equal(priors[0].covariance, priors[1].covariance) is unchanged
        assert np.array_equal(priors[0].mean, priors[1].mean) is unchanged


def test_curves_have_as_many_people_as_everybody_has(measured: LaboratoryErrors) -> None:
    curve = measured.curve
    counts = curve.groupby(["left_out", "method", "people"]).size()
    assert (counts == PEOPLE).all()
    assert curve.loc[curve["left_out"] == "laboratory", "people"].max() <= PEOPLE // 2
    spanned = curve[curve["method"] == "map_tuned"].groupby(["left_out", "people"])["spanned_percent"].mean()
    assert spanned["person"].is_monotonic_increasing


def test_laboratories_are_written_as_words_and_shares_are_called_so() -> None:
    tables = {"table_sources": pd.DataFrame({"tested": ["laboratory_1"]})}
    bars = [chart for chart in LearningCurves().charts(cast(Any, None), tables).charts if chart.x == "tested"]
    assert all(chart.abscissa.words == {"laboratory_1": "laboratory 1"} for chart in bars)
    assert all(("share" in chart.label) == chart.y.startswith("covered") for chart in bars)
