"""Both experiments on walks against the estimates as the papers print them, walker by walker and view by view."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.core import errors, linear_model
from pipeline.core.linear_model import LinearModel
from pipeline.studies.study import Grid
from pipeline.studies.walks.known_view import KnownView
from pipeline.studies.walks.methods import PUBLISHED
from pipeline.studies.walks.unknown_view import UnknownView
from tests.core.printed import printed, printed_cost
from tests.studies.walks.test_anatomical import samples
from tests.studies.walks.test_anatomical_method import inputs

VIEWS = Grid(start=-70, stop=40, step=55)
"""Not alike on both sides: a view in the place of another shows."""
NOISE = (None, 70.0)
DATA = samples()
ROWS = linear_model.flatten(DATA.coefficients)


def without(walk: int) -> LinearModel:
    """Learnt from all walks of other people."""
    return linear_model.fit(ROWS[DATA.person != DATA.person[walk]], 4)


def test_every_error_at_a_known_view_is_that_of_the_printed_estimate() -> None:
    sweep = KnownView(view_angle_deg=VIEWS, sigma2_mm2=Grid(start=1, stop=71, step=35))
    found = sweep.measure(inputs())
    assert found.methods.tolist() == [*PUBLISHED]
    for walk, row in enumerate(ROWS):
        residual = DATA.residual_covariance[walk][:, 0, 0]  # a multiple of the unit matrix
        for a, view in enumerate(np.radians(found.view_angle_deg)):
            offs = [printed(without(walk), row, view, noise)[2] for noise in NOISE]
            expected = [errors.absolute_error(off) + residual for off in offs]
            np.testing.assert_allclose(found.absolute_error_mm2[:, walk, a], expected, rtol=1e-6)
        path = [
            np.mean([
                errors.absolute_error(printed(without(walk), row, view, sigma2)[2]) + residual
                for view in np.radians(found.view_angle_deg)
            ])
            for sigma2 in found.sigma2_mm2
        ]  # fmt: skip
        np.testing.assert_allclose(found.path_walker_mm2[walk], path, rtol=1e-6)


def test_every_view_that_is_found_has_the_least_printed_cost() -> None:
    found = UnknownView(view_angle_deg=VIEWS).measure(inputs())
    assert found.methods.tolist() == [*PUBLISHED]
    circle = np.radians(np.arange(-180, 180, 6))
    for walk, walker in enumerate(DATA.coefficients):
        for a, true in enumerate(np.radians(found.view_angle_deg)):
            across = np.cos(true) * walker[..., 0] + np.sin(true) * walker[..., 1]
            image = np.stack([across, walker[..., 2]], axis=-1)
            for m, noise in enumerate(NOISE):
                costs = [printed_cost(without(walk), image, 0.0, view, 0.0, noise) for view in circle]
                angle = float(np.radians(found.angle_deg[m, walk, a]))
                own = printed_cost(without(walk), image, 0.0, angle, 0.0, noise)
                assert found.cost[m, walk, a] == pytest.approx(own, rel=1e-6)
                assert own <= min(costs) * (1 + 1e-9)
