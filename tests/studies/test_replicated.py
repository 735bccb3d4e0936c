"""Intervals in tables: the same as those that verdicts rest on, and none where only one person or clip was drawn."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings

from pipeline.core.bootstrap import percentile_interval, weighted_means, weighted_medians
from pipeline.studies import measures
from pipeline.studies.replicated import (
    Replicated,
    Statistic,
    aggregate,
    interval_over_clusters,
    interval_over_people,
    replicate,
)
from tests.strategies import seeds


def trials(rng: np.random.Generator, clips: int) -> pd.DataFrame:
    """Errors of trials under two conditions: clips differ more than their trials."""
    clip = rng.integers(0, clips, size=60)
    clip[:clips] = range(clips)
    error = rng.normal(5.0, 1.0, size=clips)[clip] + rng.normal(0.0, 0.1, size=60)
    return pd.DataFrame(
        {
            "clip": [f"clip_{c}" for c in [*clip, *clip]],
            "scale": 1.0,
            "camera": np.repeat(["still", "shaky"], 60),
            "error": [*error, *(error + 1.0)],
        }
    )


@given(seeds)
@settings(max_examples=5)
def test_a_column_of_a_table_has_the_interval_that_a_verdict_on_it_rests_on(seed: int) -> None:
    table = trials(np.random.default_rng(seed), 7)
    medians = {"error_median": ("error", "median")}
    rows = aggregate(table, ["camera", "scale"], medians, list(medians))
    found = rows.set_index("camera")[["error_median_low", "error_median_high"]]
    drawn = replicate(["figure/table_trials"], {"figure/table_trials": table})
    assert drawn is not None
    for camera in ("still", "shaky"):
        replicates = measures.median(drawn.tables["figure/table_trials"], "error", f"camera == '{camera}'")
        ends = percentile_interval(np.asarray(replicates)[: drawn.size - drawn.left_out])
        assert found.loc[camera].tolist() == pytest.approx([float(end) for end in ends], rel=1e-12)
    low, high = found.loc["still", ["error_median_low", "error_median_high"]]
    assert low <= table.loc[table["camera"] == "still", "error"].median() <= high
    np.testing.assert_allclose(found.loc["shaky"], found.loc["still"] + 1.0, rtol=1e-12)


@given(seeds)
@settings(max_examples=5)
def test_all_rows_of_a_clip_are_drawn_together(seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=(12, 2))
    clip = np.array(["a", "b", "c", "d"])
    for statistic in (weighted_means, weighted_medians):
        once = interval_over_clusters(clip, values[:4], statistic)
        thrice = interval_over_clusters(np.repeat(clip, 3), np.repeat(values[:4], 3, axis=0), statistic)
        np.testing.assert_allclose(once, thrice, rtol=1e-12)


@pytest.mark.parametrize("statistic", [weighted_means, weighted_medians])
def test_one_clip_alone_has_no_interval_nor_has_what_is_not_known(statistic: Statistic) -> None:
    values = np.arange(12.0).reshape(6, 2)
    assert np.isnan(interval_over_clusters(np.full(6, "a"), values, statistic)).all()
    values[2, 1] = np.nan
    low, high = interval_over_clusters(np.array(list("aabbcc")), values, statistic)
    assert low[0] < high[0]
    assert np.isnan([low[1], high[1]]).all()
    assert np.isnan(interval_over_people(np.full(6, "a"), values)).all()


def test_clips_of_one_person_are_drawn_together_where_it_is_known_whose_they_are() -> None:
    table = pd.DataFrame({"clip": ["a", "b", "c", "d"], "error": [1.0, 2.0, 3.0, 4.0]})
    clips = pd.DataFrame({"clip": ["a", "b", "c", "d"], "person": ["one", "one", "two", "three"]})
    alone = replicate(["limbs"], {"limbs": table})
    known = replicate(["limbs"], {"limbs": table, "limbs/table_ingest": clips})
    assert alone is not None
    assert known is not None
    assert (alone.clusters, known.clusters) == (4, 3)
    drawn = known.tables["limbs"]
    assert isinstance(drawn, Replicated)
    assert all(
        ("a" in set(drawn.drawn(b)["clip"])) == ("b" in set(drawn.drawn(b)["clip"])) for b in range(50)
    )
