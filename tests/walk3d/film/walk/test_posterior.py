"""Tests of the contributions to the error bars that do not come from the fit's covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.skeleton import PELVIS
from tests.walk3d.film.walk.walkers import clip, prior
from walk3d.film.walk import Fitting, reconstruct
from walk3d.film.walk.objective import HEADING, TURN
from walk3d.film.walk.posterior import ANGLE_FLOOR_RAD, posterior
from walk3d.film.walk.view import level_axes


def test_what_changes_from_step_to_step_widens_the_bars_with_the_pelvis_it_is_counted_from() -> None:
    sim = clip(40.0)
    options = Fitting(both_labellings=False, max_starts=1)
    observed = np.ones(sim.pixels.shape[:2])
    result = reconstruct(sim.pixels, observed, sim.frame_rate_hz, sim.focal_px, prior(), options)
    aperiodic = np.random.default_rng(0).uniform(10.0, 90.0, size=(15, 3))
    variances = []
    for leftover in (np.zeros((15, 3)), aperiodic):
        inputs = replace(prior(), model=replace(prior().model, aperiodic_variance=leftover))
        bars = posterior(inputs, result.fit, result.keypoints)
        variances.append(bars.sd_mm**2)
        assert bars.angles_sd_rad.min() >= ANGLE_FLOOR_RAD
    times = result.fit.objective.setting.times
    for t, axes in enumerate(level_axes(result.fit.x[HEADING] + result.fit.x[TURN] * times)):
        for joint in range(15):
            reference = np.diag(axes @ np.diag(aperiodic[joint] + aperiodic[PELVIS]) @ axes.T) * (
                joint != PELVIS
            )
            np.testing.assert_allclose(variances[1][t, joint] - variances[0][t, joint], reference, rtol=1e-6)
