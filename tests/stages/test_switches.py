"""Every switch of the walking experiments does what it says, seen from the artefacts of the stages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.__main__ import compose
from pipeline.core import errors, fourier, linear_model
from pipeline.formats.points import trc
from pipeline.skeleton import WALKER15, SourceMapping
from pipeline.stages import dataset, ingest, model, sweep
from pipeline.storage.store import Artefact, Store
from pipeline.studies.options import Config, FourierDataset, RecordedData
from pipeline.synthetic.walkers import walking_population

Stages = tuple[Artefact, Artefact, Artefact, Artefact]


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """One cache for all switches."""
    return Store(tmp_path_factory.mktemp("switches"))


def stages(store: Store, *overrides: str, figure: str = "zhang2007_fig5", data: Any = None) -> Stages:
    """Artefacts of the four stages with some switches thrown."""
    config: Config = compose([f"experiment={figure}", "scale=smoke", *overrides])
    assert isinstance(config.dataset, FourierDataset)
    walks = ingest.run(data or config.data, config.skeleton, config.seed, 2, store)
    samples = dataset.run(config.dataset, walks, 2, store)
    learnt = model.run(config.model, samples, 2, store)
    return walks, samples, learnt, sweep.run(config.sweep, walks, samples, learnt, 2, store, seed=config.seed)


@pytest.fixture(scope="module")
def twice(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of four people with two clips each: the halves of eight seconds on the belt."""
    folder = tmp_path_factory.mktemp("twice")
    people = walking_population(
        np.random.default_rng(3), male=2, female=2, duration_s=8.0, frame_rate_hz=60.0
    )
    for who, motion in zip(("anna", "bela", "cleo", "dora"), people.positions_mm, strict=True):
        for half in (0, 1):
            trc.write(folder / f"{who}_{half}.trc", WALKER15.joints, motion[240 * half :][:240], 60.0)
    return folder


def assert_folds_leave_out(learnt: Artefact, people: np.ndarray) -> None:
    """The fold of each walk knows nobody of its person, and everybody else."""
    samples = learnt.arrays["samples"]
    for r, person in enumerate(people):
        others = samples[people != person]
        np.testing.assert_allclose(learnt.arrays["fold_mean"][r], others.mean(axis=0), atol=1e-9)
        total = ((others - others.mean(axis=0)) ** 2).sum() / (len(others) - 1)
        np.testing.assert_allclose(learnt.arrays["fold_total_variance"][r], total, rtol=1e-9)


def test_the_best_walk_of_each_person_is_used(store: Store, twice: Path) -> None:
    walks, samples, learnt, _ = stages(store, "data=folder", f"data.path={twice}")
    assert len(walks.arrays["person"]) == 8
    assert list(samples.arrays["person"]) == ["anna", "bela", "cleo", "dora"]
    residual, person = walks.arrays["residual_share"], walks.arrays["person"]
    for walk, who in zip(samples.arrays["walk"], samples.arrays["person"], strict=True):
        assert residual[walk] == residual[person == who].min()
    assert_folds_leave_out(learnt, samples.arrays["person"])


def test_with_all_walks_a_person_is_left_out_whole(store: Store, twice: Path) -> None:
    _, samples, learnt, swept = stages(store, "data=folder", f"data.path={twice}", "dataset.walks=all")
    people = samples.arrays["person"]
    assert len(people) == 8
    assert (samples.notes["walkers"], samples.notes["walks"]) == (4, 8)
    assert_folds_leave_out(learnt, people)
    np.testing.assert_array_equal(learnt.arrays["fold_mean"][0], learnt.arrays["fold_mean"][1])
    assert swept.arrays["absolute_error_mm2"].shape[1] == 8


def test_subjects_that_are_one_person_never_straddle_a_fold(
    store: Store, twice: Path, tmp_path: Path
) -> None:
    rows = [
        f"{path.name},mine,{path.stem},{path.stem},walk,60,own,{path.stat().st_size}"
        for path in sorted(twice.glob("*.trc"))
    ]
    table = tmp_path / "sources.csv"
    table.write_text(
        "\n".join(["path,source,subject,trial,action,frame_rate_hz,skeleton,bytes", *rows]) + "\n"
    )
    own = SourceMapping(name="own", joints={joint: {joint: 1.0} for joint in WALKER15.joints})
    same = [[f"{who}_0", f"{who}_1"] for who in ("anna", "bela")]
    data = RecordedData(
        name="mine",
        sources=["mine"],
        table=str(table),
        raw=str(twice),
        skeletons={"own": own},
        same_person=same,
    )
    _, samples, learnt, _ = stages(store, "dataset.walks=all", data=data)
    assert list(samples.arrays["person"]) == [
        "anna_0", "anna_0", "bela_0", "bela_0", "cleo_0", "cleo_1", "dora_0", "dora_1"
    ]  # fmt: skip
    assert_folds_leave_out(learnt, samples.arrays["person"])
    _, one_each, _, _ = stages(store, data=data)
    assert (one_each.notes["walkers"], one_each.notes["walks"]) == (6, 6)


def test_mirrored_walkers_make_a_symmetric_model_and_leave_with_their_original(store: Store) -> None:
    _, samples, learnt, _ = stages(store, "model.mirror=true")
    mean = linear_model.unflatten(learnt.arrays["mean"])
    np.testing.assert_allclose(fourier.mirrored(mean), mean, atol=1e-9)
    mirrors = linear_model.flatten(fourier.mirrored(samples.arrays["coefficients"]))
    for r in range(len(mirrors)):
        others = np.concatenate(
            [np.delete(learnt.arrays["samples"], r, axis=0), np.delete(mirrors, r, axis=0)]
        )
        np.testing.assert_allclose(learnt.arrays["fold_mean"][r], others.mean(axis=0), atol=1e-9)
    assert learnt.notes["components"] > stages(store)[2].notes["components"]


def test_size_by_stature_makes_all_equally_tall(store: Store) -> None:
    walks, absolute, _, _ = stages(store)
    _, scaled, _, _ = stages(store, "dataset.size=stature")
    stature = walks.arrays["stature_mm"][scaled.arrays["walk"]]
    np.testing.assert_allclose(scaled.arrays["scale"] * stature, stature.mean(), rtol=1e-12)
    assert np.ptp(scaled.arrays["scale"]) > 0.02
    expected = scaled.arrays["scale"][:, None, None, None] * absolute.arrays["coefficients"]
    np.testing.assert_allclose(scaled.arrays["coefficients"], expected, atol=1e-6)
    np.testing.assert_array_equal(absolute.arrays["scale"], 1.0)


def test_the_origin_on_the_floor_moves_heights_alone(store: Store) -> None:
    _, pelvis, _, _ = stages(store)
    _, floor, _, _ = stages(store, "dataset.origin=floor")
    change = floor.arrays["coefficients"] - pelvis.arrays["coefficients"]
    np.testing.assert_allclose(change[:, 1:], 0.0, atol=1e-6)
    np.testing.assert_allclose(change[:, 0, :, :2], 0.0, atol=1e-6)
    height = change[:, 0, :, 2]
    np.testing.assert_allclose(height, np.broadcast_to(height[:, :1], height.shape), atol=1e-6)
    assert (height > 600).all()
    assert (height < 1100).all()
    ankles = floor.arrays["coefficients"][
        :, 0, [WALKER15.index("left_ankle"), WALKER15.index("right_ankle")], 2
    ]
    assert (ankles > 0).all()


def test_measured_against_the_fourier_series_the_error_lacks_the_residual(store: Store) -> None:
    _, samples, _, motion = stages(store)
    _, _, _, series = stages(store, "sweep.truth=fourier")
    view = np.radians(motion.arrays["view_angle_deg"])
    for r, residual in enumerate(samples.arrays["residual_covariance"]):
        less = motion.arrays["absolute_error_mm2"][:, r] - series.arrays["absolute_error_mm2"][:, r]
        expected = np.broadcast_to(errors.along_missing(residual, view), less.shape)
        np.testing.assert_allclose(less, expected, atol=1e-6)
        assert (expected > 0).all()
    assert (series.arrays["missing_variance_mm2"] < motion.arrays["missing_variance_mm2"]).all()


def test_the_overall_variance_counts_where_the_joints_are_too(store: Store) -> None:
    _, _, _, temporal = stages(store)
    _, _, _, overall = stages(store, "sweep.missing_variance=overall")
    assert (overall.arrays["missing_variance_mm2"] > temporal.arrays["missing_variance_mm2"]).all()
    np.testing.assert_array_equal(overall.arrays["absolute_error_mm2"], temporal.arrays["absolute_error_mm2"])
    assert (overall.arrays["relative_error"] < temporal.arrays["relative_error"]).all()


def test_the_published_solver_finds_near_views_as_the_global_one_does(store: Store) -> None:
    overrides = ["data.walkers=5", "sweep.view_angle_deg.start=-30", "sweep.view_angle_deg.stop=30"]
    unknown = {"figure": "zhang2007_fig6"}
    *_, everywhere = stages(store, *overrides, **unknown)
    *_, published = stages(store, *overrides, "sweep.solver=published", **unknown)
    assert everywhere.arrays["angle_deg"].shape == published.arrays["angle_deg"].shape == (2, 5, 5)
    least_squares, map_grid = published.arrays["angle_deg"]
    assert published.arrays["converged"].all()
    # Approach I goes downhill from 0 degrees, approach II takes the best whole degree.
    np.testing.assert_allclose(least_squares, everywhere.arrays["angle_deg"][0], atol=0.5)
    np.testing.assert_allclose(map_grid, everywhere.arrays["angle_deg"][1], atol=0.6)
    assert (everywhere.arrays["cost"] <= published.arrays["cost"] * (1 + 1e-6)).all()


def test_another_divisor_scales_the_eigenvalues_alone(store: Store) -> None:
    one, other = stages(store)[2], stages(store, "model.divisor=R")[2]
    count = len(one.arrays["samples"])
    np.testing.assert_allclose(other.arrays["eigenvalues"] * count, one.arrays["eigenvalues"] * (count - 1))
    np.testing.assert_allclose(other.arrays["fold_mean"], one.arrays["fold_mean"])


def test_the_frequency_is_the_226th_number_and_weighs_what_it_is_told(store: Store) -> None:
    _, samples, learnt, _ = stages(store, figure="zhang2004_fig4")
    assert learnt.arrays["samples"].shape[1] == 226
    omega = 2 * np.pi * samples.arrays["frequency_hz"]
    np.testing.assert_allclose(learnt.arrays["samples"][:, -1], omega, rtol=1e-12)
    variance = learnt.arrays["samples"].var(axis=0, ddof=1)
    expected = np.sqrt(variance[:-1].mean() / variance[-1])
    np.testing.assert_allclose(learnt.notes["last_scale"], expected, rtol=1e-9)
    light = stages(store, "model.omega_scale_mm=2", figure="zhang2004_fig4")[2]
    assert light.notes["last_scale"] == 2.0


@pytest.mark.parametrize("harmonics", [1, 3])
def test_other_numbers_of_harmonics(store: Store, harmonics: int) -> None:
    _, samples, learnt, swept = stages(store, f"dataset.harmonics={harmonics}")
    assert samples.arrays["coefficients"].shape[1:] == (1 + 2 * harmonics, 15, 3)
    assert learnt.arrays["samples"].shape[1] == 45 * (1 + 2 * harmonics)
    assert np.isfinite(swept.arrays["absolute_error_mm2"]).all()


def test_fewer_components_are_the_first_of_many(store: Store) -> None:
    few, many = (stages(store, f"model.components={n}")[2] for n in (3, 8))
    assert (few.notes["components"], many.notes["components"]) == (3, 8)
    np.testing.assert_array_equal(few.arrays["eigenvalues"], many.arrays["eigenvalues"])
    np.testing.assert_allclose(few.arrays["fold_components"], many.arrays["fold_components"][:, :3])
