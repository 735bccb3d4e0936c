"""Tests of measures of published tables: no row is ignored, and a number that cannot be computed is NaN or an error."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
import pandas as pd
import pytest

from pipeline.papers import Measure
from pipeline.studies import evaluation, measures, rows
from pipeline.studies.actions import measures as of_actions
from pipeline.studies.limbs import measures as of_limbs
from pipeline.studies.registry import all_measures
from pipeline.studies.replicated import Replicated, replicate
from tests.rejects import rejects

MEASURES = all_measures()

LS, MAP = "least_squares", "map"


@pytest.mark.parametrize(
    ("measure", "rejection"),
    [
        (Measure("meen", {"table": "t", "column": "x"}), rejects("unknown_measure", "a claim", name="meen")),
        (Measure("mean", {"table": "t"}), rejects("wrong_arguments", "a claim")),
        (Measure("mean", {"table": "t", "column": "x", "by": "y"}), rejects("wrong_arguments", "a claim")),
        (Measure("mean", {"table": "t", "column": 3}), rejects("wrong_type", "a claim", argument="column")),
        (Measure("ratio", {"of": "x", "to": 1}), rejects("wrong_type", "a claim", argument="of")),
        (Measure("mean", {"table": "t", "column": "x", "where": "a = 1"}), rejects("invalid_expression")),
        (
            Measure("mean", {"table": "t", "column": "x", "where": "open('f') > 1"}),
            rejects("forbidden_expression"),
        ),
        (Measure("mean", {"table": "t", "column": "x", "where": "a.b > 1"}), rejects("forbidden_expression")),
        (
            Measure("total", {"of": (1.0, Measure("meen", {}))}),
            rejects("unknown_measure", "a claim", name="meen"),
        ),
    ],
)
def test_a_measure_that_no_function_computes_is_refused(
    measure: Measure, rejection: AbstractContextManager
) -> None:
    with rejection:
        evaluation.check(measure, MEASURES, "a claim")


def table(**values: list) -> pd.DataFrame:
    return pd.DataFrame(values)


def test_rows_are_never_dropped_to_make_a_mean() -> None:
    gap = table(method=[LS, LS], view_angle_deg=[0.0, 1.0], rms_error_mm=[1.0, np.nan])
    for measure in (measures.mean, measures.median, measures.largest, measures.smallest):
        assert np.isnan(measure(gap, "rms_error_mm"))
        assert measure(gap, "rms_error_mm", "view_angle_deg < 1") == 1.0
        assert np.isnan(measure(gap, "rms_error_mm", "view_angle_deg > 1")), "no rows"
    assert np.isnan(measures.percent(gap, "rms_error_mm > 0"))
    assert measures.percent(gap, "rms_error_mm > 0", "view_angle_deg == 0") == 100.0
    assert np.isnan(measures.variation_percent(gap, "rms_error_mm"))
    assert np.isnan(measures.at_smallest(gap, "view_angle_deg", "rms_error_mm"))


def test_variation_is_in_per_cent_of_the_mean_by_the_divisor_of_a_sample() -> None:
    assert measures.variation_percent(table(length=[1.0, 2.0, 3.0]), "length") == pytest.approx(50.0)


def test_an_entry_that_is_missing_or_there_twice_is_no_number() -> None:
    stages = table(stage=["raw", "linear", "linear"], variance_left=[1.0, 2.0, 3.0])
    assert measures.only(stages, "variance_left", "stage == 'raw'") == 1.0
    assert np.isnan(measures.only(stages, "variance_left", "stage == 'linear'"))
    assert np.isnan(measures.only(stages, "variance_left", "stage == 'keyframe'"))
    pairs = table(method=[LS, MAP, LS, MAP], walker=["a", "a", "b", "b"], x=[2.0, 1.0, 2.0, 3.0])
    assert measures.percent_below(pairs, "x", "walker", MAP, LS) == 50.0
    assert np.isnan(measures.percent_below(pairs[:3], "x", "walker", MAP, LS)), "b lacks MAP"
    assert np.isnan(measures.percent_below(pairs[[True] * 4].replace("b", "a"), "x", "walker", MAP, LS))
    numbers = table(numbers_per_limb=[3], limb_norm_error_max=[1e-3])
    assert of_actions.free_numbers(numbers, "numbers_per_limb", "limb_norm_error_max") == 3.0


def pairs_of(sequences: np.ndarray, person: list[str]) -> pd.DataFrame:
    """Return a table of the squared distances between all ordered pairs of sequences (M, P)."""
    n, m = np.nonzero(~np.eye(len(person), dtype=bool))
    names = np.array(person)
    average = ((sequences[n] - sequences[m]) ** 2).mean(axis=1)
    columns = {"performance": [f"clip {i}" for i in n], "other": [f"clip {i}" for i in m]}
    return pd.DataFrame({**columns, "person": names[n], "other_person": names[m], "x": average})


def test_variance_left_is_the_variance_of_the_sequences_also_of_people_drawn_again() -> None:
    sequences = np.random.default_rng(2).normal(size=(6, 5))
    person = ["a", "a", "b", "c", "c", "c"]
    pairs = pairs_of(sequences, person)
    target = sequences.var(axis=0, ddof=1).mean()
    assert of_actions.variance_left(pairs, "x") == pytest.approx(target)
    assert of_actions.variance_left(pairs[::-1], "x") == pytest.approx(target), "in any order"
    assert np.isnan(of_actions.variance_left(pairs[:0], "x"))
    assert np.isnan(of_actions.variance_left(pairs.assign(x=np.nan), "x"))
    drawn = replicate(["t"], {"t": pairs})
    assert drawn is not None
    rows = drawn.tables["t"]
    assert isinstance(rows, Replicated)
    result = np.asarray(of_actions.variance_left(rows, "x"))
    for b in range(20):
        times = np.repeat(np.arange(6), rows.weights[b, [0, 0, 1, 2, 2, 2]].astype(int))
        assert result[b] == pytest.approx(sequences[times].var(axis=0, ddof=1).mean(), nan_ok=True)


def test_a_text_compared_with_a_number_is_refused_by_name() -> None:
    mixed = table(method=[LS, MAP], x=[1.0, 2.0], empty=[np.nan, np.nan], shown=[True, False])
    mixed.attrs["name"] = "some_figure"
    for wrong in ("method > 1", "method == 1", "x == 'map'", "x > 0 and 3 == method", "2 * method > x"):
        with rejects("mixed_types", "table some_figure"):
            rows.holds(mixed, wrong)
    assert rows.holds(mixed, f"method == {LS!r} and x < 2").tolist() == [True, False]
    assert rows.holds(mixed, "shown == 1").tolist() == [True, False]
    assert rows.holds(mixed, "empty == 'a' or empty > 0").tolist() == [False, False], "of either kind"


def reconstructibilities(eta: list[float], error: list[float]) -> pd.DataFrame:
    return table(reconstructibility=eta, limb_error=error)


@pytest.mark.parametrize(
    ("eta", "error", "divided"),
    [
        ([0.5, 2.0, 0.25, 8.0], [0.9, 0.01, 0.9, 0.01], 1.0),  # between 0.5 and 2
        ([1.0, 4.0, 16.0], [0.01, 0.9, 0.01], 8.0),  # one on the wrong side, wherever else two are
        ([0.5, np.inf], [0.9, 0.01], 0.5),  # no mean with what is without bound
        ([1.0, 1.0, 4.0], [0.9, 0.01, 0.01], 2.0),  # equal ones are not divided
        ([0.5, 2.0], [0.9, 0.9], np.nan),  # none is found
        ([0.5, 2.0], [0.01, 0.01], np.nan),
        ([1.0, 1.0], [0.9, 0.01], np.nan),
        ([0.5, np.nan], [0.9, 0.01], np.nan),
    ],
)
def test_found_limbs_are_divided_from_others(eta: list[float], error: list[float], divided: float) -> None:
    result = of_limbs.dividing_reconstructibility(reconstructibilities(eta, error), 0.1)
    assert result == pytest.approx(divided, nan_ok=True)


@pytest.mark.parametrize(
    ("errors", "least", "largest"),
    [
        ([0.1, 0.1, 0.1, 0.1], 0.01, 100),  # as with the true radius
        ([0.1, 0.5, 0.1, 5.0], 1.0, 1.0),  # one scale in between is not
        ([0.9, 0.1, 0.1, 5.0], 0.1, 1.0),
        ([0.1, 0.1, 0.1, np.nan], np.nan, np.nan),
    ],
)
def test_scales_are_reliable_against_the_true_radius(
    errors: list[float], least: float, largest: float
) -> None:
    scales = table(
        camera=["still"] * 4,
        adjust=[of_limbs.PAPERS_ADJUSTMENT] * 4,
        radius_scale=[0.01, 0.1, 1.0, 100.0],
        limb_error=errors,
    )
    assert of_limbs.least_reliable_scale(scales, "still", 0.1) == pytest.approx(least, nan_ok=True)
    assert of_limbs.largest_reliable_scale(scales, "still", 0.1) == pytest.approx(largest, nan_ok=True)
    assert np.isnan(of_limbs.least_reliable_scale(scales, "shaky", 0.1)), "no such rows"


@pytest.mark.parametrize(
    ("times", "broken"),
    [([0, 1, 2, 3], 0), ([0, 0, 2, 3], 0), ([1, 1, 2, 3], 1), ([0, 1, 2, 2], 1), ([0, 3, 1, 4], 2)],
)
def test_each_broken_constraint_of_time_counts(times: list[int], broken: int) -> None:
    path = table(sample=[0, 1, 2, 3], rate_to_rate=times)
    assert of_actions.broken_time_constraints(path) == broken
    assert of_actions.broken_time_constraints(path.iloc[[2, 0, 3, 1]]) == broken
