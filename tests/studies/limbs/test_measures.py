"""Tests of the measures of limbs in bootstrap replicates, and of the baselines of limbs."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from pipeline.core.limb_chain import WALKER14
from pipeline.core.statistics import rank_correlation
from pipeline.papers import Measure
from pipeline.studies import evaluation
from pipeline.studies.limbs import baselines
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.one_limb import RootErrorSweep
from pipeline.studies.limbs.trials import ROOT
from pipeline.studies.registry import all_measures
from pipeline.studies.replicated import Replicated, replicate
from tests.studies.limbs.inputs import stretches_of

MEASURES = all_measures()

CLIPS = 12


def trials() -> pd.DataFrame:
    """Table of random limb errors at four relative radii and four root errors, with four trials of each per clip."""
    rng = np.random.default_rng(5)
    rows = CLIPS * 16
    return pd.DataFrame(
        {
            "clip": np.repeat([f"clip {n}" for n in range(CLIPS)], 16),
            "action": np.repeat(["walking", "dance", "a walk"] * (CLIPS // 3), 16),
            "camera": "still",
            "adjust": "refined",
            "radius_scale": np.tile([0.1, 1.0, 2.0, 10.0], rows // 4),
            "root_error_ratio": np.tile([0.0, 0.1, 0.2, 0.4], rows // 4),
            "reconstructibility": rng.lognormal(size=rows).round(1) + 0.1,
            "limb_error": rng.lognormal(-2.0, 1.0, size=rows),
            "child_error_ratio": 0.1 + np.tile([0.0, 0.1, 0.2, 0.4], rows // 4) * rng.lognormal(size=rows),
        }
    )


WANTED = [
    Measure("dividing_reconstructibility", {"table": "fig", "found": 0.1}),
    Measure("rank_correlation_of", {"table": "fig", "column": "reconstructibility", "by": "limb_error"}),
    Measure("mean_deviation", {"table": "fig", "column": "limb_error", "by": "radius_scale"}),
    Measure("reliable_root_error", {"table": "fig", "camera": "still", "high": 0.3}),
    Measure("least_unreliable_root_error", {"table": "fig", "camera": "still", "high": 0.3}),
    Measure("least_reliable_scale", {"table": "fig", "camera": "still", "found": 0.01}),
    Measure("largest_reliable_scale", {"table": "fig", "camera": "still", "found": 0.01}),
    Measure("mean_of_walking", {"table": "fig", "column": "limb_error", "camera": "still"}),
    Measure(
        "rank_correlation_within",
        {"table": "fig", "column": "reconstructibility", "by": "limb_error", "within": "action"},
    ),
]


@pytest.mark.parametrize("measure", WANTED, ids=lambda measure: measure.name)
def test_every_replicate_is_what_its_rows_give(measure: Measure) -> None:
    drawn = replicate(["fig"], {"fig": trials()}, seed=3)
    assert drawn is not None
    rows = drawn.tables["fig"]
    assert isinstance(rows, Replicated)
    assert rows.weights.shape == (2000 + CLIPS, CLIPS), "all rows of a clip together, and each clip left out"
    fast = np.asarray(evaluation.evaluate(measure, MEASURES, drawn.tables, drawn.size))
    assert fast.shape == (drawn.size,) == (2000 + CLIPS,)
    assert len(np.unique(fast[np.isfinite(fast)])) > 1
    for b in range(8):
        slow = evaluation.evaluate(measure, MEASURES, {"fig": rows.drawn(b)})
        assert fast[b] == pytest.approx(slow, rel=1e-9, nan_ok=True)


def test_the_correlation_is_spearmans() -> None:
    table = trials()
    result = evaluation.evaluate(WANTED[1], MEASURES, {"fig": table})
    expected = rank_correlation(table["reconstructibility"].to_numpy(), table["limb_error"].to_numpy())
    assert result == pytest.approx(expected, rel=1e-12)


def test_people_are_drawn_and_not_their_clips_where_they_are_known() -> None:
    table = trials().assign(person="p1")
    assert replicate(["fig"], {"fig": table}) is None, "a single person"


# --- baselines --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def stretches() -> LimbStretches:
    """Motion stretches of a few synthetic clips."""
    return stretches_of("park2011_fig4")


def test_a_skeleton_that_hangs_has_its_feet_below_its_root_and_its_head_above(
    stretches: LimbStretches,
) -> None:
    root, lengths = stretches.positions[0][:, ROOT], stretches.lengths_mm[0]
    result = baselines.hanging(root, lengths) - root[:, None]
    owner = dict(zip(WALKER14.limbs, lengths, strict=True))
    position = WALKER14.joints.index
    below = -(owner["left_knee"] + owner["left_ankle"])
    np.testing.assert_allclose(result[:, position("left_ankle")], [[0.0, 0.0, below]] * len(root), atol=1e-9)
    above = owner["sternum"] + owner["head"]
    np.testing.assert_allclose(result[:, position("head")], [[0.0, 0.0, above]] * len(root), atol=1e-9)


def test_the_mean_pose_is_the_pose_that_stands_still_and_errs_least(stretches: LimbStretches) -> None:
    truth = stretches.positions[0]
    root = truth[:, ROOT]
    result = baselines.mean_pose(root, truth)
    assert np.ptp(result - root[:, None], axis=0).max() < 1e-9
    off = np.square(result - truth).sum()
    rng = np.random.default_rng(2)
    assert all(np.square(result + rng.normal(0, 5, (1, 15, 3)) - truth).sum() > off for _ in range(5))


def test_a_limb_that_does_nothing_is_wrong_by_what_its_parent_is(stretches: LimbStretches) -> None:
    trial = RootErrorSweep(trials=2, cameras=[Camera.still]).trial(stretches, 1, Camera.still, 1)
    far = baselines.limb_errors(trial, moved=np.array([1e5, 0.0, 0.0]))
    for name, error in baselines.limb_errors(trial).items():
        assert 0.0 < error < 2.0
        assert far[name] == pytest.approx(1e5 / trial.length, abs=2.5)
    assert baselines.limb_errors(trial, scale=0.0)["hanging_error"] == pytest.approx(
        float(np.linalg.norm(trial.relative, axis=1).mean()) / trial.length
    )


def test_a_correlation_between_cameras_is_none_within_them() -> None:
    table = pd.DataFrame(
        {
            "camera": ["still"] * 4 + ["shaky"] * 4,
            "x": [1, 2, 3, 4, 11, 12, 13, 14],
            "y": [8, 5, 7, 6, 2, 1, 4, 3],
        }
    )
    pooled = evaluation.evaluate(
        Measure("rank_correlation_of", {"table": "t", "column": "x", "by": "y"}), MEASURES, {"t": table}
    )
    within = Measure("rank_correlation_within", {"table": "t", "column": "x", "by": "y", "within": "camera"})
    assert pooled < -0.7
    assert evaluation.evaluate(within, MEASURES, {"t": table}) == pytest.approx(0.6)
