"""Tests of tracking with held-out performances: which data the tracker reads, and how much the prior helps."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import asdict, fields, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.cli.compose import compose
from pipeline.core import camera, posture
from pipeline.core.choice import evenly
from pipeline.core.posture.frames import REST
from pipeline.core.tracking import Likelihood
from pipeline.storage import tables
from pipeline.studies.actions.dataset import Postures
from pipeline.studies.actions.held_out import (
    HeldOut,
    LeaveOut,
    learn_without,
    left_out,
    performances_of,
    standing,
)
from pipeline.studies.actions.model import ActionSpaceModel
from pipeline.studies.actions.tracking import HeldOutTracking, TrackingErrors
from pipeline.studies.actions.tracking_trial import FILTERS, METHODS, Condition, Trial
from pipeline.studies.occlusion import occlusion
from pipeline.studies.study import SweepInputs
from tests.recordings import reading
from tests.rejects import rejects
from tests.strategies import seeds

VIEW_RAD = float(np.radians(45.0))
QUICK = HeldOutTracking(particles=[60], tracked=2, noise_mm=[10.0], occluded=[0.0, 0.5])


def built(*overrides: str) -> Postures:
    """Return the postures of a few synthetic performances."""
    experiment = compose(["experiment=mozerov2006_tracking", "scale=smoke", *overrides])
    dataset = experiment.dataset
    clips = experiment.data.request(dataset.corpus, experiment.skeleton, experiment.seed, 1).make()
    return dataset.build(clips, workers=1)


@pytest.fixture(scope="module")
def postures() -> Postures:
    # Two performances of each person: leaving out one differs from leaving out a whole person.
    return built("data.performances.subjects=5")


def measure(
    options: HeldOutTracking, postures: Postures, *, workers: int = 1, seed: int = 1
) -> TrackingErrors:
    """Return the result of the tracking sweep, which learns its own action models."""
    inputs = SweepInputs(None, postures, None, ActionSpaceModel(), workers, seed)
    return options.measure(inputs)


@pytest.fixture(scope="module")
def measured(postures: Postures) -> TrackingErrors:
    return measure(QUICK, postures, seed=5)


@pytest.fixture(scope="module")
def trial(postures: Postures) -> Trial:
    """Tracking trial of the fourth performance, with an action model learnt from all other performances."""
    everyone = performances_of(postures)
    out = np.arange(len(everyone)) == 3
    held_out = learn_without(ActionSpaceModel(), everyone, out)
    return Trial(held_out, everyone[3], VIEW_RAD, (3, 1), (0,), occlusion_frames=10.0)


def changed(postures: Postures, which: np.ndarray, seed: int = 0) -> Postures:
    """Return a copy of the data set in which the data of some performances are altered by large random numbers."""
    generator = np.random.default_rng(seed)
    frames = np.repeat(which, np.diff(postures.first))
    other = {}
    for name, rows in (
        ("postures", frames), ("positions", frames), ("limbs_mm", which), ("pelvis_mm", which),
        ("shoulders_mm", which), ("floor_mm", which),
    ):  # fmt: skip
        values = np.array(getattr(postures, name))
        values[rows] += 0.3 * values.std() * generator.standard_normal(values[rows].shape)
        other[name] = values
    return replace(postures, **other)


def numbers(held_out: HeldOut) -> list[np.ndarray]:
    """Return all numbers of a learnt action model, as arrays."""
    action = held_out.action
    return [
        action.space.mean, action.space.components, action.space.eigenvalues, action.model.mean,
        action.model.standard_deviation, action.synchronized, action.distances, action.disparity,
        np.array([action.smoothness, action.median, held_out.own_step]),
        np.array([v for v in asdict(held_out.dynamics).values() if isinstance(v, float)]), held_out.misfit_mm,
    ]  # fmt: skip


# --- nothing is seen that may not be ----------------------------------------------------------------------


@pytest.mark.parametrize("leave_out", list(LeaveOut))
def test_no_fold_sees_its_performance(postures: Postures, leave_out: LeaveOut) -> None:
    people = postures.person
    out = left_out(people, 2, leave_out)
    assert out[2]
    assert out.sum() == (1 if leave_out is LeaveOut.performance else (people == people[2]).sum())
    before = numbers(learn_without(ActionSpaceModel(), performances_of(postures), out))
    perturbed = performances_of(changed(postures, out))
    for a, b in zip(before, numbers(learn_without(ActionSpaceModel(), perturbed, out)), strict=True):
        np.testing.assert_array_equal(a, b)
    another = np.arange(len(people)) == int(np.flatnonzero(~out)[1])
    messages = numbers(
        learn_without(ActionSpaceModel(), performances_of(changed(postures, another, seed=1)), out)
    )
    assert any(a.shape != b.shape or not np.array_equal(a, b) for a, b in zip(before, messages, strict=True))


def test_a_person_who_performs_twice_leaves_whole() -> None:
    people = np.array(["a", "a", "b", "c"])
    np.testing.assert_array_equal(left_out(people, 1, LeaveOut.person), [True, True, False, False])
    np.testing.assert_array_equal(left_out(people, 1, LeaveOut.performance), [False, True, False, False])
    with rejects("too_few_performances", "leave one person out, performance 0", count=1):
        left_out(np.array(["a", "a", "b"]), 0, LeaveOut.person)


def test_hidden_joints_are_never_read(trial: Trial) -> None:
    """The image and the track are the same if hidden joints are moved by ten metres."""
    for share in (0.25, 0.5, 0.8):
        condition = Condition(40, 10.0, share)
        image = trial.seen(condition)
        hidden = np.isnan(image).any(axis=-1)
        assert hidden.any()
        joints = trial.performance.joints_mm.copy()
        joints[hidden] += 1e4
        elsewhere = replace(trial, performance=replace(trial.performance, joints_mm=joints))
        np.testing.assert_array_equal(elsewhere.seen(condition), image)
        result = trial.filtered("prior", condition, image)
        np.testing.assert_array_equal(result.visible, (~hidden).sum(axis=1))
        again = elsewhere.filtered("prior", condition, elsewhere.seen(condition))
        np.testing.assert_array_equal(again.posture, result.posture)
        np.testing.assert_array_equal(again.log_evidence, result.log_evidence)


def test_joints_that_are_seen_are_read(trial: Trial) -> None:
    condition = Condition(40, 10.0, 0.25)
    image = trial.seen(condition)
    moved = trial.filtered("prior", condition, np.add(image, [0.0, 100.0]))
    assert not np.array_equal(moved.posture, trial.filtered("prior", condition, image).posture)


def test_conditions_do_not_influence_each_other(trial: Trial) -> None:
    """Tracks under one condition do not depend on the order and number of conditions that are computed."""
    target = [Condition(30, 10.0, 0.0), Condition(50, 10.0, 0.25), Condition(30, 0.0, 0.5)]
    among = trial.all(target, target[1])
    for order in ([2, 1, 0], [1], [0, 1]):
        result = trial.all([target[n] for n in order], target[1])
        of_one = len(METHODS)
        rows = np.concatenate([np.arange(of_one) + of_one * n for n in order])
        pd.testing.assert_frame_equal(result.rows, among.rows.iloc[rows].reset_index(drop=True))
        np.testing.assert_array_equal(result.joints, among.joints)


# --- what the prior is worth ------------------------------------------------------------------------------


def errors_by_method(measured: TrackingErrors) -> pd.DataFrame:
    """Return the tracking errors with a column for each method, and a row for each condition and performance."""
    index = ["leave_out", "varied", "particles", "noise_mm", "occluded", "performance"]
    return measured.rows.pivot(index=index, columns="method", values="error_mm")


def test_the_prior_beats_no_prior_at_few_particles(measured: TrackingErrors) -> None:
    errors = errors_by_method(measured)
    mean = errors.groupby([name for name in errors.index.names if name != "performance"]).mean()
    for other in ("no_prior", "no_prior_own_step", "mean_linear_phase"):
        assert (mean["prior"] < mean[other]).all(), other
    finite = mean.loc["performance"]
    for other in ("no_prior", "no_prior_own_step"):  # by far, where the model knows the person
        assert (finite["prior"] < 0.8 * finite[other]).all(), other


def test_the_best_phase_is_no_worse_than_a_constant_rate(measured: TrackingErrors) -> None:
    errors = errors_by_method(measured)
    assert (errors["mean_best_phase"] <= errors["mean_linear_phase"]).all()
    # Neither looks at the image.
    assert (errors["mean_best_phase"].groupby(["leave_out", "performance"]).nunique() == 1).all()


def test_the_rows_are_what_they_are_said_to_be(measured: TrackingErrors) -> None:
    rows, target = measured.rows, QUICK.conditions
    assert rows["varied"].unique().tolist() == ["particles", "noise", "occlusion"]
    assert len(rows) == 2 * len(target) * 2 * len(METHODS)
    # The same condition is the same track, whatever is varied.
    owner = {varied: each.reset_index(drop=True) for varied, each in rows.groupby("varied")}
    pd.testing.assert_frame_equal(
        owner["particles"].drop(columns="varied"), owner["noise"].drop(columns="varied")
    )
    assert np.isnan(measured.shown_image).any()
    displayed = rows[
        (rows["leave_out"] == "performance")
        & (rows["varied"] == "occlusion")
        & (rows["occluded"] == QUICK.demonstrated.occluded)
    ].set_index(["performance", "method"])["error_mm"]
    names = list(dict.fromkeys(rows["performance"]))
    name = names[list(measured.tracked).index(measured.shown[0])]
    np.testing.assert_allclose(
        measured.shown_error_mm.mean(axis=1), displayed[name][list(METHODS)], rtol=1e-12
    )
    assert not rows["pruned_fraction"][rows["method"] != "prior"].any()
    aspace = rows.groupby(["leave_out", "performance"])["aspace_error_mm"].first().unstack(0)
    assert (aspace["performance"] < aspace["person"]).all()


def test_seeds_reproduce(postures: Postures) -> None:
    small = replace(QUICK, particles=[20], tracked=1, leave_out=[LeaveOut.performance], occluded=[0.25])
    first, second, other = (measure(small, postures, seed=seed) for seed in (1, 1, 2))
    for field in fields(first):
        np.testing.assert_array_equal(getattr(first, field.name), getattr(second, field.name))
    same = first.rows["error_mm"] == other.rows["error_mm"]
    np.testing.assert_array_equal(same, ~first.rows["method"].isin(FILTERS))


def test_one_person_alone_is_not_left_out(postures: Postures) -> None:
    alone = replace(postures, person=np.full(len(postures.person), "a"))
    result = measure(replace(QUICK, particles=[5], tracked=1, occluded=[0.0]), alone)
    assert list(result.leave_out) == ["performance"]
    assert result.remarks == ["tracking: there is only one person, so no person is left out"]
    with rejects("too_few_people", "sweep.leave_out", count=1):
        measure(replace(QUICK, leave_out=[LeaveOut.person]), alone)


# --- the camera and what it sees --------------------------------------------------------------------------


@given(seed=seeds, share=st.floats(0.0, 0.9), mean_frames=st.floats(10.0, 30.0))
@settings(max_examples=25)
def test_joints_are_hidden_in_runs(seed: int, share: float, mean_frames: float) -> None:
    frames, joints = 4000, 15
    hidden = occlusion(frames, joints, share, mean_frames, np.random.default_rng(seed))
    assert hidden.mean() == pytest.approx(share, abs=0.15)
    if share > 0.1:
        begins = (~hidden[:-1] & hidden[1:]).sum() + hidden[0].sum()
        assert hidden.sum() / begins == pytest.approx(mean_frames, rel=0.4)
    more = occlusion(frames, joints, min(0.9, share + 0.2), mean_frames, np.random.default_rng(seed))
    assert not (hidden & ~more).any()  # the same runs, and longer ones


def test_noise_has_the_size_it_is_said_to_have(trial: Trial) -> None:
    joints = np.repeat(trial.performance.joints_mm, 20, axis=0)
    longer = replace(trial, performance=replace(trial.performance, joints_mm=joints))

    def seen(noise: float) -> np.ndarray:
        return longer.seen(Condition(1, noise, 0.0))

    assert (seen(12.0) - seen(0.0)).std() == pytest.approx(12.0, rel=0.02)
    np.testing.assert_allclose(seen(12.0) - seen(0.0), 3.0 * (seen(4.0) - seen(0.0)), atol=1e-9)


def test_particles_that_are_no_posture_have_no_weight(trial: Trial) -> None:
    """A particle whose thigh points against its rest direction gets weight zero; other particles are unchanged."""
    space, body = trial.held_out.action.space, trial.performance.body
    postures = space.postures(trial.held_out.action.model.mean[:7])
    thigh = slice(1 + 3 * 4, 1 + 3 * 5)
    postures[3, thigh] = -REST[4]
    # An aSpace that is all of the 37 numbers lets them be given as they are.
    whole = replace(space, mean=np.zeros(37), components=np.eye(37))
    held_out = replace(trial.held_out, action=replace(trial.held_out.action, space=whole))
    joints = held_out.joints(postures, body)
    others = np.arange(7) != 3
    assert np.isnan(joints[3]).all()
    np.testing.assert_array_equal(joints[others], posture.joints(postures[others], body))
    image = camera.project(joints[[0]], VIEW_RAD)
    density = Likelihood(image, VIEW_RAD, 10.0, place_known=False).log_density(joints, 0)
    assert np.isneginf(density[3])
    assert np.isfinite(density[others]).all()


# --- performances as they stand ---------------------------------------------------------------------------


@given(seed=seeds)
@settings(max_examples=10)
def test_a_performance_stands_alike_wherever_it_was_recorded(trial: Trial, seed: int) -> None:
    generator = np.random.default_rng(seed)
    performance = trial.performance
    angle = generator.uniform(-np.pi, np.pi)
    cos, sin = np.cos(angle), np.sin(angle)
    position = generator.uniform(-5e3, 5e3, 3)
    recorded = performance.joints_mm @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1.0]]) + position
    np.testing.assert_allclose(
        standing(recorded, performance.postures, position[2]), performance.joints_mm, atol=1e-6
    )


@pytest.mark.parametrize("frame", posture.FRAMES)
def test_joints_and_postures_of_a_performance_belong_together(frame: str) -> None:
    """Joints computed from the postures are within a mean distance of 10 mm of the recorded joints."""
    performance = performances_of(built(f"dataset.frame={frame}"))[3]
    again = posture.joints(performance.postures, performance.body, frame=performance.frame)
    assert np.linalg.norm(again - performance.joints_mm, axis=-1).mean() < 10.0
    assert np.abs(performance.joints_mm[:, 8, :2]).max() < 1e-9


# --- the figure -------------------------------------------------------------------------------------------


def test_the_rows_of_the_figure_are_means_of_performances(smoke_results: Path) -> None:
    folder = smoke_results / "synthetic" / "smoke" / "mozerov2006_tracking"
    recording = folder / "recording.rrd"
    target = {f"{top}/{m}" for m in METHODS for top in ("world/tracked", "curves/error_mm")}
    assert target | {"world/original", "image/observed", "about"} <= set(reading.entities(recording))
    table = tables.read(folder / "table.csv")
    each = tables.read(folder / "table_performances.csv")
    assert len(each["error_mm"]) == 2 * len(table["error_mm"])
    key = ("leave_out", "varied", "particles", "noise_mm", "occluded", "method")
    for row, error in enumerate(table["error_mm"]):
        start = np.all([each[k] == table[k][row] for k in key], axis=0)
        assert error == pytest.approx(each["error_mm"][start].mean(), rel=1e-8)
        assert table["error_sd_mm"][row] == pytest.approx(each["error_mm"][start].std(ddof=1), rel=1e-6)


# --- options ----------------------------------------------------------------------------------------------


def test_one_quantity_is_varied_at_a_time() -> None:
    options = HeldOutTracking(particles=[100, 2000, 500, 50], tracked=0)
    target = options.conditions
    assert [c.particles for v, c in target if v == "particles"] == [50, 100, 500, 2000]
    assert {c.particles for v, c in target if v != "particles"} == {500}
    assert {(c.noise_mm, c.occluded) for v, c in target if v == "particles"} == {(10.0, 0.0)}
    assert [c.noise_mm for v, c in target if v == "noise"] == [0.0, 10.0, 30.0]
    assert [c.occluded for v, c in target if v == "occlusion"] == [0.0, 0.25, 0.5]
    assert options.demonstrated == Condition(500, 10.0, 0.25)
    assert HeldOutTracking(particles=[10, 30, 20], tracked=0).conditions[-1][1].particles == 20
    assert list(evenly(3, 7)) == [0, 3, 6]
    assert list(evenly(0, 3)) == list(evenly(9, 3)) == [0, 1, 2]


@pytest.mark.parametrize(
    ("override", "rejection"),
    [
        ("sweep.particles=[0]", rejects("out_of_range", "sweep.particles[0]", value=0)),
        ("sweep.particles=[]", rejects("not_distinct", "sweep.particles")),
        ("sweep.noise_mm=[1,1]", rejects("not_distinct", "sweep.noise_mm")),
        ("sweep.occluded=[0.95]", rejects("out_of_range", "sweep.occluded", value=0.95)),
        ("sweep.occlusion_frames=0.5", rejects("out_of_range", "sweep.occlusion_frames", value=0.5)),
        ("sweep.baseline_noise_mm=-1", rejects("out_of_range", "sweep.baseline_noise_mm", value=-1.0)),
        ("sweep.leave_out=[]", rejects("not_distinct", "sweep.leave_out")),
        ("sweep.view_angle_deg=nan", rejects("out_of_range", "sweep.view_angle_deg")),
        ("sweep.tracked=-1", rejects("out_of_range", "sweep.tracked", value=-1)),
    ],
)
def test_options_that_cannot_be_are_refused(override: str, rejection: AbstractContextManager) -> None:
    with rejection:
        compose(["experiment=mozerov2006_tracking", override]).validate()


def test_a_fold_of_no_such_kind_is_refused_on_composition() -> None:
    with pytest.raises(Exception, match=r"sweep\.leave_out"):
        compose(["experiment=mozerov2006_tracking", "sweep.leave_out=[walker]"])
