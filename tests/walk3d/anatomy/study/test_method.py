"""Tests of the anatomical reconstruction as a method of the sweeps that compare reconstruction methods."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from pipeline.core import camera
from pipeline.studies.eigenwalkers.model import EigenwalkersModel
from pipeline.studies.study import Grid, SweepInputs
from pipeline.studies.walks.known_view import KnownView
from pipeline.studies.walks.methods import PUBLISHED
from pipeline.studies.walks.unknown_view import UnknownView
from tests.rejects import rejects
from tests.walk3d.anatomy.study.test_anatomical import samples, spoiled
from walk3d.anatomy.method import AnatomicalApproach
from walk3d.anatomy.study.joint_angles import JointAngles

VIEWS = np.radians([-60.0, -20.0, 0.0, 20.0, 60.0])
GRID = Grid(start=-90, stop=90, step=45)


def inputs() -> SweepInputs:
    data, options = samples(), EigenwalkersModel(components=4)
    return SweepInputs(
        clips=None,
        dataset=data,
        model=options.learn(data, workers=1),
        model_options=options,
        workers=1,
        seed=0,
    )


def test_views_from_the_left_are_those_of_the_mirror_image_from_the_right() -> None:
    approach = AnatomicalApproach(samples())
    fold = approach.fold(2)
    together = approach.missing(fold, 2, VIEWS)
    for view, result in zip(VIEWS, together, strict=True):
        np.testing.assert_allclose(approach.missing(fold, 2, np.array([view, view]))[0], result, atol=1e-5)


def test_the_persons_other_walk_is_not_learnt_from() -> None:
    """The other walk of the tested person does not change the reconstruction.

    Walks 0 and 1 are of one person.
    """
    approaches = [AnatomicalApproach(data) for data in (samples(), spoiled(0))]
    np.testing.assert_array_equal(*(each.missing(each.fold(1), 1, VIEWS) for each in approaches))


def test_known_views_have_the_anatomical_method_after_the_others() -> None:
    arguments = inputs()
    two = KnownView(view_angle_deg=GRID, sigma2_mm2=Grid(start=1, stop=101, step=50)).measure(arguments)
    three = KnownView(
        view_angle_deg=GRID, sigma2_mm2=Grid(start=1, stop=101, step=50), methods=[*PUBLISHED, "anatomical"]
    ).measure(arguments)
    assert three.methods.tolist() == ["least_squares", "map", "anatomical"]
    again = three.rows[three.rows["method"] != "anatomical"].reset_index(drop=True)
    pd.testing.assert_frame_equal(again, two.rows)
    walk, view = 3, np.radians(30.0)
    missing = three.missing[2, walk, 1]
    true = camera.missing_dimension(arguments.dataset.coefficients[walk], view)
    off = ((true - missing) ** 2 * np.array([1, 0.5, 0.5, 0.5, 0.5])[:, None]).sum(axis=0)
    residual = arguments.dataset.residual_covariance[walk][:, 0, 0]  # a multiple of the unit matrix
    displayed = three.demonstrations.set_index(["walker", "method", "view_angle_deg"])["rms_error_mm"]
    expected = np.sqrt((off + residual).mean())
    np.testing.assert_allclose(
        displayed[arguments.dataset.clip[walk], "anatomical", 30.0], expected, rtol=1e-9
    )


def test_unknown_views_and_joint_angles_have_it_too() -> None:
    arguments = inputs()
    views = UnknownView(view_angle_deg=GRID, methods=["anatomical", "map"]).measure(arguments)
    assert views.methods.tolist() == ["anatomical", "map"]
    rows = views.rows[views.rows["method"] == "anatomical"]
    assert rows["error_deg"].abs().median() < 15.0
    assert (rows["runner_up_cost"] >= 1.0).all()
    angles = JointAngles(view_angle_deg=GRID, methods=["anatomical"]).measure(arguments)
    assert angles.methods.tolist() == ["anatomical", "average_walker"]
    assert np.isfinite(angles.rows["rmse_deg"]).all()


def test_joints_that_were_not_measured_are_hidden_not_read() -> None:
    data = samples()
    unmeasured = data.unmeasured.copy()
    unmeasured[3, 4] = True
    wrong = data.coefficients.copy()
    wrong[3, :, 4] += 50.0
    lacking = [replace(data, unmeasured=unmeasured), replace(data, unmeasured=unmeasured, coefficients=wrong)]
    approaches = [AnatomicalApproach(each) for each in lacking]
    np.testing.assert_array_equal(*(each.missing(each.fold(3), 3, VIEWS) for each in approaches))
    with rejects("joints_not_measured", "c3"):
        approaches[0].estimate(3, VIEWS)
