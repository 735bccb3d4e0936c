"""`sweep.phase_source`: frequency and phase from the 3D motion, as in the papers, or from the view alone."""

from __future__ import annotations

import csv
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.__main__ import compose
from pipeline.cli.figures import make_figure
from pipeline.core import camera, errors, fourier, reconstruction, viewpoint
from pipeline.core.linear_model import LinearModel, unflatten
from pipeline.core.statistics import angle_difference_deg
from pipeline.stages import dataset, ingest, model, sweep
from pipeline.storage.store import Artefact, Store
from pipeline.studies.options import Config
from pipeline.studies.walks import phase_sources
from pipeline.validation import InvalidInput


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return Store(tmp_path_factory.mktemp("results"))


def configuration(figure: str, *overrides: str) -> Config:
    config: Config = compose([f"experiment={figure}", "scale=smoke", *overrides])
    return config


def inputs(config: Config, store: Store) -> tuple[Artefact, Artefact, Artefact]:
    walks = ingest.run(config.data, config.skeleton, config.seed, 2, store)
    samples = dataset.run(config.dataset, walks, 2, store)
    return walks, samples, model.run(config.model, samples, 2, store)


def swept(config: Config, store: Store) -> Artefact:
    return sweep.run(config.sweep, *inputs(config, store), 2, store, seed=2007)


def fold(learnt: Artefact, r: int) -> LinearModel:
    names = ("mean", "components", "eigenvalues", "total_variance", "last_scale")
    mean, components, eigenvalues, total, scale = (learnt.arrays[f"fold_{name}"][r] for name in names)
    return LinearModel(mean, components, eigenvalues, float(total), float(scale))


OBSERVED = "sweep.phase_source=observed2d"


@pytest.mark.parametrize("figure", ["zhang2007_fig3", "zhang2007_fig4", "zhang2007_fig5", "zhang2004_fig4"])
def test_with_the_phase_unknown_a_known_view_costs_little(figure: str, store: Store) -> None:
    paper, ours = (swept(configuration(figure, *o), store).arrays for o in ((), (OBSERVED,)))
    assert set(ours) - set(paper) == {"frequency_hz", "phase_rad", "phase_error_rad"}
    for name, values in paper.items():
        assert ours[name].shape == values.shape, name
        assert np.isfinite(ours[name]).all() if values.dtype.kind == "f" else True
    for method in range(len(ours["methods"])):
        ratio = ours["absolute_error_mm2"][method].mean() / paper["absolute_error_mm2"][method].mean()
        assert 0.9 < ratio < 1.1
    assert np.array_equal(ours["missing_variance_mm2"], paper["missing_variance_mm2"])
    # What is shown beside the original is what was judged, but for the frequency.
    apart = errors.absolute_error(ours["missing"] - paper["missing"]).mean()
    assert apart < 0.2 * paper["demonstration_error_mm2"].mean()


@pytest.mark.parametrize("figure", ["zhang2007_fig6", "zhang2004_fig5"])
def test_with_the_phase_unknown_the_view_is_still_found(figure: str, store: Store) -> None:
    paper, ours = (swept(configuration(figure, *o), store) for o in ((), (OBSERVED,)))
    assert ours.notes["not_converged"] == 0
    assert set(ours.arrays) - set(paper.arrays) == {"frequency_hz", "phase_rad", "phase_error_rad"}
    views = ours.arrays["view_angle_deg"]
    off = [np.abs(angle_difference_deg(a.arrays["angle_deg"], views)).mean() for a in (paper, ours)]
    assert off[1] < 1.1 * off[0] + 0.1
    assert (ours.arrays["runner_up_cost"] >= ours.arrays["cost"]).all()


def test_frequency_and_phase_are_near_those_of_the_motion(store: Store) -> None:
    config = configuration("zhang2007_fig5", OBSERVED)
    known = inputs(config, store)[1].arrays["frequency_hz"]
    arrays = swept(config, store).arrays
    assert np.abs(arrays["frequency_hz"] / known[:, None] - 1).max() < 0.01
    assert (arrays["frequency_hz"] != known[:, None]).any()
    assert np.degrees(np.abs(arrays["phase_error_rad"])).max() < 15.0
    assert np.degrees(np.median(np.abs(arrays["phase_error_rad"]))) < 2.0


def test_the_path_over_sigma2_meets_the_error_at_the_configured_one(store: Store) -> None:
    arrays = swept(configuration("zhang2007_fig5", OBSERVED), store).arrays
    at = int(np.flatnonzero(arrays["sigma2_mm2"] == 70.0)[0])
    method = list(arrays["methods"]).index("map")
    assert np.allclose(
        arrays["path_walker_mm2"][:, at], arrays["absolute_error_mm2"][method].mean(axis=(1, 2)), rtol=1e-6
    )
    assert np.allclose(
        arrays["path_view_mm2"][:, at], arrays["absolute_error_mm2"][method].mean(axis=(0, 2)), rtol=1e-6
    )


@pytest.mark.parametrize(
    "overrides", [["dataset.origin=floor"], ["dataset.size=stature"], ["dataset.walks=all"]]
)
def test_the_clip_is_the_one_that_the_sample_came_from(overrides: list[str], store: Store) -> None:
    config = configuration("zhang2007_fig5", OBSERVED, *overrides)
    walks, samples, learnt = inputs(config, store)
    # Backwards, so that a walk is not its sample's number.
    turned_round = dataclasses.replace(samples, arrays={k: v[::-1] for k, v in samples.arrays.items()})
    for r, walk in enumerate(turned_round.arrays["walk"]):
        seen = phase_sources.Observed2d(fold(learnt, r), walks, turned_round, r, np.array([0.0, np.pi / 2]))
        sample = turned_round.arrays["coefficients"][r]
        series = fourier.shift(seen.clip.coefficients, seen._phase)
        assert np.abs(series - sample).max() < 0.05 * np.abs(sample[1:]).max()
        assert np.abs(series[:, 0] - sample[0]).max() < 5.0
        # The phase is that of the motion's own series at the frequency of the view.
        first = walks.arrays["first"]
        motion = walks.arrays["positions"][first[walk] : first[walk + 1]]
        for a, frequency in enumerate(seen.clip.frequency_hz):
            own = fourier.represent(
                motion, walks.arrays["frame_rate_hz"][walk], frequency_hz=float(frequency)
            )
            assert abs(np.sin(own.phase_rad - seen._phase[a])) < 1e-3


def test_against_the_fourier_part_the_residual_is_left_out(store: Store) -> None:
    motion, series = (
        swept(configuration("zhang2007_fig5", OBSERVED, f"sweep.truth={t}"), store).arrays
        for t in ("motion", "fourier")
    )
    assert (series["absolute_error_mm2"] < motion["absolute_error_mm2"]).all()
    more = motion["absolute_error_mm2"].mean(axis=-1) - series["absolute_error_mm2"].mean(axis=-1)
    less = motion["missing_variance_mm2"] - series["missing_variance_mm2"]
    assert np.allclose(more, less, rtol=1e-6)


def test_the_papers_way_is_the_default_and_looks_at_samples_alone(store: Store) -> None:
    config = configuration("zhang2007_fig5")
    options: Any = config.sweep
    assert options.phase_source == configuration("zhang2007_fig6").sweep.phase_source == "motion3d"  # type: ignore[attr-defined]
    walks, samples, learnt = inputs(config, store)
    ours = sweep.run(options, walks, samples, learnt, 2, store, seed=2007)
    view = np.radians(ours.arrays["view_angle_deg"])
    for r in (0, 5):
        for m, noise in enumerate((None, 70.0)):
            direct = reconstruction.from_known_views(
                fold(learnt, r), learnt.arrays["samples"][r], view, noise_variance=noise
            )
            power = errors.along_missing(samples.arrays["residual_covariance"][r], view)
            expected = errors.absolute_error(direct.delta, power)
            assert np.array_equal(ours.arrays["absolute_error_mm2"][m, r], expected)
    other = dataclasses.replace(walks, key="0" * 16)
    assert (
        sweep.run(options, other, samples, learnt, 2, store, seed=2007).key == ours.key
    )  # the clips are no input
    observed = configuration("zhang2007_fig5", OBSERVED).sweep
    assert sweep.run(observed, walks, samples, learnt, 2, store, seed=2007).key != ours.key


def test_the_papers_way_with_an_unknown_view_is_the_default(store: Store) -> None:
    config = configuration("zhang2007_fig6")
    learnt = inputs(config, store)[2]
    ours = swept(config, store).arrays
    walker = unflatten(learnt.arrays["samples"][3])
    image = np.stack([camera.project(walker, a).ravel() for a in np.radians(ours["view_angle_deg"])])
    direct = viewpoint.estimate(fold(learnt, 3), image, method="map", noise_variance=70.0)
    assert np.array_equal(ours["angle_deg"][1, 3], np.degrees(direct.angle_rad))


@pytest.mark.parametrize(
    ("figure", "overrides", "words"),
    [
        ("zhang2007_fig5", ["sweep.phase_source=motion2d"], "sweep.phase_source: .*motion3d or observed2d.*motion2d"),
        ("zhang2007_fig6", ["sweep.phase_source=''"], "sweep.phase_source: the source of the phase is unknown"),
        ("zhang2007_fig6", [OBSERVED, "sweep.solver=published"], "sweep.solver: only the global solver"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(figure: str, overrides: list[str], words: str, store: Store) -> None:
    with pytest.raises(InvalidInput, match=words):
        swept(configuration(figure, *overrides), store)


@pytest.mark.parametrize("figure", ["zhang2007_fig5", "zhang2007_fig6"])
def test_a_figure_is_made_with_the_phase_unknown(figure: str, store: Store, tmp_path: Path) -> None:
    config = configuration(figure, OBSERVED, "report.picture=false", "report.recording=false")
    outcome = make_figure(config, tmp_path / figure, store=store)
    with (outcome.folder / "table.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 13
    with np.load(outcome.folder / "arrays.npz", allow_pickle=False) as arrays:
        assert arrays["phase_error_rad"].shape == (2, 12, 13)
