"""Tests of the sweeps over limbs: trials, figures 3a to 3d of park2011, and the benchmark of proved optima."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.cli.compose import compose
from pipeline.core.articulation import Adjustment
from pipeline.core.statistics import rank_correlation
from pipeline.core.trajectory_basis import TrajectoryBasis
from pipeline.storage import tables
from pipeline.storage.typed import pack
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.figures.limb_scatter import increasing
from pipeline.studies.limbs.missing_data import MissingDataSweep, Pattern
from pipeline.studies.limbs.model import Basis, TrajectoryBasisModel
from pipeline.studies.limbs.one_limb import REFINED, RadiusScaleSweep, RootErrorSweep
from pipeline.studies.limbs.reconstructibility import LimbReconstructibilities, ReconstructibilitySweep
from pipeline.studies.limbs.scores import limb_errors, true_signs
from pipeline.studies.limbs.trials import ROOT, wrong_trajectory
from pipeline.studies.study import Sweep
from tests.benchmarks import proofs
from tests.recordings import reading
from tests.rejects import rejects
from tests.strategies import seeds
from tests.studies.limbs.inputs import measure, stretches_of

SHAKY = [Camera.shaky]
ANY = RootErrorSweep(trials=2, ratios=[0.0, 0.2], cameras=SHAKY)
HARD = TrajectoryBasisModel()
SOFT = TrajectoryBasisModel(basis=Basis.soft, softness=8.0)


@pytest.fixture(scope="module")
def limbs() -> LimbStretches:
    """Motion stretches of a few synthetic clips."""
    return stretches_of("park2011_fig3a")


# --- trials -----------------------------------------------------------------------------------------------


@given(number=st.integers(0, 50), camera=st.sampled_from(list(Camera)))
@settings(max_examples=10)
def test_the_candidates_of_a_trial_hold_its_truth(limbs: LimbStretches, number: int, camera: Camera) -> None:
    trial = ANY.trial(limbs, number, camera, 1)
    choice = ANY.choose(trial, HARD.limb_basis(), time_limit_s=0.0)
    signs = true_signs(choice, trial.relative)
    nearest = choice.hits.middle + signs[:, None] * choice.hits.half_chord
    # Synthetic bodies keep their lengths to a hundredth; where a ray is nearly tangent that moves the candidates.
    assert np.median(np.linalg.norm(nearest - trial.relative, axis=1)) < 0.05 * trial.length
    errors = limb_errors(trial, choice)
    assert 0 <= errors["error_up_to_mirror"] <= errors["limb_error"]


def test_a_trial_is_the_same_limb_before_every_camera(limbs: LimbStretches) -> None:
    trials = {camera: ANY.trial(limbs, 3, camera, 1) for camera in Camera}
    assert len({(t.clip, t.limb, t.length) for t in trials.values()}) == 1
    still, moving, shaky = (trials[camera] for camera in (Camera.still, Camera.moving, Camera.shaky))
    np.testing.assert_array_equal(still.noise, shaky.noise)
    assert not np.array_equal(still.images, moving.images)
    assert not np.ptp(still.view.centre, axis=0).any()
    assert np.ptp(moving.view.centre, axis=0).max() > 1000.0
    part = proofs.part(shaky, 10, 20)
    np.testing.assert_array_equal(part.view.project(part.child), shaky.images[10:30])


@given(seed=seeds, frames=st.integers(20, 60), size=st.floats(0.1, 1e3))
def test_an_error_of_a_trajectory_has_the_mean_size_asked_for(seed: int, frames: int, size: float) -> None:
    for components in (None, 5):
        error = wrong_trajectory(np.random.default_rng(seed), frames, size, components=components)
        assert np.linalg.norm(error, axis=1).mean() == pytest.approx(size)
    assert np.linalg.matrix_rank(np.fft.rfft(error, axis=0)) <= 3


@given(seed=seeds, count=st.integers(1, 40))
def test_whole_numbers_increase_and_come_from_where_they_say(seed: int, count: int) -> None:
    values = np.random.default_rng(seed).normal(0, 10, count)
    whole, places = increasing(values)
    assert (np.diff(whole) > 0).all()
    np.testing.assert_array_equal(whole, np.rint(values[places]))
    assert set(whole) == set(np.rint(values).astype(int))


# --- sweeps -----------------------------------------------------------------------------------------------


def every(limbs: LimbStretches, workers: int, seed: int) -> list[dict[str, np.ndarray]]:
    """Return the arrays of each kind of sweep over limbs, computed with very few trials."""
    sweeps: list[tuple[Sweep, TrajectoryBasisModel]] = [
        (ReconstructibilitySweep(trials=2, refined=1, cameras=SHAKY), HARD),
        (ANY, HARD),
        (RadiusScaleSweep(trials=2, scales=[0.1, 1.0, 20.0], cameras=SHAKY), HARD),
        (MissingDataSweep(trials=1, fractions=[0.0, 0.2], share=1.0), SOFT),
    ]
    return [pack(measure(sweep, limbs, model, workers=workers, seed=seed))[0] for sweep, model in sweeps]


def test_sweeps_reproduce_over_workers_and_not_over_seeds(limbs: LimbStretches) -> None:
    first, second = every(limbs, 1, 5), every(limbs, 2, 5)
    for single, other in zip(first, second, strict=True):
        for name, values in single.items():
            np.testing.assert_array_equal(values, other[name], err_msg=name)
    again = measure(ANY, limbs, HARD, seed=6)
    assert not np.array_equal(first[1]["rows.limb_error"], again.rows["limb_error"])
    assert first[0]["rows.proved"].all()


@pytest.fixture(scope="module")
def scatter(limbs: LimbStretches) -> LimbReconstructibilities:
    options = ReconstructibilitySweep(trials=12, cameras=[Camera.still, Camera.shaky], refined=4)
    result: LimbReconstructibilities = measure(options, limbs, HARD, workers=2, seed=3)
    return result


def test_no_signs_cost_less_than_those_that_are_proved(scatter: LimbReconstructibilities) -> None:
    rows = scatter.rows
    assert rows["proved"].mean() > 0.8
    least = rows["objective"] * (1 - 1e-5) - 1e-6
    assert (rows["truth_objective"] >= least)[rows["proved"]].all()
    assert (rows["lower_bound"] <= rows["objective"]).all()
    eta = np.sqrt(rows["impostor_objective"] / rows["truth_objective"])
    np.testing.assert_allclose(eta, rows["reconstructibility_vector"], rtol=1e-6)


def test_reconstructibility_predicts_error_and_the_impostor(scatter: LimbReconstructibilities) -> None:
    eta, error = (scatter.rows[name].to_numpy() for name in ("reconstructibility_vector", "limb_error"))
    assert rank_correlation(eta, error) < -0.4
    assert (error[eta > 2] < 0.1).all()
    used = scatter.rows["taken_impostor"].to_numpy()
    assert used[eta < 0.9].all()
    assert not used[eta > 2].any()


def test_the_basis_alone_needs_a_camera_that_shakes_and_the_length_does_not(
    scatter: LimbReconstructibilities,
) -> None:
    median = scatter.rows.groupby("camera")[["basis_alone_error", "limb_error"]].median()
    assert median.loc["shaky", "basis_alone_error"] < 1.0 < 5.0 < median.loc["still", "basis_alone_error"]
    assert median.loc["still", "limb_error"] < 1.0


def test_the_programme_starts_nearer_than_other_starts(scatter: LimbReconstructibilities) -> None:
    by_start = scatter.starts.groupby("start")["reprojection_error_px"].median()
    assert by_start["programme"] == by_start.min()


def test_a_wrong_parent_makes_the_child_wrong(limbs: LimbStretches) -> None:
    options = RootErrorSweep(trials=10, ratios=[0.0, 0.1, 0.5], cameras=SHAKY, time_limit_s=1.0)
    result = measure(options, limbs, HARD, workers=2, seed=1)
    rows = result.rows
    np.testing.assert_allclose(rows["parent_error_ratio"] - rows["root_error_ratio"], 0.0, atol=1e-9)
    assert rows.groupby("root_error_ratio")["child_error_ratio"].median().is_monotonic_increasing
    assert result.paths.shape == (3, 2, 100, 3)


def test_a_radius_too_small_is_harmless_and_too_large_is_not(limbs: LimbStretches) -> None:
    options = RadiusScaleSweep(trials=6, scales=[0.01, 0.1, 1.0, 10.0, 100.0], cameras=SHAKY)
    result = measure(options, limbs, HARD, workers=2, seed=1)
    assert options.ways == [REFINED, "global", "per_frame", "robust"]
    error, ratio, share = (
        result.rows.pivot(index=["adjust", "radius_scale"], columns="trial", values=name)
        for name in ("limb_error", "radius_ratio", "adjusted_share")
    )
    # Adjusted to the same rays, the radius is the same however small it was.
    np.testing.assert_array_equal(error.loc["global", 0.01], error.loc["global", 0.1])
    assert (error.drop(REFINED).query("radius_scale >= 10") > 5.0).all(axis=None)
    assert np.median(error.loc["global", 0.01]) < 1.0
    # Refined with the trajectory, it finds back from ten times its length, as in the paper's figure.
    refined = error.loc[REFINED].median(axis=1)
    assert (refined[:4] < 0.5).all()
    assert refined[10.0] < 0.1 * np.median(error.loc["global", 10.0])
    assert (np.abs(ratio.loc[REFINED].median(axis=1)[:4] - 1.0) < 0.1).all()
    assert (ratio.loc["global"].query("radius_scale >= 1") >= 1.0).all(axis=None)
    assert (share.query("radius_scale == 0.01") > 0.9).all(axis=None)
    assert not share.query("radius_scale >= 10").any(axis=None)


def test_what_is_missing_is_as_much_as_was_asked_for_and_never_the_root(limbs: LimbStretches) -> None:
    scene = MissingDataSweep(trials=1).scene(limbs, HARD.limb_basis(), 0, 1)
    for fraction in (0.0, 0.05, 0.5):
        for pattern in Pattern:
            hidden = scene.hidden(pattern, fraction, 1)
            assert not hidden[:, ROOT].any()
            counts = np.delete(hidden, ROOT, axis=1).sum(axis=0)
            assert (counts == round(fraction * 100)).all()
            if pattern is Pattern.block and fraction:
                changes = np.abs(np.diff(hidden.astype(int), axis=0)).sum(axis=0)
                assert (changes <= 2).all(), "one run of frames to a joint"
    less, more = (scene.hidden(Pattern.random, fraction, 1) for fraction in (0.1, 0.3))
    assert more[less].all()


def test_lengths_hold_between_frames_on_the_sphere_and_not_in_coordinates(limbs: LimbStretches) -> None:
    options = MissingDataSweep(trials=1, fractions=[0.2], patterns=[Pattern.random], share=1.0)
    result = measure(options, limbs, SOFT, seed=1)
    rows = result.rows
    assert rows["length_violation"].max() < 1e-11
    assert rows["cartesian_length_violation"].min() > 1e-3
    assert (rows["relative_error_up_to_mirror"] <= rows["relative_error"] * 1.1).all()


def test_a_programme_of_the_benchmark_is_the_trial_cut_to_its_frames(limbs: LimbStretches) -> None:
    longest = limbs.positions.shape[1]
    solved = [proofs.solve(limbs, 1, longest, 10, 1.0, number) for number in range(3)]
    for first, camera in zip(solved, Camera, strict=True):
        trial = ANY.trial(limbs, int(first["trial"]), camera, 1)
        choice = ANY.choose(trial, TrajectoryBasis(10), noise_px=1.0, time_limit_s=proofs.LIMIT_S)
        assert first["objective"] == choice.solution.objective
        assert (first["proved"], first["gap"]) == (True, 0.0)
    (row,) = proofs.summary(pd.DataFrame(solved).assign(proved=[True, True, False], seconds=[1.0, 3.0, 9.0]))
    assert (row["trials"], row["proved_share"], row["seconds_median"]) == (3, pytest.approx(2 / 3), 3.0)
    assert row["seconds_to_proof_median"] == 2.0


# --- figures ----------------------------------------------------------------------------------------------


def test_the_scatter_holds_all_trials(smoke_results: Path) -> None:
    folder = smoke_results / "synthetic" / "smoke" / "park2011_fig3a"
    entities = set(reading.entities(folder / "recording.rrd"))
    target = {
        f"world/{w}/{p}"
        for w in ("good", "impostor", "cursor")
        for p in ("original", "impostor", "reconstructed")
    }
    assert target <= entities
    table, running = (tables.read(folder / f"{name}.csv") for name in ("table", "table_running"))
    assert len(table["trial"]) == len(running["reconstructibility"]) == 12
    assert set(table["camera"]) == {"still", "moving", "shaky"}


def test_a_limb_that_hangs_by_the_adjusted_radius_does_not_depend_on_a_radius_too_small(
    smoke_results: Path,
) -> None:
    """The error of a baseline with a length adjusted to the rays does not depend on the assumed radius: figure 3c."""
    table = tables.read(smoke_results / "synthetic" / "smoke" / "park2011_fig3c" / "table_trials.csv")
    small = (table["adjust"] == REFINED) & (table["radius_scale"] < 0.5)
    spread: dict[str, list[float]] = {"hanging_error": [], "adjusted_hanging_error": []}
    for column, of_trials in spread.items():
        for camera in set(table["camera"]):
            for trial in set(table["trial"]):
                start = small & (table["camera"] == camera) & (table["trial"] == trial)
                of_trials.append(float(np.ptp(table[column][start])))
    assert max(spread["adjusted_hanging_error"]) < 1e-6
    assert max(spread["hanging_error"]) > 0.05


# --- options ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "rejection"),
    [
        (RootErrorSweep(trials=0), rejects("out_of_range", "sweep.trials", value=0)),
        (RootErrorSweep(trials=1, ratios=[0.2, 0.1]), rejects("not_increasing", "sweep.ratios")),
        (RootErrorSweep(trials=1, ratios=[]), rejects("not_increasing", "sweep.ratios")),
        (RootErrorSweep(trials=1, cameras=[]), rejects("not_distinct", "sweep.cameras")),
        (RootErrorSweep(trials=1, distance_mm=0.0), rejects("out_of_range", "sweep.distance_mm", value=0.0)),
        (RadiusScaleSweep(trials=1, scales=[0.0]), rejects("out_of_range", "sweep.scales[0]", value=0.0)),
        (RadiusScaleSweep(trials=1, adjusts=2 * [Adjustment.robust]), rejects("not_distinct", "sweep.adjusts")),
        (ReconstructibilitySweep(trials=1, refined=0), rejects("out_of_range", "sweep.refined", value=0)),
        (MissingDataSweep(trials=1, fractions=[0.95]), rejects("out_of_range", "sweep.fractions[0]", value=0.95)),
        (MissingDataSweep(trials=1, patterns=[]), rejects("not_distinct", "sweep.patterns")),
        (MissingDataSweep(trials=1, share=0.0), rejects("out_of_range", "sweep.share", value=0.0)),
        (MissingDataSweep(trials=1, noise_px=-1.0), rejects("out_of_range", "sweep.noise_px", value=-1.0)),
    ],
)  # fmt: skip
def test_options_out_of_range_are_refused(options: Sweep, rejection: AbstractContextManager) -> None:
    with rejection:
        options.validate()


@pytest.mark.parametrize(
    ("name", "override", "sentence"),
    [
        ("fig3b", "sweep.cameras=[flying]", "sweep.cameras"),
        ("fig3b", "sweep.adjust=never", "sweep.adjust"),
        ("fig3a", "sweep.reading=eye", "sweep.reading"),
        ("fig3d", "sweep.patterns=[stripes]", "sweep.patterns"),
        ("fig3b", "model.basis=firm", "model.basis"),
        ("fig3b", "model.components=0", "model.components must be at least 1"),
        ("fig3c", "dataset.stretches=0", "dataset.stretches must be at least 1"),
        ("fig4", "figure.instants=0", "figure.instants must be at least 1"),
        ("fig4", "sweep.lengths=guessed", "sweep.lengths"),
        ("fig4", "sweep.root=none", "sweep.root"),
        ("fig4", "sweep.noise_px=-1", "sweep.noise_px must be at least 0"),
    ],
)
def test_experiments_that_cannot_be_are_refused_before_anything_runs(
    say: Callable[..., Any], tmp_path: Path, name: str, override: str, sentence: str
) -> None:
    message = say(f"experiment=park2011_{name}", "scale=smoke", f"results={tmp_path}/results", override)
    assert message.status == 1
    assert sentence.replace(r"\(", "(").replace(r"\)", ")") in message.err
    assert not (tmp_path / "results").exists()


def test_every_camera_can_be_asked_for_by_name() -> None:
    sweep = compose(["experiment=park2011_fig3b", "sweep.cameras=[moving,still]"]).sweep
    assert isinstance(sweep, RootErrorSweep)
    assert sweep.cameras == [Camera.moving, Camera.still]
