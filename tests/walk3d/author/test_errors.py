"""Tests of the errors for a walker outside the data set: errors, resampled people, and the figure."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.cli.compose import compose, reason_without_clips
from pipeline.cli.figures import make_figure
from pipeline.core import camera, linear_model, reconstruction
from pipeline.formats import fourier_walks
from pipeline.skeleton import WALKER15
from pipeline.stages import chain
from pipeline.storage.store import Store
from pipeline.studies.eigenwalkers.samples import FourierDataset
from pipeline.studies.study import SweepInputs
from tests.formats.contract import FIXTURES
from tests.formats.test_fourier_walks import author_file, in_our_frame
from tests.made_up_walker import WALKER
from tests.rejects import rejects
from walk3d.anatomy.prior import Differences
from walk3d.anatomy.study.sweeps.held_out import People
from walk3d.anatomy.study.sweeps.setting import anatomical_setting
from walk3d.author.errors import (
    ERROR_VIEWS_DEG,
    METHODS,
    NOISE_VARIANCES_MM2,
    POSTURE_VIEWS_DEG,
    AverageWalkerErrors,
    OutsideErrors,
    read_walker,
)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> SweepInputs:
    """Return the inputs of the sweep: twelve synthetic people, and a made-up walker in a file.

    Two harmonics contain all of the walker's motion but for some tenths of a mm.
    """
    results = tmp_path_factory.mktemp("results")
    experiment = compose(["experiment=zhang2007_author", "scale=smoke", f"results={results}", "workers=1"])
    clips, dataset, model = (
        retained.value for retained in chain.run(experiment, Store(results), through="model")
    )
    files = experiment.sweep.further_files(experiment.data)
    return SweepInputs(clips, dataset, model, experiment.model, 1, 7, files)


@pytest.fixture(scope="module")
def measured(inputs: SweepInputs) -> OutsideErrors:
    options = compose(["experiment=zhang2007_author", "scale=smoke"]).sweep
    assert isinstance(options, AverageWalkerErrors)
    return options.measure(inputs)


def by_method(rows: pd.DataFrame) -> dict[str, np.ndarray]:
    return {method: owner["rms_error_mm"].to_numpy() for method, owner in rows.groupby("method")}


def rms(off: np.ndarray, beyond: float = 0.0) -> float:
    """Return the RMS error, mm, over all joints and one cycle, from Fourier coefficients (5, 15) and a power, mm².

    The power is that beyond the coefficients.
    """
    return float(np.sqrt((off[0] ** 2 + 0.5 * (off[1:] ** 2).sum(axis=0)).mean() + beyond))


def test_the_walker_is_represented_as_the_people_are() -> None:
    samples, source = read_walker(WALKER, FourierDataset(harmonics=2))
    np.testing.assert_allclose(samples.coefficients[0], in_our_frame(0.5), atol=0.3)
    assert source == "mm_made_up.mm"
    assert read_walker(WALKER, FourierDataset(harmonics=4))[0].coefficients.shape == (1, 9, 15, 3)


@pytest.mark.parametrize(("pelvis", "above_mm"), [("measured", 0.0), ("above", 106.0)])
def test_the_walker_has_the_definitions_of_the_people(pelvis: str, above_mm: float) -> None:
    """The sweep has the dataset's definition of the pelvis, which is 106 mm above the hips for a walker of 1500 mm."""
    sweep = compose(["experiment=zhang2007_author", "scale=smoke", f"dataset.pelvis={pelvis}"]).sweep
    assert isinstance(sweep, AverageWalkerErrors)
    mean = read_walker(WALKER, FourierDataset(pelvis=sweep.pelvis, sternum=sweep.sternum))[0].coefficients[
        0, 0
    ]
    height = {joint: float(mean[WALKER15.index(joint), 2]) for joint in WALKER15.joints}
    above = height["pelvis"] - (height["left_hip"] + height["right_hip"]) / 2
    size = height["head"] - (height["left_ankle"] + height["right_ankle"]) / 2
    assert above == pytest.approx(
        above_mm * size / 1500.0, abs=5.0
    )  # over the lowest ankle, not the mean one


def test_errors_are_those_of_each_method_by_itself(inputs: SweepInputs, measured: OutsideErrors) -> None:
    result = by_method(measured.rows)
    assert set(result) == set(METHODS)
    truth = measured.posture_truth
    np.testing.assert_allclose(truth, in_our_frame(0.5), atol=0.3)
    samples = linear_model.flatten(inputs.dataset.coefficients[inputs.model.tested])
    model = linear_model.fit(samples, 30)
    people = People(inputs.dataset, inputs.model)
    anybody = replace(anatomical_setting(inputs.model_options, 2), differences=Differences())
    residual = read_walker(WALKER, FourierDataset(harmonics=2))[0].residual_covariance[0].mean(axis=0)
    for number, view in enumerate(ERROR_VIEWS_DEG):
        angle = np.radians(view)
        away = np.array([-np.sin(angle), np.cos(angle), 0.0])
        beyond = float(away @ residual @ away)
        missing = camera.missing_dimension(truth, angle)
        average = camera.missing_dimension(samples.mean(axis=0).reshape(5, 15, 3), angle)
        assert result["average_walker"][number] == pytest.approx(rms(missing - average, beyond), rel=1e-6)
        E = np.stack([camera.project(c.reshape(5, 15, 3), angle).ravel() for c in model.components], axis=1)
        d = (camera.project(truth, angle) - camera.project(model.mean.reshape(5, 15, 3), angle)).ravel()
        for method, k in (
            ("least_squares", reconstruction.least_squares(E, d)),
            ("map_70", reconstruction.maximum_a_posteriori(E, d, model.eigenvalues, noise_variance=70.0)),
        ):
            again = (model.mean + k @ model.components).reshape(5, 15, 3)
            off = missing - camera.missing_dimension(again, angle)
            assert result[method][number] == pytest.approx(rms(off, beyond), rel=1e-6), (method, view)
        (estimate,) = people.fold().reconstruct([anybody], truth[None], np.array([angle]))
        off = (estimate.true - estimate.estimated)[0, 0].reshape(15, 5).T
        assert result["anybody"][number] == pytest.approx(rms(off, beyond), rel=1e-6)


def test_the_best_noise_variance_is_the_best_of_those_tried(
    inputs: SweepInputs, measured: OutsideErrors
) -> None:
    attempts = {
        noise: by_method(
            AverageWalkerErrors(noise_variance_mm2=noise, view_angle_deg=GRID).measure(inputs).rows
        )
        for noise in (NOISE_VARIANCES_MM2[0], measured.best_noise_mm2, NOISE_VARIANCES_MM2[-1])
    }
    best = attempts[measured.best_noise_mm2]["map_70"]
    np.testing.assert_allclose(by_method(measured.rows)["map_best"], best)
    assert all((best**2).mean() <= (other["map_70"] ** 2).mean() for other in attempts.values())


GRID = compose(["experiment=zhang2007_author", "scale=smoke"]).sweep.view_angle_deg  # type: ignore[attr-defined]


def test_draws_spread_as_leaving_people_out_does(inputs: SweepInputs, measured: OutsideErrors) -> None:
    """The standard deviation of the errors over resampled people agrees with the jackknife estimate.

    The error is compared by its logarithm, and the factor between the two is the root of (n - 1) / n.
    """
    people = inputs.model.people
    without = []
    for person in range(len(people)):
        samples = np.delete(inputs.dataset.coefficients[inputs.model.tested], person, axis=0)
        off = camera.missing_dimension(measured.posture_truth - samples.mean(axis=0), 0.0)
        without.append(np.log(rms(off)))
    n = len(people)
    jackknife = np.sqrt((n - 1) / n * ((np.array(without) - np.mean(without)) ** 2).sum())
    draws = measured.draws.query("method == 'average_walker' and view_angle_deg == 0")["rms_error_mm"]
    draws = np.log(draws)
    assert len(draws) == 400
    assert draws.std() == pytest.approx(np.sqrt((n - 1) / n) * jackknife, rel=0.1)
    middle = np.log(by_method(measured.rows)["average_walker"][0])
    assert draws.mean() == pytest.approx(middle, abs=0.2 * draws.std())


def test_a_walker_that_is_one_of_the_people_is_nearly_recovered(inputs: SweepInputs, tmp_path: Path) -> None:
    """Least squares with enough eigenwalkers reproduces a walker who is one of the training people."""
    person = inputs.dataset.coefficients[inputs.model.tested[3]]
    path = tmp_path / "a.mm"
    fourier_walks.write_mm(
        path, fourier_walks.FourierWalk(fourier_walks.from_world(person), 120.0, speed=10.0)
    )
    options = AverageWalkerErrors(view_angle_deg=GRID)
    result = by_method(options.measure(replace(inputs, files={"walker": path})).rows)
    assert result["least_squares"].max() < 1.0 < result["average_walker"].min()


def test_the_missing_variance_is_of_people_and_walker(inputs: SweepInputs, measured: OutsideErrors) -> None:
    front = measured.variances.query("view_angle_deg == 0").set_index("who")["missing_variance_mm2"]
    assert list(front.index) == [*inputs.model.people, "walker"]
    along = measured.posture_truth[1:, :, 1]
    assert front["walker"] == pytest.approx(0.5 * (along**2).sum(axis=0).mean(), rel=1e-3)


def test_another_file_is_another_key_and_a_missing_one_leaves_the_figure_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    preset = ["experiment=zhang2007_author", "scale=smoke", f"results={tmp_path}"]
    assert compose(preset).sweep.further_files(None) == {"walker": WALKER}  # type: ignore[arg-type]
    (tmp_path / "a.mm").write_bytes(WALKER.read_bytes())
    keys = []
    for content in (WALKER.read_bytes(), WALKER.read_bytes().replace(b"118.5", b"119.5")):
        (tmp_path / "a.mm").write_bytes(content)
        experiment = compose(
            [*preset, f"sweep.walker={tmp_path / 'a.mm'}", "figure.picture=false", "figure.recording=false"]
        )
        output = make_figure(experiment, tmp_path / "figure", store=Store(tmp_path))
        manifest = json.loads((output.folder / "manifest.json").read_text("utf-8"))
        keys.append({stage: facts["key"] for stage, facts in manifest["stages"].items()})
        assert manifest["configuration"]["sweep"]["walker"] == "a.mm"
    assert keys[0]["model"] == keys[1]["model"]
    assert keys[0]["sweep"] != keys[1]["sweep"]
    with rejects("no_file", "sweep.walker"):
        compose([*preset, "sweep.walker=gone.mm"]).validate()
    monkeypatch.delenv("MOCAP_MIRROR", raising=False)
    monkeypatch.chdir(tmp_path)
    assert "make data" in reason_without_clips(compose([*preset, "sweep.walker=''"]))
    assert "many people" in reason_without_clips(compose([*preset, "data=author"]))


def test_the_caption_names_source_and_terms_and_says_what_map_does(tmp_path: Path) -> None:
    walker = tmp_path / "walker.js"
    text = (FIXTURES / "js_made_up.js").read_text("utf-8")
    walker.write_text("// Copyright … and Nikolaus Troje\n" + text, "utf-8")
    options = [f"sweep.walker={walker}", "figure.recording=false", f"results={tmp_path}"]
    experiment = compose(["experiment=zhang2007_author", "scale=smoke", *options])
    output = make_figure(experiment, tmp_path / "figure", store=Store(tmp_path))
    manifest = json.loads((output.folder / "manifest.json").read_text("utf-8"))
    assert fourier_walks.SOURCE in manifest["caption"]
    assert "MAP with σ² = 70 mm²" in manifest["caption"]
    assert fourier_walks.SOURCE in (output.folder / "figure.svg").read_text("utf-8")
    tables = pd.read_csv(output.folder / "table.csv")
    assert (tables["rms_error_mm_low"] > 0).all()
    displayed = tables.query("method == 'map_70'")["rms_error_mm"]
    assert ", ".join(f"{value:.0f}" for value in displayed) in manifest["caption"]
    with np.load(output.folder / "arrays.npz", allow_pickle=False) as arrays:
        assert arrays["posture_missing"].shape == (len(METHODS), len(POSTURE_VIEWS_DEG), 5, 15)


def test_the_authors_walker_by_the_people_of_optical(tmp_path: Path, mocap_mirror: Path) -> None:
    """The errors of all methods equal those of independent code.

    MAP is worse than the average walker, and `anybody` is better than the average walker from 0 to 60°.
    """
    author_file("bmwalker.json")
    options = ["sweep.walker=''", "figure.picture=false", "figure.recording=false", f"results={tmp_path}"]
    experiment = compose(["experiment=zhang2007_author", "data=optical", *options])
    output = make_figure(experiment, tmp_path / "figure", store=Store(tmp_path))
    result = by_method(pd.read_csv(output.folder / "table.csv"))
    np.testing.assert_allclose(result["map_70"], [53, 60, 52, 69], atol=1.0)
    np.testing.assert_allclose(result["average_walker"], [31, 30, 26, 23], atol=1.0)
    np.testing.assert_allclose(result["anybody"], [18, 12, 13, 23], atol=1.5)
    assert result["anybody"][:3].max() <= 20.0
