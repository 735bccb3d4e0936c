"""Tests of the sentences of mozerov2006 on synthetic bends.

`synthetic_tables` holds the figures' tables of ``data=synthetic``, forty performances as in the paper.  A test named
after a sentence asks the ledger: the sentence must hold at least in its direction.  What the ledger finds beyond that
is a result, not a test.  The tests at the end hold what follows from the mathematics alone.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from pipeline.studies.ledger import Tables
from tests.claims import holding

pytestmark = pytest.mark.thorough

assert_holds = partial(holding.assert_holds, paper="mozerov2006")

STAGES = {"raw", "linear", "keyframe", "synchronized"}


# --- section 2: the human action model ----------------------------------------------------------------------


def test_twelve_rigid_parts_and_fifteen_joints_make_37_parameters(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "rigid_parts", "joints", "posture_parameters")


def test_three_cosines_determine_two_degrees_of_freedom_without_discontinuities(
    synthetic_tables: Tables,
) -> None:
    assert_holds(synthetic_tables, "redundant_cosines", "cosines_without_discontinuities")


def test_postures_are_highly_correlated(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "highly_correlated_postures", "eigenvectors", "variance_captured")


# --- section 3: the synchronization algorithm ---------------------------------------------------------------


def test_the_ratio_of_rates_is_rarely_constant(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "rate_rarely_constant", "changing_rate_explains_misfit")


def test_linear_normalisation_does_not_give_the_needed_fit(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "linear_normalisation_not_enough", "nonlinear_synchronization_needed")


def test_the_rate_to_rate_function_satisfies_its_constraints(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "rate_to_rate_constraints")


def test_no_other_path_is_shorter(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "path_is_optimal")


def test_an_arbitrary_pattern_is_not_a_reasonable_choice(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "median_better_than_arbitrary_pattern")


# --- section 4: experiments ---------------------------------------------------------------------------------


def test_forty_performances_of_a_hundred_frames_on_average(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "performances", "frames", "different_durations", "dimensions_shown")


def test_mistiming_hides_the_common_pattern(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "different_speeds_hide_the_pattern")


def test_the_results_are_very_similar_to_the_manual_ones(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "as_good_as_key_frames", "like_key_frames")


def test_unseen_performances_lie_within_three_standard_deviations(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "within_three_standard_deviations")


def test_only_similar_and_meaningful_postures_are_accepted(synthetic_tables: Tables) -> None:
    assert_holds(
        synthetic_tables,
        "postures_shown",
        "feasible_postures_accepted",
        "sampled_postures_similar",
        "sampled_postures_meaningful",
        "only_meaningful_postures",
    )


# --- what follows from the mathematics alone ----------------------------------------------------------------


def test_all_stages_but_the_raw_one_have_the_same_samples(synthetic_tables: Tables) -> None:
    for figure in ("mozerov2006_fig1", "mozerov2006_fig3"):
        table = synthetic_tables[figure]
        assert set(table["stage"]) == STAGES
        counts = {
            (stage, name): np.unique(table["sample"][start]).size
            for stage in STAGES
            for name in set(table["performance"])
            if (start := (table["stage"] == stage) & (table["performance"] == name)).any()
        }
        assert {samples for (stage, _), samples in counts.items() if stage != "raw"} == {100}
        assert len({samples for (stage, _), samples in counts.items() if stage == "raw"}) > 1


def test_synchronization_keeps_the_ends_of_every_performance(synthetic_tables: Tables) -> None:
    """The first and the last posture of every performance are the same before and after synchronization."""
    table = synthetic_tables["mozerov2006_fig3"]
    first = table["sample"] == 0
    key = np.char.add(table["performance"].astype(str), table["component"].astype(str))
    values: dict[str, np.ndarray] = {}
    for stage in STAGES:
        start = first & (table["stage"] == stage)
        values[stage] = table["value"][start][np.argsort(key[start])]
    for stage in STAGES - {"raw"}:
        np.testing.assert_allclose(values[stage], values["raw"], rtol=1e-8, atol=1e-9)


def test_the_median_sequence_is_the_one_of_least_global_distance(synthetic_tables: Tables) -> None:
    table = synthetic_tables["mozerov2006_fig3/table_performances"]
    (median,) = np.flatnonzero(table["is_median"])
    assert median == table["global_distance"].argmin()
    assert table["disparity_max_abs"][median] == 0


def test_the_last_accumulated_cost_is_the_distance(synthetic_tables: Tables) -> None:
    path = synthetic_tables["mozerov2006_fig2/table_path"]
    (distance,) = synthetic_tables["mozerov2006_fig2/table_pair"]["distance"]
    assert path["accumulated_cost"][-1] == np.maximum.accumulate(path["accumulated_cost"])[-1]
    np.testing.assert_allclose(path["accumulated_cost"][-1], distance, rtol=1e-8)


def test_the_path_is_never_longer_than_without_synchronization(synthetic_tables: Tables) -> None:
    rates = synthetic_tables["mozerov2006_fig1/table_rates"]
    assert (rates["distance"] <= rates["distance_linear"] * (1 + 1e-9)).all()


def test_the_spectrum_sums_to_the_whole_and_keeps_the_smallest_number(synthetic_tables: Tables) -> None:
    spectrum = synthetic_tables["mozerov2006_fig3/table_spectrum"]
    fixed = spectrum["cumulative_fraction"]
    assert (np.diff(spectrum["eigenvalue"]) <= 1e-9 * spectrum["eigenvalue"][0]).all()
    np.testing.assert_allclose(fixed[-1], 1.0, rtol=1e-9)
    retained = np.unique(synthetic_tables["mozerov2006_fig3/table_model"]["component"]).size
    assert fixed[retained - 1] >= 0.95 > fixed[retained - 2]


def test_the_learnt_spread_is_the_variance_that_is_left(synthetic_tables: Tables) -> None:
    """The sum of the learnt variances, averaged over samples, equals the variance left after synchronization."""
    model = synthetic_tables["mozerov2006_fig3/table_model"]
    stages = synthetic_tables["mozerov2006_fig3/table_stages"]
    (left,) = stages["variance_left"][stages["stage"] == "synchronized"]
    samples = np.unique(model["sample"]).size
    np.testing.assert_allclose((model["standard_deviation"] ** 2).sum() / samples, left, rtol=1e-4)
