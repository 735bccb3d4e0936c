"""Tests of the sentences of zhang2004 on the synthetic population.

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

assert_holds = partial(holding.assert_holds, paper="zhang2004")


def test_fifteen_markers_and_the_frequency_make_226_and_151_numbers(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "joints", "dimensions_3d", "dimensions_2d")


def test_the_fundamental_covers_most_and_the_second_harmonic_a_little_more(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "fundamental_share", "second_harmonic_share", "two_harmonics_share")


def test_the_original_and_the_reconstructed_sequences_were_very_similar(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "reconstruction_looks_similar", "five_postures")


def test_the_very_small_asymmetry_of_variances(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "variances_nearly_symmetric")


def test_frontal_and_oblique_views_have_small_and_profile_views_great_relative_errors(
    synthetic_tables: Tables,
) -> None:
    assert_holds(synthetic_tables, "profile_relative_error_large", "oblique_relative_error_small")


def test_most_variances_are_retrieved_in_the_frontal_viewpoints(synthetic_tables: Tables) -> None:
    assert_holds(
        synthetic_tables,
        "most_variance_retrieved_in_frontal_views",
        "most_variance_retrieved_near_frontal_views",
    )


def test_frontal_and_oblique_views_contain_more_diverse_actions(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "frontal_and_oblique_actions_more_diverse")


def test_the_viewpoints_are_precisely_obtained(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "view_angle_mean", "view_angle_spread", "view_angle_failures")


def test_the_method_reasonably_reconstructs_walking(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "reasonable_reconstruction")


def test_least_squares_alone_is_used(synthetic_tables: Tables) -> None:
    for table in ("zhang2004_fig3", "zhang2004_fig4", "zhang2004_fig5"):
        baselines = {"average_walker", "least_squares_1", "random_view"}
        assert set(synthetic_tables[table]["method"]) - baselines == {"least_squares"}


def test_the_cumulative_variance_rises_to_the_whole(synthetic_tables: Tables) -> None:
    table = synthetic_tables["zhang2004_fig2"]
    assert (np.diff(table["component"]) == 1).all()
    assert (np.diff(table["eigenvalue_mm2"]) <= 1e-9 * table["eigenvalue_mm2"][0]).all()
    assert table["cumulative_fraction"][-1] <= 1.0 + 1e-6


def test_both_papers_find_the_same_harmonics_in_the_same_walkers(synthetic_tables: Tables) -> None:
    ours = synthetic_tables["zhang2004_fig2/table_harmonics"]
    theirs = synthetic_tables["zhang2007_fig2/table_harmonics"]
    np.testing.assert_allclose(ours["variance_fraction"], theirs["variance_fraction"], rtol=1e-8)


def test_opposite_profiles_miss_the_same_dimension(synthetic_tables: Tables) -> None:
    """Views from -90 and +90 degrees, which are mirrored, have the same missing variance and the same error."""
    table = synthetic_tables["zhang2004_fig4"]
    for column in ("missing_variance_mm2", "absolute_error_mm2"):
        left = table[column][table["view_angle_deg"] == -90.0]
        right = table[column][table["view_angle_deg"] == 90.0]
        assert left.size == right.size == 3, "least squares and two baselines"
        np.testing.assert_allclose(left, right, rtol=1e-6)
