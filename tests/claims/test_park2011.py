"""Tests of the sentences of park2011 on synthetic motion.

`synthetic_tables` holds the figures' tables of ``data=synthetic``, with fewer trials than at full scale.  A test named
after a sentence asks the ledger: the sentence must hold at least in its direction.  What the ledger finds beyond that
is a result, not a test.  The tests at the end hold what follows from the mathematics alone.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from pipeline.core.limb_chain import WALKER14
from pipeline.studies.ledger import Tables
from tests.claims import holding

pytestmark = pytest.mark.thorough

assert_holds = partial(holding.assert_holds, paper="park2011")


# --- sections 1 and 2: what an articulated trajectory is ----------------------------------------------------


def test_the_results_are_length_preserved_trajectories(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "length_preserved")


def test_imputed_points_satisfy_the_constraint_while_the_cartesian_representation_does_not(
    synthetic_tables: Tables,
) -> None:
    assert_holds(synthetic_tables, "imputed_points_articulated", "cartesian_points_not_articulated")


# --- section 3: initialisation and refinement ---------------------------------------------------------------


def test_direct_optimisation_falls_into_a_local_minimum(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "direct_optimisation_falls_into_local_minimum")


def test_an_accurate_initialisation_can_be_refined(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "accurate_initialisation", "initialisation_can_be_refined")


def test_the_lower_bound_is_tight(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "tight_bound")


# --- section 4: reconstructibility --------------------------------------------------------------------------


def test_accuracy_is_high_when_reconstructibility_is_greater_than_one(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "accuracy_is_high_above_one", "high_reconstructibility_low_error")


def test_below_one_the_impostor_is_taken(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "impostor_where_it_is_spanned_better")


def test_the_measure_characterises_the_accuracy(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "reconstructibility_characterises_accuracy")


# --- section 5: results -------------------------------------------------------------------------------------


def test_small_errors_of_the_root_are_reliable_and_large_ones_are_not(synthetic_tables: Tables) -> None:
    assert_holds(
        synthetic_tables,
        "small_root_error_reliable_from_a_shaky_camera",
        "large_root_error_unreliable",
        "parent_error_is_a_lower_bound",
    )


def test_a_small_radius_is_reliable_and_a_large_one_is_not(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "small_radius_reliable_from_a_shaky_camera", "large_radius_unreliable")


def test_missing_points_are_imputed(synthetic_tables: Tables) -> None:
    assert_holds(synthetic_tables, "missing_points_imputed")


# --- what follows from the mathematics alone ----------------------------------------------------------------


def test_bounds_lie_under_what_was_found_and_what_was_found_under_the_truth(synthetic_tables: Tables) -> None:
    """The lower bound of J is at most J of the estimated signs; proved signs have at most J of the true signs."""
    for name in ("park2011_fig3a", "park2011_fig3b", "park2011_fig3c"):
        table = synthetic_tables[name]
        room = 1e-6 * np.abs(table["objective"]) + 1e-6
        assert (table["lower_bound"] <= table["objective"] + room).all()
    table = synthetic_tables["park2011_fig3a"]
    proved = table["proved"].astype(bool)
    assert proved.any()
    room = 1e-5 * table["truth_objective"] + 1e-6
    assert (table["objective"] <= table["truth_objective"] + room)[proved].all()


def test_reconstructibility_is_the_ratio_of_both_parts_outside_of_the_basis(synthetic_tables: Tables) -> None:
    table = synthetic_tables["park2011_fig3a"]
    truth, impostor = table["truth_objective"], table["impostor_objective"]
    usable = truth > 1e-6  # below, rounding
    assert usable.any()
    expected = np.sqrt(impostor[usable] / truth[usable])
    np.testing.assert_allclose(table["reconstructibility"][usable], expected, rtol=1e-6)


def test_a_limb_is_no_farther_from_the_truth_than_from_its_better_mirror(synthetic_tables: Tables) -> None:
    for name in ("park2011_fig3a", "park2011_fig3b", "park2011_fig3c"):
        table = synthetic_tables[name]
        assert (table["error_up_to_mirror"] <= table["limb_error"] * (1 + 1e-9) + 1e-12).all()


def test_the_parents_error_is_what_was_asked_for(synthetic_tables: Tables) -> None:
    table = synthetic_tables["park2011_fig3b"]
    np.testing.assert_allclose(table["parent_error_ratio"], table["root_error_ratio"], rtol=1e-6, atol=1e-12)


def test_a_radius_made_as_long_as_the_rays_ask_for_does_not_depend_on_how_short_it_was(
    synthetic_tables: Tables,
) -> None:
    """In the paper's adjustment, all limb lengths that are too short for the farthest ray give the same error."""
    table = synthetic_tables["park2011_fig3c"]
    assert set(table["adjust"]) == {"refined", "global"}
    for trial in np.unique(table["trial"]):
        start = (table["trial"] == trial) & (table["adjust"] == "global")
        scales, errors, radii = (
            table[name][start] for name in ("radius_scale", "limb_error", "radius_ratio")
        )
        least = radii.min()
        np.testing.assert_allclose(radii, np.maximum(scales, least), rtol=1e-6)
        shorter = scales <= least
        assert shorter.any()
        np.testing.assert_allclose(errors[shorter], errors[shorter][0], rtol=1e-9)


def test_every_limb_of_every_clip_is_told_for_every_camera(synthetic_tables: Tables) -> None:
    limbs, clips = (synthetic_tables[f"park2011_fig4/table_{name}"] for name in ("limbs", "clips"))
    described = {
        (c, k, limb) for c, k, limb in zip(limbs["clip"], limbs["camera"], limbs["limb"], strict=True)
    }
    pairs = set(zip(clips["clip"], clips["camera"], strict=True))
    assert described == {(c, k, limb) for c, k in pairs for limb in WALKER14.limbs}
    assert {camera for _, camera in pairs} >= {"still", "moving"}
    assert (limbs["mirror_margin"] >= 1.0 - 1e-9).all()
