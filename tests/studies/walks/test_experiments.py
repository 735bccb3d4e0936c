"""Tests of both experiments on walks against the estimates of the papers' equations, for each walker and view."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.core import errors, linear_model
from pipeline.core.linear_model import LinearModel
from pipeline.studies.study import Grid
from pipeline.studies.walks import known_view
from pipeline.studies.walks.known_view import KnownView, Truth
from pipeline.studies.walks.methods import PUBLISHED
from pipeline.studies.walks.unknown_view import UnknownView
from tests.core.printed import printed, printed_cost
from tests.walk3d.anatomy.study.test_anatomical import samples
from tests.walk3d.anatomy.study.test_method import inputs

VIEWS = Grid(start=-70, stop=40, step=55)
"""View angles that are not symmetric about zero, so that exchanged views would be noticed."""
NOISE = (None, 70.0)
DATA = samples()
ROWS = linear_model.flatten(DATA.coefficients)


def without(walk: int) -> LinearModel:
    """Return the linear model that is learnt from all walks of other people."""
    return linear_model.fit(ROWS[DATA.person != DATA.person[walk]], 4)


def test_every_error_at_a_known_view_is_that_of_the_printed_estimate() -> None:
    sweep = KnownView(view_angle_deg=VIEWS, sigma2_mm2=Grid(start=1, stop=71, step=35))
    result = sweep.measure(inputs())
    assert result.methods.tolist() == [*PUBLISHED]
    for walk, row in enumerate(ROWS):
        residual = DATA.residual_covariance[walk][:, 0, 0]  # a multiple of the unit matrix

        def error(view: float, noise: float | None) -> np.ndarray:
            return errors.absolute_error(printed(without(walk), row, view, noise)[2]) + residual  # noqa: B023

        views = np.radians(result.view_angle_deg)
        of_joints = np.array([[error(view, noise) for view in views] for noise in NOISE])  # (M, A, 15)
        ours = [
            f[(f["walker"] == DATA.clip[walk]) & f["method"].isin(PUBLISHED)]
            for f in (result.rows, result.joints)
        ]
        for rows, axis in zip(ours, (2, 1), strict=True):
            expected = of_joints.mean(axis=axis).ravel()
            np.testing.assert_allclose(rows["absolute_error_mm2"], expected, rtol=1e-6)
        path = [np.mean([error(view, sigma2) for view in views]) for sigma2 in result.sigma2_mm2]
        sigma2 = result.sigma2(DATA.clip)
        curve = sigma2[sigma2["walker"] == DATA.clip[walk]]
        np.testing.assert_allclose(curve["absolute_error_mm2"], path, rtol=1e-6)


def test_residual_and_variance_are_along_the_missing_dimension_of_each_view() -> None:
    """The variance of the missing dimension follows from the covariance of x and y at each view angle."""
    covariance = np.array([[100.0, 30.0, 0.0], [30.0, 400.0, 0.0], [0.0, 0.0, 25.0]])
    residual = np.broadcast_to(covariance, (*DATA.residual_covariance.shape[:2], 3, 3))
    data = replace(DATA, residual_covariance=residual, temporal_covariance=10.0 * residual)
    arguments, sigma2 = replace(inputs(), dataset=data), Grid(start=1, stop=71, step=35)
    motion, fourier = (
        KnownView(view_angle_deg=VIEWS, sigma2_mm2=sigma2, truth=truth).measure(arguments) for truth in Truth
    )
    views = np.radians(VIEWS.values("views"))
    along = 100 * np.sin(views) ** 2 - 60 * np.sin(views) * np.cos(views) + 400 * np.cos(views) ** 2
    each = np.tile(along, len(motion.rows) // len(views))
    for name, expected in (("absolute_error_mm2", each), ("missing_variance_mm2", each)):
        np.testing.assert_allclose(motion.rows[name] - fourier.rows[name], expected, rtol=1e-6)
    np.testing.assert_allclose(motion.rows["missing_variance_mm2"], 10 * each, rtol=1e-9)
    added = motion.map_errors.view_mm2 - fourier.map_errors.view_mm2
    np.testing.assert_allclose(added, np.repeat(along[:, None], added.shape[1], axis=1), rtol=1e-6)


@pytest.mark.parametrize("blocks", [1, 2, 250])
def test_errors_over_sigma2_do_not_depend_on_how_many_walkers_are_summed_together(
    blocks: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(known_view, "BLOCKS", blocks)
    result = KnownView(view_angle_deg=VIEWS, sigma2_mm2=Grid(start=1, stop=71, step=35)).measure(inputs())
    assert result.person.tolist() == DATA.person.tolist()
    of_walkers, of_views = result.map_errors.walker_mm2, result.map_errors.view_mm2
    np.testing.assert_allclose(of_views.mean(axis=0), of_walkers.mean(axis=0), rtol=1e-12)


def test_every_view_that_is_found_has_the_least_printed_cost() -> None:
    result = UnknownView(view_angle_deg=VIEWS).measure(inputs())
    assert result.methods.tolist() == [*PUBLISHED]
    circle = np.radians(np.arange(-180, 180, 6))
    for walk, walker in enumerate(DATA.coefficients):
        for view_deg in VIEWS.values("views"):
            true = np.radians(view_deg)
            across = np.cos(true) * walker[..., 0] + np.sin(true) * walker[..., 1]
            image = np.stack([across, walker[..., 2]], axis=-1)
            for m, noise in enumerate(NOISE):
                costs = [printed_cost(without(walk), image, 0.0, view, 0.0, noise) for view in circle]
                rows = result.rows[result.rows["method"] == [*PUBLISHED][m]].set_index(
                    ["walker", "view_angle_deg"]
                )
                estimate = rows.loc[(DATA.clip[walk], view_deg)]
                angle = float(np.radians(view_deg + estimate["error_deg"]))
                reference = printed_cost(without(walk), image, 0.0, angle, 0.0, noise)
                assert estimate["cost"] == pytest.approx(reference, rel=1e-6)
                assert reference <= min(costs) * (1 + 1e-9)
