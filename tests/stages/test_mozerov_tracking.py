"""Figure 4 and the tracker: what may be seen of a held-out performance, and what the prior is worth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline import recordings
from pipeline.__main__ import compose
from pipeline.cli.figures import Outcome
from pipeline.core import action_model, posture
from pipeline.core.posture.frames import REST
from pipeline.core.tracking import joint_error
from pipeline.stages import dataset, ingest, model
from pipeline.storage import tables
from pipeline.storage.store import Artefact, Store
from pipeline.studies.actions import posture_samples, tracking
from pipeline.studies.actions.held_out import (
    HeldOut,
    frame_of,
    learn_without,
    left_out,
    performances_of,
    standing,
)
from pipeline.studies.actions.observed_joints import camera_of, observe, occlusion
from pipeline.studies.actions.tracking_conditions import Condition, conditions, demonstrated, tracked, ways
from pipeline.studies.options import ActionSpaceModel, PostureSamplesSweep, TrackingSweep
from pipeline.validation import InvalidInput
from tests.strategies import seeds

QUICK = TrackingSweep(particles=[60], tracked=2, noise_mm=[10.0], occluded=[0.0, 0.5])


def learnt(store: Store, *overrides: str) -> tuple[Artefact, Artefact]:
    """Postures and model of a few synthetic performances."""
    config = compose(["experiment=mozerov2006_fig4", "scale=smoke", *overrides])
    clips = ingest.run(config.data, config.skeleton, config.seed, 1, store, purpose=config.purpose)
    postures = dataset.run(config.dataset, clips, 1, store)
    return postures, model.run(config.model, postures, 1, store)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return Store(tmp_path_factory.mktemp("tracking"))


@pytest.fixture(scope="module")
def stages(store: Store) -> tuple[Artefact, Artefact]:
    return learnt(store)


@pytest.fixture(scope="module")
def measured(stages: tuple[Artefact, Artefact]) -> dict[str, Any]:
    return tracking.measure(QUICK, *stages, 1, 5)[0]


@pytest.fixture(scope="module")
def trial(stages: tuple[Artefact, Artefact]) -> tracking.Trial:
    """The fourth performance by a model of the others."""
    everyone = performances_of(stages[0])
    out = np.arange(len(everyone)) == 3
    model_of_others = learn_without(ActionSpaceModel(), everyone, out)
    return tracking.Trial(QUICK, model_of_others, everyone[3], camera_of(QUICK), (3, 1), (0,))


def changed(artefact: Artefact, which: np.ndarray, seed: int = 0) -> Artefact:
    """The same artefact but for some performances, of which nothing is as it was."""
    arrays = {name: np.array(values) for name, values in artefact.arrays.items()}
    generator = np.random.default_rng(seed)
    first = arrays["first"]
    frames = np.zeros(first[-1], dtype=bool)
    for m in np.flatnonzero(which):
        frames[first[m] : first[m + 1]] = True
    for name, rows in (
        ("postures", frames), ("positions", frames), ("limbs_mm", which), ("pelvis_mm", which),
        ("shoulders_mm", which), ("floor_mm", which),
    ):  # fmt: skip
        size = arrays[name].std()
        arrays[name][rows] += 0.3 * size * generator.standard_normal(arrays[name][rows].shape)
    return replace(artefact, arrays=arrays)


def numbers(held_out: HeldOut) -> list[np.ndarray]:
    """Everything that a model consists of."""
    action = held_out.action
    return [
        action.space.mean, action.space.components, action.space.eigenvalues, action.model.mean,
        action.model.standard_deviation, action.synchronized, action.distances, action.disparity,
        np.array([action.smoothness, action.median, held_out.own_step]),
        np.array([v for v in asdict(held_out.dynamics).values() if isinstance(v, float)]), held_out.misfit_mm,
    ]  # fmt: skip


# --- nothing is seen that may not be ----------------------------------------------------------------------


@pytest.mark.parametrize("leave_out", ["performance", "person"])
def test_no_fold_sees_its_performance(stages: tuple[Artefact, Artefact], leave_out: str) -> None:
    postures, _ = stages
    people = postures.arrays["person"]
    out = left_out(people, 2, leave_out)
    assert out[2]
    assert out.sum() == (1 if leave_out == "performance" else (people == people[2]).sum())
    before = numbers(learn_without(ActionSpaceModel(), performances_of(postures), out))
    perturbed = performances_of(changed(postures, out))
    for a, b in zip(before, numbers(learn_without(ActionSpaceModel(), perturbed, out)), strict=True):
        np.testing.assert_array_equal(a, b)
    another = np.arange(len(people)) == int(np.flatnonzero(~out)[1])
    heard = numbers(
        learn_without(ActionSpaceModel(), performances_of(changed(postures, another, seed=1)), out)
    )
    assert any(a.shape != b.shape or not np.array_equal(a, b) for a, b in zip(before, heard, strict=True))


def test_a_person_who_performs_twice_leaves_whole(stages: tuple[Artefact, Artefact]) -> None:
    people = np.array(["a", "a", "b", "c"])
    np.testing.assert_array_equal(left_out(people, 1, "person"), [True, True, False, False])
    np.testing.assert_array_equal(left_out(people, 1, "performance"), [False, True, False, False])
    with pytest.raises(InvalidInput, match=r"leave one person out, performance 0: too few .* received 1\)"):
        left_out(np.array(["a", "a", "b"]), 0, "person")


def test_hidden_joints_are_never_read(trial: tracking.Trial) -> None:
    """Wherever they are in truth, image and track are the same."""
    for share in (0.25, 0.5, 0.8):
        condition = Condition(40, 10.0, share)
        image = trial.seen(condition)
        hidden = np.isnan(image).any(axis=-1)
        assert hidden.any()
        joints = trial.performance.joints_mm.copy()
        joints[hidden] += 1e4
        elsewhere = replace(trial, performance=replace(trial.performance, joints_mm=joints))
        np.testing.assert_array_equal(elsewhere.seen(condition), image)
        found = trial.filtered("prior", condition, image)
        np.testing.assert_array_equal(found.seen, (~hidden).sum(axis=1))
        again = elsewhere.filtered("prior", condition, elsewhere.seen(condition))
        np.testing.assert_array_equal(again.posture, found.posture)
        np.testing.assert_array_equal(again.log_evidence, found.log_evidence)


def test_joints_that_are_seen_are_read(trial: tracking.Trial) -> None:
    condition = Condition(40, 10.0, 0.25)
    image = trial.seen(condition)
    moved = trial.filtered("prior", condition, np.add(image, [0.0, 100.0]))
    assert not np.array_equal(moved.posture, trial.filtered("prior", condition, image).posture)


# --- what the prior is worth ------------------------------------------------------------------------------


def test_the_prior_beats_no_prior_at_few_particles(measured: dict[str, Any]) -> None:
    methods = list(measured["methods"])
    mean = measured["error_mm"].mean(axis=2)
    prior = mean[..., methods.index("prior")]
    for other in ("no_prior", "no_prior_own_step", "mean_linear_phase"):
        assert (prior < mean[..., methods.index(other)]).all(), other
    for other in ("no_prior", "no_prior_own_step"):  # by far, where the model knows the person
        assert (prior[0] < 0.8 * mean[0, :, methods.index(other)]).all(), other


def test_the_best_phase_is_no_worse_than_a_constant_rate(measured: dict[str, Any]) -> None:
    methods = list(measured["methods"])
    best, constant = (measured["error_mm"][..., methods.index(f"mean_{m}_phase")] for m in ("best", "linear"))
    assert (best <= constant).all()
    # Neither looks at the image.
    np.testing.assert_array_equal(best, np.broadcast_to(best[:, :1], best.shape))


def test_the_arrays_are_what_they_are_said_to_be(measured: dict[str, Any]) -> None:
    wanted = conditions(QUICK)
    assert list(measured["varied"]) == ["particles", "noise", "occlusion", "occlusion"]
    assert measured["error_mm"].shape == (2, len(wanted), 2, len(tracking.METHODS))
    assert measured["lost_fraction"].shape == (2, len(wanted), 2, len(tracking.FILTERS))
    # The same condition is the same track, whatever is varied.
    np.testing.assert_array_equal(measured["error_mm"][:, 0], measured["error_mm"][:, 2])
    assert np.isnan(measured["shown_image"]).any()
    shown = list(measured["tracked"]).index(measured["shown"][0])
    of_shown = [c for _, c in wanted].index(demonstrated(QUICK))
    np.testing.assert_allclose(
        measured["shown_error_mm"].mean(axis=1), measured["error_mm"][0, of_shown, shown], rtol=1e-12
    )
    assert not measured["pruned_fraction"][..., 1:].any()
    assert (measured["aspace_error_mm"][0] < measured["aspace_error_mm"][1]).all()


def test_seeds_reproduce(stages: tuple[Artefact, Artefact]) -> None:
    small = replace(QUICK, particles=[20], tracked=1, leave_out=["performance"], occluded=[0.25])
    first, second, other = (tracking.measure(small, *stages, 1, seed)[0] for seed in (1, 1, 2))
    for name, values in first.items():
        np.testing.assert_array_equal(values, second[name])
    filters = len(tracking.FILTERS)
    assert (first["error_mm"][..., :filters] != other["error_mm"][..., :filters]).all()
    np.testing.assert_array_equal(first["error_mm"][..., filters:], other["error_mm"][..., filters:])


def test_one_person_alone_is_not_left_out(stages: tuple[Artefact, Artefact]) -> None:
    postures, action = stages
    alone = replace(
        postures, arrays={**postures.arrays, "person": np.full(len(postures.arrays["person"]), "a")}
    )
    small = replace(QUICK, particles=[5], tracked=1, occluded=[0.0])
    arrays, notes = tracking.measure(small, alone, action, 1, 1)
    assert list(arrays["leave_out"]) == ["performance"]
    assert notes["remarks"] == ["tracking: one person alone, so no person is left out"]
    with pytest.raises(InvalidInput, match="one person cannot be left out"):
        ways(["person"], alone.arrays["person"])


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


def test_noise_has_the_size_it_is_said_to_have_in_either_camera(trial: tracking.Trial) -> None:
    joints = np.repeat(trial.performance.joints_mm, 20, axis=0)
    for name in ("orthographic", "perspective"):
        camera = camera_of(replace(QUICK, camera=name))

        def seen(noise: float, camera: Any = camera) -> np.ndarray:
            return camera.upright_mm(
                observe(joints, camera, noise_mm=noise, occluded=0.0, occlusion_frames=10.0, seed=(1,))
            )

        assert (seen(12.0) - seen(0.0)).std() == pytest.approx(12.0, rel=0.02)
        np.testing.assert_allclose(seen(12.0) - seen(0.0), 3.0 * (seen(4.0) - seen(0.0)), atol=1e-9)


@pytest.mark.parametrize("view_deg", [-90.0, 0.0, 45.0])
def test_a_distant_pinhole_sees_what_the_orthographic_camera_sees(
    trial: tracking.Trial, view_deg: float
) -> None:
    far = camera_of(replace(QUICK, camera="perspective", distance_mm=1e8, view_angle_deg=view_deg))
    near = camera_of(replace(QUICK, view_angle_deg=view_deg))
    joints = trial.performance.joints_mm
    np.testing.assert_allclose(
        far.upright_mm(far.project(joints)), near.upright_mm(near.project(joints)), atol=0.1
    )


def test_a_performance_is_tracked_in_perspective(trial: tracking.Trial) -> None:
    """To little more than what the aSpace leaves out."""
    seen = replace(trial, camera=camera_of(replace(QUICK, camera="perspective", view_angle_deg=-60.0)))
    condition = Condition(200, 5.0, 0.2)
    found = seen.filtered("prior", condition, seen.seen(condition))
    held_out, actor = seen.held_out, seen.performance
    projected = held_out.joints(held_out.action.space.project(actor.postures), actor.body)
    least = joint_error(projected, actor.joints_mm).mean()
    assert joint_error(held_out.joints(found.posture, actor.body), actor.joints_mm).mean() < 1.3 * least
    assert not found.lost.any()


def test_particles_that_are_no_posture_have_no_weight(trial: tracking.Trial) -> None:
    """A thigh against its rest direction has no frame: that particle goes, the others stay as they are."""
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
    image = trial.camera.project(joints[[0]])
    density = trial.camera.likelihood(image, np.full(15, 10.0)).log_density(joints, 0)
    assert np.isneginf(density[3])
    assert np.isfinite(density[others]).all()


# --- performances as they stand ---------------------------------------------------------------------------


@given(seed=seeds)
@settings(max_examples=10)
def test_a_performance_stands_alike_wherever_it_was_recorded(trial: tracking.Trial, seed: int) -> None:
    generator = np.random.default_rng(seed)
    performance = trial.performance
    angle = generator.uniform(-np.pi, np.pi)
    cos, sin = np.cos(angle), np.sin(angle)
    place = generator.uniform(-5e3, 5e3, 3)
    recorded = performance.joints_mm @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1.0]]) + place
    np.testing.assert_allclose(
        standing(recorded, performance.postures, place[2]), performance.joints_mm, atol=1e-6
    )


def test_joints_and_postures_of_a_performance_belong_together(trial: tracking.Trial) -> None:
    """Up to the lengths of limbs, which vary by a few millimetres in what is recorded."""
    performance = trial.performance
    again = posture.joints(performance.postures, performance.body, frame=performance.frame)
    assert np.linalg.norm(again - performance.joints_mm, axis=-1).mean() < 10.0
    assert np.abs(performance.joints_mm[:, 8, :2]).max() < 1e-9


@pytest.mark.parametrize("frame", posture.FRAMES)
def test_what_cosines_are_relative_to_is_read_off_the_joints(store: Store, frame: str) -> None:
    assert frame_of(learnt(store, f"dataset.frame={frame}")[0]) == frame


# --- sampled postures -------------------------------------------------------------------------------------


def test_accepted_draws_lie_within_the_bounds_and_the_others_without(
    stages: tuple[Artefact, Artefact],
) -> None:
    arrays, notes = posture_samples.measure(PostureSamplesSweep(measured=300), *stages, 1, 1)
    kinds = list(arrays["kinds"])
    accepted, outside, training = (kinds.index(k) for k in ("accepted", "outside", "training"))
    for name in ("acceptance", "bounds_held_fraction"):
        assert (arrays[name][:, accepted] == 1.0).all()
        assert (arrays[name][:, outside] == 0.0).all()
    assert notes["bound"] == 3.0
    assert (arrays["draws"][:, training] == len(stages[1].arrays["synchronized"])).all()
    for name in ("spread_mm", "nearest_training_mm", "nearest_training_max_mm"):
        assert (arrays[name][:, accepted] < arrays[name][:, outside]).all()
    assert (arrays["limb_direction_norm_min"] < 1.0).all()
    assert (arrays["limb_direction_norm_max"] > 1.0).all()


def test_the_postures_shown_are_accepted_and_frames_count_from_one(
    stages: tuple[Artefact, Artefact],
) -> None:
    """Back from the joints: every limb has the length of the mean body, the first frame is the first sample."""
    options = PostureSamplesSweep(frames=[1, 100], samples=5, measured=20)
    arrays, _ = posture_samples.measure(options, *stages, 1, 1)
    np.testing.assert_array_equal(arrays["mean_joints"], arrays["mean_performance"][[0, 99]])
    lengths = posture_samples.mean_body(stages[0]).limbs_mm
    for body in arrays["sample_joints"]:
        np.testing.assert_allclose(posture.limb_lengths(body).limbs_mm, lengths, rtol=1e-9)


def test_sampled_postures_reproduce_over_seeds_and_workers(stages: tuple[Artefact, Artefact]) -> None:
    options = PostureSamplesSweep(measured=150)
    first, second, other = (
        posture_samples.measure(options, *stages, w, s)[0] for w, s in ((1, 1), (2, 1), (1, 2))
    )
    for name, values in first.items():
        np.testing.assert_array_equal(values, second[name])
    assert not np.array_equal(first["sample_joints"], other["sample_joints"])
    np.testing.assert_array_equal(first["mean_joints"], other["mean_joints"])


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
    found = posture_samples.nearest(joints, recorded, 1)
    np.testing.assert_allclose(found, expected, atol=0.01)
    assert found[5, 1] < 0.01


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


# --- figures ----------------------------------------------------------------------------------------------


def test_the_figures_are_whole(figure: Callable[..., Outcome], tmp_path: Path) -> None:
    outcome = figure(tmp_path, "mozerov2006_fig4", "scale=smoke", "sweep.measured=50", quick=False)
    recording = outcome.folder / "recording.rrd"
    recordings.verify(recording)
    names = {"world/mean_performance", "about", "world/frame_10/mean", "world/frame_40/accepted_8"}
    assert names <= set(recordings.entities(recording))
    drawn = tables.read(outcome.folder / "table.csv")
    assert len(drawn["x_mm"]) == 2 * 9 * 15
    index, joints = recordings.read_column(recording, "world/mean_performance", "Points3D:positions", "frame")
    assert list(index) == list(range(1, 101))
    mean = (drawn["frame"] == 40) & (drawn["draw"] == -1)
    np.testing.assert_allclose(1e3 * joints[39, :, 2], drawn["z_mm"][mean], atol=0.01)

    small = ["sweep.particles=[30]", "sweep.tracked=2", "sweep.noise_mm=[10]", "sweep.occluded=[0.25]"]
    outcome = figure(tmp_path, "mozerov2006_tracking", "scale=smoke", *small, quick=False)
    recording = outcome.folder / "recording.rrd"
    recordings.verify(recording)
    wanted = {f"{top}/{m}" for m in tracking.METHODS for top in ("world/tracked", "curves/error_mm")}
    assert wanted | {"world/original", "image/observed", "about"} <= set(recordings.entities(recording))
    table = tables.read(outcome.folder / "table.csv")
    each = tables.read(outcome.folder / "table_performances.csv")
    assert len(table["error_mm"]) == 2 * 3 * len(tracking.METHODS)
    assert len(each["error_mm"]) == 2 * len(table["error_mm"])
    key = ("leave_out", "varied", "method")
    for row, error in enumerate(table["error_mm"]):
        here = np.all([each[k] == table[k][row] for k in key], axis=0)
        assert error == pytest.approx(each["error_mm"][here].mean(), rel=1e-8)
        assert table["error_sd_mm"][row] == pytest.approx(each["error_mm"][here].std(ddof=1), rel=1e-6)


# --- options ----------------------------------------------------------------------------------------------


def test_one_quantity_is_varied_at_a_time() -> None:
    options = TrackingSweep(particles=[100, 2000, 500, 50])
    wanted = conditions(options)
    assert [c.particles for v, c in wanted if v == "particles"] == [50, 100, 500, 2000]
    assert {c.particles for v, c in wanted if v != "particles"} == {500}
    assert {(c.noise_mm, c.occluded) for v, c in wanted if v == "particles"} == {(10.0, 0.0)}
    assert [c.noise_mm for v, c in wanted if v == "noise"] == [0.0, 10.0, 30.0]
    assert [c.occluded for v, c in wanted if v == "occlusion"] == [0.0, 0.25, 0.5]
    assert demonstrated(options) == Condition(500, 10.0, 0.25)
    assert conditions(TrackingSweep(particles=[10, 30, 20]))[-1][1].particles == 20
    assert list(tracked(3, 7)) == [0, 3, 6]
    assert list(tracked(0, 3)) == list(tracked(9, 3)) == [0, 1, 2]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"particles": [0]}, "sweep.particles: values to be tried are none, out of range"),
        ({"particles": []}, r"sweep.particles: .*\(received none\)"),
        ({"noise_mm": [1.0, 1.0]}, "sweep.noise_mm: .* stand twice"),
        ({"occluded": [1.0]}, "sweep.occluded"),
        ({"occluded": [0.95]}, r"sweep.occluded: .*\(expected 0 to 0.9, received 0.95\)"),
        ({"occlusion_frames": 0.5}, "sweep.occlusion_frames: hidden runs are too short"),
        ({"baseline_noise_mm": -1.0}, "sweep.baseline_noise_mm"),
        ({"leave_out": ["walker"]}, r"sweep.leave_out: .*\(expected performance or person"),
        (
            {"camera": "fisheye"},
            r"sweep.camera: .*\(expected orthographic or perspective, received fisheye\)",
        ),
        ({"distance_mm": 0.0}, "sweep.distance_mm: a camera cannot stand there"),
        ({"view_angle_deg": np.nan}, "sweep.view_angle_deg"),
        ({"tracked": -1}, "sweep.tracked: fewer performances than none"),
        ({"moves": -1}, "the number of moves is negative"),
    ],
)
def test_options_that_cannot_be_are_refused(
    stages: tuple[Artefact, Artefact], change: dict[str, Any], sentence: str
) -> None:
    assert set(change) <= {f.name for f in fields(TrackingSweep)}
    small = replace(QUICK, particles=[5], tracked=1, leave_out=["performance"], occluded=[0.25])
    with pytest.raises(InvalidInput, match=sentence):
        tracking.measure(replace(small, **change), *stages, 1, 1)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"frames": [0]}, r"sweep.frames: .*\(expected some of 1 to 100, received 0\)"),
        ({"frames": [101]}, "sweep.frames"),
        ({"frames": []}, "sweep.frames.*received none"),
        ({"frames": [10, 10]}, "sweep.frames: .* stand twice"),
        ({"samples": 0}, "sweep.samples"),
        (
            {"samples": 30, "measured": 20},
            r"sweep.samples: .*\(expected 1 to sweep.measured, 20, received 30\)",
        ),
    ],
)
def test_frames_that_are_none_are_refused(
    stages: tuple[Artefact, Artefact], change: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(InvalidInput, match=sentence):
        posture_samples.measure(replace(PostureSamplesSweep(), **change), *stages, 1, 1)
