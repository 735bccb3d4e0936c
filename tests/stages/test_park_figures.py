"""Figures 3a to 3d of park2011 and the share of programmes proved: experiments, tables, recordings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pipeline.studies.limbs.figures.limb_paths import increasing
from pipeline.studies.options import (
    LimbSweep,
    MissingDataSweep,
    ProofSweep,
    RadiusScaleSweep,
    ReconstructibilitySweep,
    RootErrorSweep,
    TrajectoryBasisModel,
)

from pipeline import recordings
from pipeline.__main__ import compose
from pipeline.cli.figures import Outcome
from pipeline.core.articulated_trajectory import TrajectoryBasis
from pipeline.core.limb_chain import WALKER14
from pipeline.core.statistics import rank_correlation
from pipeline.stages import dataset, ingest
from pipeline.storage import tables
from pipeline.storage.store import Artefact, Store
from pipeline.studies.limbs import limb_errors, missing_data, proofs, reconstructibility
from pipeline.studies.limbs.scores import limb_score, true_signs
from pipeline.studies.limbs.trials import choose, fixed_smoothness, limb_trial, smoothness, wrong_trajectory
from pipeline.validation import InvalidInput
from tests.strategies import seeds

ANY = RootErrorSweep(trials=2, ratios=[0.0, 0.2], cameras=["shaky"])
BASIS = TrajectoryBasisModel()


@pytest.fixture(scope="module")
def limbs(tmp_path_factory: pytest.TempPathFactory) -> Artefact:
    """Stretches of a few synthetic clips."""
    config = compose(["experiment=park2011_fig3a", "scale=smoke"])
    store = Store(tmp_path_factory.mktemp("limbs"))
    clips = ingest.run(config.data, config.skeleton, config.seed, 1, store, purpose=config.purpose)
    return dataset.run(config.dataset, clips, 1, store)


# --- trials -----------------------------------------------------------------------------------------------


@given(number=st.integers(0, 50), camera=st.sampled_from(["still", "moving", "shaky"]))
@settings(max_examples=10)
def test_the_candidates_of_a_trial_hold_its_truth(limbs: Artefact, number: int, camera: str) -> None:
    trial = limb_trial(ANY, limbs, number, camera, 1)
    choice = choose(trial, TrajectoryBasis(), replace(ANY, time_limit_s=0.0))
    signs = true_signs(choice, trial.relative)
    nearest = choice.hits.middle + signs[:, None] * choice.hits.half_chord
    # Synthetic bodies keep their lengths to a hundredth; where a ray is nearly tangent that moves the candidates.
    assert np.median(np.linalg.norm(nearest - trial.relative, axis=1)) < 0.05 * trial.length
    score = limb_score(trial, choice)
    assert 0 <= score.error_up_to_mirror <= score.limb_error


def test_a_trial_is_the_same_limb_before_every_camera(limbs: Artefact) -> None:
    trials = [limb_trial(ANY, limbs, 3, camera, 1) for camera in ("still", "moving", "shaky")]
    assert len({(t.stretch, t.limb, t.length) for t in trials}) == 1
    np.testing.assert_array_equal(trials[0].noise, trials[2].noise)
    assert not np.array_equal(trials[0].images, trials[1].images)
    assert not np.ptp(trials[0].view.centre, axis=0).any()
    assert np.ptp(trials[1].view.centre, axis=0).max() > 1000.0
    part = trials[2].part(10, 20)
    np.testing.assert_array_equal(part.view.project(part.child), trials[2].images[10:30])


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


# --- experiments ------------------------------------------------------------------------------------------


def measured(limbs: Artefact, workers: int, seed: int) -> list[dict[str, Any]]:
    """Every experiment but the proofs, as small as it can be."""
    soft = TrajectoryBasisModel(components=20, basis="soft", softness=8.0)
    return [
        reconstructibility.measure(
            ReconstructibilitySweep(trials=2, refined=1, cameras=["shaky"]), limbs, BASIS, workers, seed
        )[0],
        limb_errors.measure_root_error(ANY, limbs, BASIS, workers, seed)[0],
        limb_errors.measure_radius_scale(
            RadiusScaleSweep(trials=2, scales=[0.1, 1.0, 20.0], cameras=["shaky"]),
            limbs,
            BASIS,
            workers,
            seed,
        )[0],
        missing_data.measure(
            MissingDataSweep(trials=1, fractions=[0.0, 0.2], share=1.0), limbs, soft, workers, seed
        )[0],
    ]


def test_experiments_reproduce_over_workers_and_not_over_seeds(limbs: Artefact) -> None:
    first, second = measured(limbs, 1, 5), measured(limbs, 2, 5)
    for one, other in zip(first, second, strict=True):
        for name, values in one.items():
            np.testing.assert_array_equal(values, other[name], err_msg=name)
    again = limb_errors.measure_root_error(ANY, limbs, BASIS, 1, 6)[0]
    assert not np.array_equal(first[1]["limb_error"], again["limb_error"])
    assert first[0]["proved"].all(), "nothing at this size depends on the clock"


@pytest.fixture(scope="module")
def scatter(limbs: Artefact) -> dict[str, Any]:
    options = ReconstructibilitySweep(trials=12, cameras=["still", "shaky"], refined=4)
    return reconstructibility.measure(options, limbs, BASIS, 2, 3)[0]


def test_no_signs_cost_less_than_those_that_are_proved(scatter: dict[str, Any]) -> None:
    proved = scatter["proved"]
    assert proved.mean() > 0.8
    least = scatter["objective"] * (1 - 1e-5) - 1e-6
    assert (scatter["truth_objective"] >= least)[proved].all()
    assert (scatter["lower_bound"] <= scatter["objective"]).all()
    eta = np.sqrt(scatter["impostor_objective"] / scatter["truth_objective"])
    np.testing.assert_allclose(eta, scatter["reconstructibility_vector"], rtol=1e-6)


def test_reconstructibility_predicts_error_and_the_impostor(scatter: dict[str, Any]) -> None:
    eta, error = scatter["reconstructibility_vector"].ravel(), scatter["limb_error"].ravel()
    assert rank_correlation(eta, error) < -0.4
    assert (error[eta > 2] < 0.1).all()
    taken = scatter["taken_impostor"].ravel()
    assert taken[eta < 0.9].all()
    assert not taken[eta > 2].any()


def test_the_programme_starts_nearer_than_other_starts(scatter: dict[str, Any]) -> None:
    by_start = np.median(scatter["refined_px"], axis=(0, 1))
    assert by_start[0] == by_start.min()


def test_a_wrong_parent_makes_the_child_wrong(limbs: Artefact) -> None:
    options = RootErrorSweep(trials=10, ratios=[0.0, 0.1, 0.5], cameras=["shaky"], time_limit_s=1.0)
    found = limb_errors.measure_root_error(options, limbs, BASIS, 2, 1)[0]
    np.testing.assert_allclose(found["parent_error_ratio"][0].T - options.ratios, 0.0, atol=1e-9)
    middle = np.median(found["child_error_ratio"][0], axis=1)
    assert middle[0] < middle[1] < middle[2]
    assert found["paths"].shape == (3, 2, 100, 3)


def test_a_radius_too_small_is_harmless_and_too_large_is_not(limbs: Artefact) -> None:
    options = RadiusScaleSweep(trials=6, scales=[0.01, 0.1, 1.0, 10.0, 100.0], cameras=["shaky"])
    found = limb_errors.measure_radius_scale(options, limbs, BASIS, 2, 1)[0]
    error, way = found["limb_error"][0], options.adjusts.index("global")
    # Adjusted to the same rays, the radius is the same however small it was.
    np.testing.assert_array_equal(error[0, way], error[1, way])
    assert (error[3:] > 5.0).all()
    assert np.median(error[0, way]) < 1.0
    np.testing.assert_array_equal(found["radius_ratio"][0, 2:, way] >= 1.0, True)
    assert (found["adjusted_share"][0, 0] > 0.9).all()
    assert not found["adjusted_share"][0, 3:].any()


def test_what_is_missing_is_as_much_as_was_asked_for_and_never_the_root(limbs: Artefact) -> None:
    options = MissingDataSweep(trials=1)
    scene = missing_data._scene(options, limbs, fixed_smoothness(BASIS, "a root"), 0, 1)
    root = WALKER14.joints.index("pelvis")
    for fraction in (0.0, 0.05, 0.5):
        for pattern in missing_data.PATTERNS:
            hidden = scene.hidden(pattern, fraction, 1)
            assert not hidden[:, root].any()
            counts = np.delete(hidden, root, axis=1).sum(axis=0)
            assert (counts == round(fraction * 100)).all()
            if pattern == "block" and fraction:
                changes = np.abs(np.diff(hidden.astype(int), axis=0)).sum(axis=0)
                assert (changes <= 2).all(), "one run of frames to a joint"
    less, more = (scene.hidden("random", fraction, 1) for fraction in (0.1, 0.3))
    assert more[less].all()


def test_lengths_hold_between_frames_on_the_sphere_and_not_in_coordinates(limbs: Artefact) -> None:
    options = MissingDataSweep(trials=1, fractions=[0.2], patterns=["random"], share=1.0)
    soft = TrajectoryBasisModel(components=20, basis="soft", softness=8.0)
    found = missing_data.measure(options, limbs, soft, 1, 1)[0]
    assert found["length_violation"].max() < 1e-12
    assert found["cartesian_length_violation"].min() > 1e-3
    assert (found["relative_error_up_to_mirror"] <= found["relative_error"] * 1.1).all()


def test_proofs_are_of_the_frames_that_were_asked_for(limbs: Artefact) -> None:
    options = ProofSweep(trials=3, frames=[8, 20], components=[5, 10], noises_px=[0.0, 1.0])
    found, notes = proofs.measure(options, limbs, BASIS, 2, 1)
    # Ten cosines of eight frames are none.
    assert len(found["frames"]) == 3 * 2 * (1 + 2)
    assert found["proved"].all()
    assert notes["unproved"] == 0.0
    assert (found["gap"] == 0.0).all()
    assert (found["first_objective"] >= found["objective"] * (1 - 1e-9)).all()
    fewer = proofs.measure(replace(options, frames=[20], long_share=0.0), limbs, BASIS, 1, 1)[0]
    same = found["frames"] == 20
    np.testing.assert_array_equal(fewer["objective"], found["objective"][same])


# --- figures ----------------------------------------------------------------------------------------------


def test_the_scatter_is_whole(figure: Callable[..., Outcome], tmp_path: Path) -> None:
    outcome = figure(tmp_path, "park2011_fig3a", "scale=smoke", quick=False)
    recordings.verify(outcome.folder / "recording.rrd")
    entities = set(recordings.entities(outcome.folder / "recording.rrd"))
    wanted = {
        f"world/{w}/{p}" for w in ("good", "impostor", "cursor") for p in ("truth", "impostor", "estimate")
    }
    assert wanted | {"curves/limb_error/median", "about"} <= entities
    table, bins = (tables.read(outcome.folder / f"{name}.csv") for name in ("table", "table_bins"))
    assert len(table["trial"]) == bins["trials"].sum() == 12
    assert set(table["camera"]) == {"still", "moving", "shaky"}
    assert (bins["reconstructibility_from"] < bins["reconstructibility_to"]).all()
    assert (outcome.folder / "figure.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("name", "small", "rows", "entities"),
    [
        ("fig3b", ["sweep.ratios=[0.0,0.2]"], 8, {"curves/child_error/shaky", "curves/child_error/parent"}),
        ("fig3c", ["sweep.scales=[0.1,1.0,10.0]"], 36, {"curves/log10_limb_error/global", "world/sphere"}),
        ("fig3d", ["sweep.fractions=[0.0,0.2]"], 8, {"world/imputed", "image/observed", "bars/block"}),
        ("proofs", ["sweep.frames=[25,50]"], 8, {"curves/proved_share/k10_noise_0_px"}),
    ],
)
def test_the_other_figures_are_whole(
    figure: Callable[..., Outcome],
    tmp_path: Path,
    name: str,
    small: list[str],
    rows: int,
    entities: set[str],
) -> None:
    outcome = figure(tmp_path, f"park2011_{name}", "scale=smoke", *small, quick=False)
    recordings.verify(outcome.folder / "recording.rrd")
    assert entities | {"about"} <= set(recordings.entities(outcome.folder / "recording.rrd"))
    table = tables.read(outcome.folder / "table.csv")
    assert len(next(iter(table.values()))) == rows
    assert not any("seconds" in column for column in table), "the table is the same on every machine"
    assert (outcome.folder / "figure.png").stat().st_size > 10_000


# --- options ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (RootErrorSweep(trials=0), r"sweep.trials: .*\(expected 1 or more, received 0\)"),
        (RootErrorSweep(trials=1, ratios=[0.2, 0.1]), "sweep.ratios: .* do not increase"),
        (RootErrorSweep(trials=1, ratios=[]), "sweep.ratios: .*received none"),
        (RootErrorSweep(trials=1, cameras=["flying"]), r"sweep.cameras: .*expected one of still, moving, shaky"),
        (RootErrorSweep(trials=1, adjust="never"), "sweep.adjust: the name is unknown"),
        (RootErrorSweep(trials=1, distance_mm=0.0), "sweep.distance_mm"),
        (RadiusScaleSweep(trials=1, scales=[0.0]), "sweep.scales"),
        (RadiusScaleSweep(trials=1, adjusts=["global", "global"]), "sweep.adjusts: .* stand twice"),
        (ReconstructibilitySweep(trials=1, reading="eye"), r"sweep.reading: .*\(expected vector or angle"),
        (ReconstructibilitySweep(trials=1, refined=0), "sweep.refined"),
        (MissingDataSweep(trials=1, fractions=[0.95]), r"sweep.fractions: .*\(expected 0 to 0.9"),
        (MissingDataSweep(trials=1, patterns=["stripes"]), "sweep.patterns"),
        (MissingDataSweep(trials=1, share=0.0), "sweep.share"),
        (MissingDataSweep(trials=1, noise_px=-1.0), "sweep.noise_px: an error is negative"),
        (ProofSweep(trials=1), r"dataset.frames: the stretches are shorter .*\(expected 200 or more, received 100"),
        (ProofSweep(trials=1, frames=[20], components=[30]), "sweep.components: no programme is left"),
        (ProofSweep(trials=1, long_share=2.0), "sweep.long_share"),
    ],
)  # fmt: skip
def test_options_that_cannot_be_are_refused(limbs: Artefact, options: Any, sentence: str) -> None:
    measures: dict[type, Callable[..., Any]] = {
        RootErrorSweep: limb_errors.measure_root_error,
        RadiusScaleSweep: limb_errors.measure_radius_scale,
        ReconstructibilitySweep: reconstructibility.measure,
        MissingDataSweep: missing_data.measure,
        ProofSweep: proofs.measure,
    }
    with pytest.raises(InvalidInput, match=sentence):
        measures[type(options)](options, limbs, BASIS, 1, 1)


@pytest.mark.parametrize(
    ("measure", "options"),
    [
        (limb_errors.measure_root_error, ANY),
        (missing_data.measure, MissingDataSweep(trials=1)),
    ],
)
def test_errors_in_the_basis_ask_for_its_size(measure: Callable, options: LimbSweep, limbs: Artefact) -> None:
    with pytest.raises(
        InvalidInput, match=r"model.components: .* needs a given K \(expected 1 or more, received 0\)"
    ):
        measure(options, limbs, TrajectoryBasisModel(components=0), 1, 7)


def test_limbs_choose_their_components_where_the_basis_has_none(limbs: Artefact) -> None:
    options = ReconstructibilitySweep(trials=2, refined=1, cameras=["shaky"], noise_px=1.0, time_limit_s=0.0)
    found, _ = reconstructibility.measure(options, limbs, TrajectoryBasisModel(components=0), 1, 7)
    given, _ = reconstructibility.measure(options, limbs, TrajectoryBasisModel(), 1, 7)
    assert np.isfinite(found["limb_error"]).all()
    assert not np.array_equal(found["objective"], given["objective"])
    smooth = smoothness(TrajectoryBasisModel(components=0))
    trials = [limb_trial(options, limbs, number, "shaky", 7) for number in range(4)]
    chosen = {choose(trial, smooth, options, noise_px=1.0).basis.components for trial in trials}
    assert len(chosen) > 1
    with pytest.raises(InvalidInput, match="0: each limb chooses its own"):
        smoothness(TrajectoryBasisModel(components=-1))
