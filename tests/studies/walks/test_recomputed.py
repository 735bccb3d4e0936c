"""Tests of the recomputed errors: they equal those of the sweep, unless walks and table rows do not match."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.core.linear_model import LinearModel
from pipeline.studies.eigenwalkers.model import Divisor, Eigenwalkers, EigenwalkersModel
from pipeline.studies.study import Grid, SweepInputs
from pipeline.studies.walks.known_view import KnownView, Truth
from pipeline.studies.walks.recomputed import recomputed
from tests.walk3d.anatomy.study.test_anatomical import samples

DATA = samples()
DATA = replace(DATA, temporal_covariance=3.0 * DATA.residual_covariance)
WITH_FREQUENCY = replace(DATA, frequency=True, frequency_hz=np.linspace(0.8, 1.2, len(DATA.person)))
SWEEP = KnownView(
    view_angle_deg=Grid(start=-70, stop=40, step=55), sigma2_mm2=Grid(start=1, stop=71, step=70)
)


def largest_difference(
    model: EigenwalkersModel, sweep: KnownView, data: Any = DATA, seen: Any = None
) -> float:
    """Return the largest relative difference between the errors of a sweep and the recomputed errors."""
    learnt = model.learn(data, workers=1)
    result = sweep.measure(SweepInputs(None, seen or data, learnt, model, 1, 1))  # type: ignore[arg-type]
    table = recomputed(data, model, sweep, result.rows, learnt.kept)
    assert set(table["method"]) == {"least_squares", "map"}
    assert len(table) == 2 * 3
    return float(table["relative_difference"].max())


@pytest.mark.parametrize(
    ("model", "data"),
    [
        (EigenwalkersModel(components=4), DATA),
        (EigenwalkersModel(components=3, divisor=Divisor["R"]), DATA),
        (EigenwalkersModel(components=4, omega_scale_mm=None), WITH_FREQUENCY),
        (EigenwalkersModel(components=4, omega_scale_mm=30.0), WITH_FREQUENCY),
    ],
)
def test_both_computations_give_one_error(model: EigenwalkersModel, data: Any) -> None:
    for truth in Truth:
        assert largest_difference(model, replace(SWEEP, truth=truth), data) < 1e-6


def test_of_more_walkers_some_are_computed_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipeline.studies.walks.recomputed.MAX_WALKERS", 3)
    model = EigenwalkersModel(components=4)
    assert largest_difference(model, SWEEP) < 1e-6
    learnt = model.learn(DATA, workers=1)
    result = SWEEP.measure(SweepInputs(None, DATA, learnt, model, 1, 1))  # type: ignore[arg-type]
    table = recomputed(DATA, model, SWEEP, result.rows, learnt.kept)
    means = result.rows.groupby(["method", "view_angle_deg"])["absolute_error_mm2"].mean()
    row = table.iloc[0]
    assert row["absolute_error_mm2"] != pytest.approx(means[row["method"], row["view_angle_deg"]], rel=1e-6)


def test_a_walker_who_is_in_the_model_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    def knows_everybody(self: Eigenwalkers, walker: int) -> LinearModel:
        retained = self.kept
        return LinearModel(
            self.mean, self.components[:retained], self.eigenvalues[:retained], self.total_variance, 1.0
        )

    monkeypatch.setattr(Eigenwalkers, "fold", knows_everybody)
    assert largest_difference(EigenwalkersModel(components=4), SWEEP) > 0.01


def test_walkers_in_training_twice_are_not_computed_anew() -> None:
    rows = pd.DataFrame({"walker": ["a"], "method": ["map"], "view_angle_deg": [0.0]})
    assert recomputed(DATA, EigenwalkersModel(components=4, mirror=True), SWEEP, rows, 4).empty
