"""Tests of intervals in tables: they equal the intervals of verdicts, and a single person or clip has no interval."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings

from pipeline.core.bootstrap import (
    cluster_interval,
    percentile_interval,
    weighted_means,
    weighted_medians,
)
from pipeline.studies import measures, replicated, rows
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
    """Return a table of trials under two conditions, with larger differences between clips than within a clip."""
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
    result = rows.set_index("camera")[["error_median_low", "error_median_high"]]
    drawn = replicate(["figure/table_trials"], {"figure/table_trials": table})
    assert drawn is not None
    for camera in ("still", "shaky"):
        replicates = measures.median(drawn.tables["figure/table_trials"], "error", f"camera == '{camera}'")
        ends = percentile_interval(np.asarray(replicates)[: drawn.size - drawn.left_out])
        assert result.loc[camera].tolist() == pytest.approx([float(end) for end in ends], rel=1e-12)
    low, high = result.loc["still", ["error_median_low", "error_median_high"]]
    assert low <= table.loc[table["camera"] == "still", "error"].median() <= high
    np.testing.assert_allclose(result.loc["shaky"], result.loc["still"] + 1.0, rtol=1e-12)


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
    finite = replicate(["limbs"], {"limbs": table, "limbs/table_ingest": clips})
    assert alone is not None
    assert finite is not None
    assert (alone.clusters, finite.clusters) == (4, 3)
    drawn = finite.tables["limbs"]
    assert isinstance(drawn, Replicated)
    assert all(
        ("a" in set(drawn.drawn(b)["clip"])) == ("b" in set(drawn.drawn(b)["clip"])) for b in range(50)
    )


def test_groups_that_hold_other_people_or_no_label_are_drawn_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    table = trials(np.random.default_rng(3), 9)
    table = table[(table["camera"] == "still") | (table["clip"] != "clip_4")].sample(frac=1.0, random_state=1)
    table["view"] = np.arange(len(table)) % 3
    table.loc[table.index[:5], "view"] = np.nan
    columns = {"mean": ("error", "mean"), "median": ("error", "median")}
    monkeypatch.setattr(replicated, "_GROUPS_AT_A_TIME", 2)
    rows = aggregate(table, ["camera", "view"], columns, list(columns)).set_index(["camera", "view"])
    assert len(rows) == 6
    for key, group in table.groupby(["camera", "view"]):
        for name, statistic in (("mean", weighted_means), ("median", weighted_medians)):
            ends = interval_over_clusters(group["clip"].to_numpy(), group["error"].to_numpy(), statistic)
            result = rows.loc[key, [f"{name}_low", f"{name}_high"]].tolist()
            assert result == pytest.approx([float(end) for end in ends], rel=1e-12)


def test_of_very_many_people_groups_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    table = pd.DataFrame({"person": [f"p{n:03d}" for n in range(60)], "x": rng.lognormal(size=60)})
    every = replicate(["t"], {"t": table})
    monkeypatch.setattr(replicated, "MAX_LEFT_OUT", 15)
    replicated._weights.cache_clear()
    some = replicate(["t"], {"t": table})
    replicated._weights.cache_clear()
    assert every is not None
    assert some is not None
    assert (every.left_out, some.left_out, some.clusters) == (60, 15, 60)
    np.testing.assert_array_equal(some.tables["t"].weights[:-15], every.tables["t"].weights[:-60])
    np.testing.assert_array_equal(some.tables["t"].weights[-15:].sum(axis=1), 56.0)
    np.testing.assert_array_equal(some.tables["t"].weights[-15:].sum(axis=0), 14.0)
    values = [np.asarray(measures.mean(drawn.tables["t"], "x")) for drawn in (every, some)]
    ends = [
        cluster_interval(float(table["x"].mean()), value[: -first.left_out], value[-first.left_out :], 60)
        for value, first in zip(values, (every, some), strict=True)
    ]
    width = ends[0][1] - ends[0][0]
    assert ends[1] == pytest.approx(ends[0], abs=0.1 * width)
    assert ends[1] != ends[0]


@given(seeds)
@settings(max_examples=10)
def test_means_of_groups_are_the_same_where_only_cells_with_rows_are_held(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cluster, group = rng.integers(0, 12, size=80), rng.integers(0, 9, size=80)
    weights = rng.multinomial(12, np.full(12, 1 / 12), size=30).astype(float)
    part = rows.Rows(pd.DataFrame(), cluster, weights, plain=False)
    result = rng.normal(size=80)
    with pytest.MonkeyPatch.context() as patch:
        dense = part.group_means(result, group, 10)
        patch.setattr(rows, "_MAX_DENSE", 0)
        sparse = part.group_means(result, group, 10)
    np.testing.assert_allclose(sparse[0], dense[0], rtol=1e-12)
    np.testing.assert_array_equal(sparse[1], dense[1])
