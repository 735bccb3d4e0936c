"""Tests of postures that are sampled from the action model: mozerov2006 figure 4."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.cli.compose import compose
from pipeline.core import action_model, posture
from pipeline.storage import tables
from pipeline.studies.actions import posture_samples
from pipeline.studies.actions.posture_samples import PostureSampling, SampledPostures
from pipeline.studies.study import SweepInputs
from tests.recordings import reading
from tests.rejects import rejects
from tests.strategies import seeds

Measure = Callable[..., SampledPostures]


@pytest.fixture(scope="module")
def measure() -> Measure:
    """Return a function that runs the sweep over posture samples on a few synthetic performances."""
    experiment = compose(["experiment=mozerov2006_fig4", "scale=smoke"])
    dataset, model = experiment.dataset, experiment.model
    clips = experiment.data.request(dataset.corpus, experiment.skeleton, experiment.seed, 1).make()
    postures = dataset.build(clips, workers=1)
    action = model.learn(postures, workers=1)

    def measure(options: PostureSampling, *, workers: int = 1, seed: int = 1) -> SampledPostures:
        return options.measure(SweepInputs(clips, postures, action, model, workers, seed))

    return measure


def test_accepted_draws_lie_within_the_bounds_and_the_others_without(measure: Measure) -> None:
    result = measure(PostureSampling(measured=300, resamples=3))
    of_kind = result.rows.set_index(["kind", "frame"])
    accepted, outside = of_kind.loc["accepted"], of_kind.loc["outside"]
    shares = ["acceptance", "bounds_held_fraction"]
    assert (accepted[shares] == 1.0).all(axis=None)
    assert (outside[shares] == 0.0).all(axis=None)
    assert (of_kind.loc["training"]["draws"] == 6).all()
    distances = ["spread_mm", "nearest_training_mm", "nearest_training_max_mm"]
    assert (accepted[distances] < outside[distances]).all(axis=None)
    assert (of_kind["limb_direction_norm_min"] < 1.0).all()
    assert (of_kind["limb_direction_norm_max"] > 1.0).all()


def test_the_postures_shown_are_accepted_and_frames_count_from_one(measure: Measure) -> None:
    """All sampled bodies have the limb lengths of the mean performance, and frame 1 is its first sample."""
    result = measure(PostureSampling(frames=[1, 100], samples=5, measured=20, resamples=3))
    np.testing.assert_allclose(result.bodies[:, 0], result.mean_performance[[0, 99]], rtol=1e-12)
    lengths = posture.limb_lengths(result.mean_performance).limbs_mm
    for body in result.bodies[:, 1:]:
        np.testing.assert_allclose(posture.limb_lengths(body).limbs_mm, lengths, rtol=1e-9)


def test_sampled_postures_reproduce_over_seeds_and_workers(measure: Measure) -> None:
    options = PostureSampling(measured=150, resamples=3)
    first, second, other = (measure(options, workers=w, seed=s) for w, s in ((1, 1), (2, 1), (1, 2)))
    for field in fields(first):
        np.testing.assert_array_equal(getattr(first, field.name), getattr(second, field.name))
    assert not np.array_equal(first.bodies[:, 1:], other.bodies[:, 1:])
    np.testing.assert_array_equal(first.bodies[:, 0], other.bodies[:, 0])


@given(seed=seeds)
@settings(max_examples=15)
def test_the_nearest_posture_is_the_nearest_of_all(seed: int) -> None:
    generator = np.random.default_rng(seed)
    joints, recorded = (
        generator.uniform(-1e3, 1e3, (70, 4, 3)),
        generator.uniform(-1e3, 1e3, (3, 6, 4, 3)),
    )
    recorded[1, 2] = joints[5]
    expected = np.linalg.norm(joints[:, None, None] - recorded, axis=-1).mean(axis=-1).min(axis=-1)
    result = posture_samples.nearest(joints, recorded, 1)
    np.testing.assert_allclose(result, expected, atol=0.01)
    assert result[5, 1] < 0.01


@given(seed=seeds, bound=st.floats(0.5, 5.0))
@settings(max_examples=20)
def test_what_lies_beyond_the_bounds_does_so_in_every_coordinate(seed: int, bound: float) -> None:
    generator = np.random.default_rng(seed)
    performances = generator.standard_normal((6, 4, 3))
    learnt_model = action_model.learn(performances)
    drawn = posture_samples.beyond(learnt_model, 50, generator, at=2, bound=bound)
    away = np.abs(drawn - learnt_model.mean[2]) / learnt_model.standard_deviation[2]
    assert (away >= bound + posture_samples.BEYOND[0] - 1e-9).all()
    assert (away <= bound + posture_samples.BEYOND[1] + 1e-9).all()
    assert not action_model.accepted(learnt_model, drawn, at=2, bound=bound).any()


def test_the_figure_shows_what_is_in_its_table(smoke_results: Path) -> None:
    folder = smoke_results / "synthetic" / "smoke" / "mozerov2006_fig4"
    recording = folder / "recording.rrd"
    names = {"world/mean_performance", "about", "world/frame_10/mean", "world/frame_40/accepted_8"}
    assert names <= set(reading.entities(recording))
    drawn = tables.read(folder / "table.csv")
    assert len(drawn["x_mm"]) == 2 * 9 * 15
    index, joints = reading.read_column(recording, "world/mean_performance", "Points3D:positions", "frame")
    assert list(index) == list(range(1, 101))
    mean = (drawn["frame"] == 40) & (drawn["draw"] == -1)
    np.testing.assert_allclose(1e3 * joints[39, :, 2], drawn["z_mm"][mean], atol=0.01)


@pytest.mark.parametrize(
    ("override", "rejection"),
    [
        ("sweep.frames=[0]", rejects("out_of_range", "sweep.frames[0]", value=0)),
        ("sweep.frames=[101]", rejects("out_of_range", "sweep.frames", value=101)),
        ("sweep.frames=[]", rejects("not_distinct", "sweep.frames")),
        ("sweep.frames=[10,10]", rejects("not_distinct", "sweep.frames")),
        ("sweep.samples=0", rejects("out_of_range", "sweep.samples", value=0)),
        ("sweep.samples=30 sweep.measured=20", rejects("out_of_range", "sweep.samples", value=30)),
    ],
)
def test_frames_that_are_none_are_refused(override: str, rejection: AbstractContextManager) -> None:
    with rejection:
        compose(["experiment=mozerov2006_fig4", *override.split()]).validate()


def test_postures_together_have_the_covariance_and_the_bounds_of_the_performances() -> None:
    rng = np.random.default_rng(3)
    performances = rng.standard_normal((12, 4)) @ rng.standard_normal((4, 4)) + 5.0
    postures = posture_samples.together(performances, 40_000, rng, bound=8.0)
    covariance = np.cov(performances.T)
    np.testing.assert_allclose(np.cov(postures.T), covariance, atol=0.05 * np.abs(covariance).max())
    np.testing.assert_allclose(postures.mean(axis=0), performances.mean(axis=0), atol=0.1)
    narrow = posture_samples.together(performances, 500, rng, bound=0.5) - performances.mean(axis=0)
    variances, axes = np.linalg.eigh(covariance)
    assert 0.49 < np.abs(narrow @ axes / np.sqrt(variances)).max() <= 0.5
    least = posture_samples.together(performances, 5, rng, bound=1e-9)  # ends, and is the mean
    np.testing.assert_allclose(least, np.tile(performances.mean(axis=0), (5, 1)), atol=1e-7)


def test_a_tail_worked_out_in_the_head() -> None:
    distances = np.arange(101.0) + 20.0  # 20 to 120 mm, 20 of them beyond 100 mm
    tail = posture_samples.tail(distances)
    assert tail["nearest_training_p95_mm"] == 115.0
    assert tail["beyond_100mm_percent"] == pytest.approx(100.0 * 20 / 101)
