"""Tests of the sentences of zhang2007 on the synthetic population.

`synthetic_tables` holds the figures' tables of ``data=synthetic`` at a middling scale.  A test named after a
sentence asks the ledger: the sentence must hold at least in its direction.  What the ledger finds beyond that
is a result, not a test.  The tests at the end hold what follows from the mathematics alone.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from pipeline.studies.ledger import Tables
from tests.claims import holding

pytestmark = pytest.mark.thorough

assert_holds = partial(holding.assert_holds, paper="zhang2007")

LEAST_SQUARES, MAP = "least_squares", "map"


def rows(tables: Tables, table: str, method: str, column: str) -> np.ndarray:
    """Return a numeric column for one method, sorted by view angle."""
    columns = tables[table]
    of_method = columns["method"] == method
    order = np.argsort(columns["view_angle_deg"][of_method])
    return np.asarray(columns[column], dtype=float)[of_method][order]


# --- section 2 and 3: the representation ------------------------------------------------------------------


def test_fifteen_virtual_markers_make_225_and_150_numbers(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "joints", "dimensions_3d", "dimensions_2d")


def test_the_power_carried_by_the_residual_is_small(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "residual_below_three_percent")


# --- section 4.1: model construction ----------------------------------------------------------------------


def test_the_fundamental_accounts_for_most_and_the_second_harmonic_for_a_little_more(
    synthetic_tables: Tables,
) -> None:
    assert_holds(synthetic_tables, "fundamental_share", "second_harmonic_share", "two_harmonics_share")


def test_the_cumulative_variance_rises_to_the_whole(synthetic_tables: Tables) -> None:
    table = synthetic_tables["zhang2007_fig2"]
    assert (np.diff(table["component"]) == 1).all()
    assert (np.diff(table["eigenvalue_mm2"]) <= 1e-9 * table["eigenvalue_mm2"][0]).all()
    np.testing.assert_allclose(np.cumsum(table["variance_fraction"]), table["cumulative_fraction"], rtol=1e-6)
    assert table["cumulative_fraction"][-1] <= 1.0 + 1e-6


# --- section 4.2: reconstruction at a known view ----------------------------------------------------------


def test_bayes_rule_avoids_coefficients_beyond_training(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "bayes_avoids_overfitting")


def test_the_optimal_variance_lies_inside_the_swept_range(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "optimal_variance", "optimal_variance_nested")


def test_the_original_and_the_reconstructed_sequences_appear_very_similar(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "reconstruction_looks_similar", "five_postures")


def test_no_obvious_differences_between_the_two_approaches(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "no_difference_to_the_eye")


def test_map_error_is_smaller_than_least_squares(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "map_thirty_percent", "map_thirty_percent_relative")


def test_map_error_is_smaller_with_a_variance_chosen_on_other_walkers(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "map_thirty_percent_nested")


def test_map_error_is_smaller_at_most_views_and_for_most_walkers(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "map_better_at_every_view", "map_better_for_most_walkers")


def test_frontal_views_have_small_and_profile_views_large_relative_errors(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "profile_relative_error_large", "oblique_relative_error_small")


def test_the_variance_to_be_recovered_from_the_profile_view_is_relatively_small(
    synthetic_tables: Tables,
) -> None:
    assert_holds(synthetic_tables, "profile_variance_small")


def test_the_absolute_error_in_profile_is_reasonable(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "profile_absolute_error_reasonable", "reasonable_reconstruction")


def test_the_absolute_error_is_largest_near_the_frontal_view(synthetic_tables: Tables) -> None:
    """The absolute error is largest near the frontal view, as in the curve of figure 5a."""
    for method in (LEAST_SQUARES, MAP):
        errors = rows(synthetic_tables, "zhang2007_fig5", method, "absolute_error_mm2")
        views = rows(synthetic_tables, "zhang2007_fig5", method, "view_angle_deg")
        assert abs(views[np.argmax(errors)]) <= 45.0, method


def test_the_variances_are_nearly_symmetric(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "variances_nearly_symmetric")


# --- section 4.3: the view angle --------------------------------------------------------------------------


def test_the_view_angles_are_precisely_obtained(synthetic_tables: Tables) -> None:
    assert_holds(
        synthetic_tables,
        "view_angle_mean",
        "view_angle_spread",
        "view_angle_failures",
        "view_angle_high_accuracy",
    )


def test_bayesian_inference_does_not_provide_an_advantage_for_the_view(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "bayes_no_advantage_for_the_view")


# --- what follows from the mathematics --------------------------------------------------------------------


def test_the_missing_variance_is_smallest_in_profile_and_largest_in_the_frontal_view(
    synthetic_tables: Tables,
) -> None:
    variance = rows(synthetic_tables, "zhang2007_fig5", LEAST_SQUARES, "missing_variance_mm2")
    views = rows(synthetic_tables, "zhang2007_fig5", LEAST_SQUARES, "view_angle_deg")
    assert abs(views[np.argmin(variance)]) >= 80.0, "the walk sways least from side to side"
    assert abs(views[np.argmax(variance)]) <= 10.0, "the walk swings most along its direction"


def test_the_missing_variance_does_not_depend_on_the_approach(synthetic_tables: Tables) -> None:
    np.testing.assert_allclose(
        rows(synthetic_tables, "zhang2007_fig5", LEAST_SQUARES, "missing_variance_mm2"),
        rows(synthetic_tables, "zhang2007_fig5", MAP, "missing_variance_mm2"),
        rtol=1e-8,
    )


def test_opposite_profiles_miss_the_same_dimension(synthetic_tables: Tables) -> None:
    """Views from -90 and +90 degrees, which are mirrored, have the same missing variance and the same error."""
    for column in ("missing_variance_mm2", "absolute_error_mm2"):
        for method in (LEAST_SQUARES, MAP):
            values = rows(synthetic_tables, "zhang2007_fig5", method, column)
            views = rows(synthetic_tables, "zhang2007_fig5", method, "view_angle_deg")
            assert (views[0], views[-1]) == (-90.0, 90.0)
            np.testing.assert_allclose(values[0], values[-1], rtol=1e-6)


def test_the_root_of_the_mean_square_bounds_the_mean_root(synthetic_tables: Tables) -> None:
    for method in (LEAST_SQUARES, MAP):
        mean_square = rows(synthetic_tables, "zhang2007_fig5", method, "absolute_error_mm2")
        root = rows(synthetic_tables, "zhang2007_fig5", method, "rms_error_mm")
        assert (root**2 <= mean_square * (1 + 1e-6)).all()


def test_the_mean_over_views_is_the_mean_over_walkers(synthetic_tables: Tables) -> None:
    walkers = synthetic_tables["zhang2007_fig5/table_walkers"]
    for method in (LEAST_SQUARES, MAP):
        over_walkers = walkers["absolute_error_mm2"][walkers["method"] == method].mean()
        over_views = rows(synthetic_tables, "zhang2007_fig5", method, "absolute_error_mm2").mean()
        np.testing.assert_allclose(over_views, over_walkers, rtol=1e-6)


def test_the_curve_of_variances_is_the_mean_of_its_views(synthetic_tables: Tables) -> None:
    curve, views = synthetic_tables["zhang2007_fig3"], synthetic_tables["zhang2007_fig3/table_views"]
    for sigma2, error in zip(curve["sigma2_mm2"], curve["absolute_error_mm2"], strict=True):
        at_sigma2 = views["absolute_error_mm2"][views["sigma2_mm2"] == sigma2]
        np.testing.assert_allclose(at_sigma2.mean(), error, rtol=1e-6)


def test_a_variance_chosen_without_the_walker_is_no_better_than_the_best_for_all(
    synthetic_tables: Tables,
) -> None:
    """The mean error with sigma² chosen without the test walker is at least the error with the best common sigma²."""
    nested = synthetic_tables["zhang2007_fig3/table_nested"]["absolute_error_mm2"].mean()
    best = synthetic_tables["zhang2007_fig3"]["absolute_error_mm2"].min()
    assert nested >= best * 0.99, "1 % for choices made with models that lack two walkers"


def test_only_the_missing_dimension_is_reconstructed(synthetic_tables: Tables) -> None:
    """In the frontal view, the error along y, the missing dimension, is more than twice the errors along x and z."""
    table = synthetic_tables["zhang2007_fig4"]
    frontal = table["view_angle_deg"] == 0.0
    assert frontal.any()
    error = {
        axis: np.sqrt(
            np.mean((table[f"original_{axis}_mm"] - table[f"reconstructed_{axis}_mm"])[frontal] ** 2)
        )
        for axis in "xyz"
    }
    assert error["y"] > 2 * max(error["x"], error["z"])
