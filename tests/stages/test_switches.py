"""Tests of the options of the walking experiments: each option has the described effect on stage results."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.clips.options import Data
from pipeline.core import errors, fourier, linear_model
from pipeline.formats.points import trc
from pipeline.ingestion.data import RecordedData
from pipeline.skeleton import WALKER15
from pipeline.storage.store import Store
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.synthetic.walkers import walking_population
from tests.own_files import write_table
from tests.stages.run import Stages, smoke
from tests.stages.run import stages as made

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """Cache that all tests of options share."""
    return Store(tmp_path_factory.mktemp("switches"))


def stages(store: Store, *overrides: str, figure: str = "zhang2007_fig5", data: Data | None = None) -> Stages:
    """Return the results of the four stages with changed options."""
    return made(smoke(figure, *overrides, data=data), store)


@pytest.fixture(scope="module")
def twice(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of two clips of four seconds for each of four people, cut from eight seconds on a treadmill."""
    folder = tmp_path_factory.mktemp("twice")
    people = walking_population(
        np.random.default_rng(3), male=2, female=2, duration_s=8.0, frame_rate_hz=60.0
    )
    for who, motion in zip(("anna", "bela", "cleo", "dora"), people.positions_mm, strict=True):
        for half in (0, 1):
            trc.write(folder / f"{who}_{half}.trc", WALKER15.joints, motion[240 * half :][:240], 60.0)
    return folder


def assert_folds_leave_out(learnt: Eigenwalkers, people: np.ndarray) -> None:
    """Assert that the model of each walk is learnt from all other people."""
    samples = learnt.samples
    for r, person in enumerate(people):
        others = samples[people != person]
        np.testing.assert_allclose(learnt.folds.mean[r], others.mean(axis=0), atol=1e-9)
        total = ((others - others.mean(axis=0)) ** 2).sum() / (len(others) - 1)
        np.testing.assert_allclose(learnt.folds.total_variance[r], total, rtol=1e-9)


def test_the_best_walk_of_each_person_is_used(store: Store, twice: Path) -> None:
    walks, samples, learnt, _ = stages(store, "data=folder", f"data.path={twice}")
    assert len(walks.person) == 8
    assert list(samples.person) == ["anna", "bela", "cleo", "dora"]
    residual, person = walks.residual_share, walks.person
    for walk, who in zip(samples.walk, samples.person, strict=True):
        assert residual[walk] == residual[person == who].min()
    assert_folds_leave_out(learnt, samples.person)


def test_with_all_walks_a_person_is_left_out_whole(store: Store, twice: Path) -> None:
    _, samples, learnt, swept = stages(store, "data=folder", f"data.path={twice}", "dataset.walks=all")
    people = samples.person
    assert len(people) == 8
    assert samples.words == "8 walks of 4 walkers"
    assert_folds_leave_out(learnt, people)
    np.testing.assert_array_equal(learnt.folds.mean[0], learnt.folds.mean[1])
    assert swept.rows["walker"].nunique() == 8


def test_subjects_that_are_one_person_never_straddle_a_fold(
    store: Store, twice: Path, tmp_path: Path
) -> None:
    files = sorted(twice.glob("*.trc"))
    table = write_table(tmp_path / "sources.csv", {path.name: path.read_bytes() for path in files})
    same = [[f"{who}_0", f"{who}_1"] for who in ("anna", "bela")]
    data = RecordedData(
        name="mine",
        sources=["here"],
        table=str(table),
        raw=str(twice),
        skeletons=["walker15"],
        same_person=same,
    )
    _, samples, learnt, _ = stages(store, "dataset.walks=all", data=data)
    assert list(samples.person) == [
        "anna_0", "anna_0", "bela_0", "bela_0", "cleo_0", "cleo_1", "dora_0", "dora_1"
    ]  # fmt: skip
    assert_folds_leave_out(learnt, samples.person)
    _, one_each, _, _ = stages(store, data=data)
    assert one_each.words == "6 walkers"


def test_mirrored_walkers_make_a_symmetric_model_and_leave_with_their_original(store: Store) -> None:
    _, samples, learnt, _ = stages(store, "model.mirror=true")
    mean = linear_model.unflatten(learnt.mean)
    np.testing.assert_allclose(fourier.mirrored(mean), mean, atol=1e-9)
    mirrors = linear_model.flatten(fourier.mirrored(samples.coefficients))
    for r in range(len(mirrors)):
        others = np.concatenate([np.delete(learnt.samples, r, axis=0), np.delete(mirrors, r, axis=0)])
        np.testing.assert_allclose(learnt.folds.mean[r], others.mean(axis=0), atol=1e-9)
    assert learnt.kept > stages(store).model.kept


def test_size_by_stature_makes_all_equally_tall(store: Store) -> None:
    walks, absolute, _, _ = stages(store)
    _, scaled, _, _ = stages(store, "dataset.size=stature")
    stature = walks.stature_mm[scaled.walk]
    np.testing.assert_allclose(scaled.scale * stature, stature.mean(), rtol=1e-12)
    assert np.ptp(scaled.scale) > 0.02
    expected = scaled.scale[:, None, None, None] * absolute.coefficients
    np.testing.assert_allclose(scaled.coefficients, expected, atol=1e-6)
    np.testing.assert_array_equal(absolute.scale, 1.0)


def test_the_origin_on_the_floor_moves_heights_alone(store: Store) -> None:
    _, pelvis, _, _ = stages(store)
    _, floor, _, _ = stages(store, "dataset.origin=floor")
    change = floor.coefficients - pelvis.coefficients
    np.testing.assert_allclose(change[:, 1:], 0.0, atol=1e-6)
    np.testing.assert_allclose(change[:, 0, :, :2], 0.0, atol=1e-6)
    height = change[:, 0, :, 2]
    np.testing.assert_allclose(height, np.broadcast_to(height[:, :1], height.shape), atol=1e-6)
    assert (height > 600).all()
    assert (height < 1100).all()
    ankles = floor.coefficients[:, 0, [WALKER15.index("left_ankle"), WALKER15.index("right_ankle")], 2]
    assert (ankles > 0).all()


def test_another_pelvis_and_sternum_are_those_of_training_and_test(store: Store) -> None:
    walks, measured, _, _ = stages(store, "dataset.origin=floor")
    switched = ("dataset.pelvis=above", "dataset.sternum=below_shoulders")
    _, redefined, learnt, _ = stages(store, "dataset.origin=floor", *switched)
    assert_folds_leave_out(learnt, redefined.person)
    np.testing.assert_array_equal(learnt.samples, linear_model.flatten(redefined.coefficients))
    joints = [WALKER15.index(joint) for joint in ("sternum", "pelvis")]
    others = [j for j in range(15) if j not in joints]
    np.testing.assert_allclose(
        (redefined.coefficients - measured.coefficients)[:, 1:, others], 0.0, atol=1e-9
    )
    heights = redefined.coefficients[:, 0, :, 2]
    left, right = (
        heights[:, [WALKER15.index(f"{side}_{j}") for j in ("shoulder", "hip")]] for side in ("left", "right")
    )
    from_middle = heights[:, joints] - (left + right) / 2.0
    stature = walks.stature_mm[redefined.walk]
    expected = np.outer(stature, [-36.0 / 1500.0, 106.0 / 1500.0])
    np.testing.assert_allclose(from_middle, expected, atol=1e-6)


def test_measured_against_the_fourier_series_the_error_lacks_the_residual(store: Store) -> None:
    _, samples, _, motion = stages(store)
    _, _, _, series = stages(store, "sweep.truth=fourier")
    view = np.radians(motion.view_angle_deg)
    less = motion.rows["absolute_error_mm2"] - series.rows["absolute_error_mm2"]
    for clip, residual in zip(samples.clip, samples.residual_covariance, strict=True):
        of_walker = less[motion.rows["walker"] == clip].to_numpy().reshape(-1, len(view))
        expected = np.broadcast_to(errors.along_missing(residual, view).mean(axis=1), of_walker.shape)
        np.testing.assert_allclose(of_walker, expected, atol=1e-6)
        assert (expected > 0).all()
    assert (series.rows["missing_variance_mm2"] < motion.rows["missing_variance_mm2"]).all()


def test_the_overall_variance_counts_where_the_joints_are_too(store: Store) -> None:
    _, _, _, temporal = stages(store)
    _, _, _, overall = stages(store, "sweep.missing_variance=overall")
    overall, temporal = overall.rows, temporal.rows
    assert (overall["missing_variance_mm2"] > temporal["missing_variance_mm2"]).all()
    np.testing.assert_array_equal(overall["absolute_error_mm2"], temporal["absolute_error_mm2"])
    assert (overall["relative_error"] < temporal["relative_error"]).all()


def test_the_published_solver_finds_near_views_as_the_global_one_does(store: Store) -> None:
    overrides = ["data.walkers=5", "sweep.view_angle_deg.start=-30", "sweep.view_angle_deg.stop=30"]
    unknown = {"figure": "zhang2007_fig6"}
    *_, everywhere = stages(store, *overrides, **unknown)
    *_, published = stages(store, *overrides, "sweep.solver=published", **unknown)
    assert published.rows["converged"].all()
    # Approach I goes downhill from 0 degrees, approach II takes the best whole degree.
    for method, apart_deg in (("least_squares", 0.5), ("map", 0.6)):
        ours, theirs = (result.rows[result.rows["method"] == method] for result in (everywhere, published))
        assert len(ours) == 5 * 5
        np.testing.assert_allclose(theirs["error_deg"], ours["error_deg"], atol=apart_deg)
        assert (ours["cost"] <= theirs["cost"] * (1 + 1e-6)).all()


def test_another_divisor_scales_the_eigenvalues_alone(store: Store) -> None:
    first, other = stages(store).model, stages(store, "model.divisor=R").model
    count = len(first.samples)
    np.testing.assert_allclose(other.eigenvalues * count, first.eigenvalues * (count - 1))
    np.testing.assert_allclose(other.folds.mean, first.folds.mean)


def test_the_frequency_is_the_226th_number_and_weighs_what_it_is_told(store: Store) -> None:
    _, samples, learnt, _ = stages(store, figure="zhang2004_fig4")
    assert learnt.samples.shape[1] == 226
    omega = 2 * np.pi * samples.frequency_hz
    np.testing.assert_allclose(learnt.samples[:, -1], omega, rtol=1e-12)
    for r, scale in enumerate(learnt.folds.last_scale):
        variance = np.delete(learnt.samples, r, axis=0).var(axis=0, ddof=1)
        np.testing.assert_allclose(scale, np.sqrt(variance[:-1].mean() / variance[-1]), rtol=1e-9)
    described = stages(store, "model.omega_scale_mm=2", figure="zhang2004_fig4").model
    assert set(described.folds.last_scale) == {2.0}


@pytest.mark.parametrize("harmonics", [1, 3])
def test_other_numbers_of_harmonics(store: Store, harmonics: int) -> None:
    _, samples, learnt, swept = stages(store, f"dataset.harmonics={harmonics}")
    assert samples.coefficients.shape[1:] == (1 + 2 * harmonics, 15, 3)
    assert learnt.samples.shape[1] == 45 * (1 + 2 * harmonics)
    assert np.isfinite(swept.rows["absolute_error_mm2"]).all()


def test_fewer_components_are_the_first_of_many(store: Store) -> None:
    few, many = (stages(store, f"model.components={n}").model for n in (3, 8))
    assert (few.kept, many.kept) == (3, 8)
    np.testing.assert_array_equal(few.eigenvalues, many.eigenvalues)
    np.testing.assert_allclose(few.folds.components, many.folds.components[:, :3])
