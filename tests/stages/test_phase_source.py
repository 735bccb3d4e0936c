"""`sweep.phase_source`: frequency and phase from the 3D motion, as in the papers, or from the view alone."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli.errors import sentence
from pipeline.cli.figures import make_figure
from pipeline.clips.kinds import Walks
from pipeline.core import camera, errors, fourier, reconstruction, viewpoint
from pipeline.core.linear_model import unflatten
from pipeline.core.statistics import angle_difference_deg
from pipeline.stages import sweep
from pipeline.storage import tables
from pipeline.storage.store import Store
from pipeline.studies.walks.phase_sources import PHASES, Observed2d
from tests.stages.run import Stages, smoke, stages, stored_stages

pytestmark = pytest.mark.thorough

FOUND = {"frequency_hz", *PHASES}
"""What only a view's own phase brings with it."""


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return Store(tmp_path_factory.mktemp("results"))


def made(store: Store, figure: str, *overrides: str) -> Stages:
    """What the four stages make."""
    return stages(smoke(figure, *overrides), store)


def filled(result: object) -> dict[str, np.ndarray]:
    """Arrays of a result that are there."""
    return {name: value for name, value in vars(result).items() if isinstance(value, np.ndarray)}


OBSERVED = "sweep.phase_source=observed2d"
COARSE = "sweep.view_angle_deg.step=45"


@pytest.mark.parametrize("figure", ["zhang2007_fig3", "zhang2007_fig4", "zhang2007_fig5", "zhang2004_fig4"])
def test_with_the_phase_unknown_a_known_view_costs_little(figure: str, store: Store) -> None:
    paper, ours = (filled(made(store, figure, *o).sweep) for o in ((), (OBSERVED,)))
    assert set(ours) - set(paper) == FOUND
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
    paper, ours = (made(store, figure, COARSE, *o).sweep for o in ((), (OBSERVED,)))
    assert ours.remarks == []
    assert ours.converged.all()
    assert set(filled(ours)) - set(filled(paper)) == FOUND
    off = [np.abs(angle_difference_deg(a.angle_deg, ours.view_angle_deg)).mean() for a in (paper, ours)]
    assert off[1] < 1.1 * off[0] + 0.1
    assert (ours.runner_up_cost >= ours.cost).all()


def test_frequency_and_phase_are_near_those_of_the_motion(store: Store) -> None:
    _, samples, _, swept = made(store, "zhang2007_fig5", OBSERVED)
    known = samples.frequency_hz
    assert np.abs(swept.frequency_hz / known[:, None] - 1).max() < 0.01
    assert (swept.frequency_hz != known[:, None]).any()
    assert np.degrees(np.abs(swept.phase_error_rad)).max() < 15.0
    assert np.degrees(np.median(np.abs(swept.phase_error_rad))) < 2.0


def test_the_path_over_sigma2_meets_the_error_at_the_configured_one(store: Store) -> None:
    swept = made(store, "zhang2007_fig5", OBSERVED).sweep
    at = int(np.flatnonzero(swept.sigma2_mm2 == 70.0)[0])
    of_map = swept.absolute_error_mm2[list(swept.methods).index("map")]
    assert np.allclose(swept.path_walker_mm2[:, at], of_map.mean(axis=(1, 2)), rtol=1e-6)
    assert np.allclose(swept.path_view_mm2[:, at], of_map.mean(axis=(0, 2)), rtol=1e-6)


@pytest.mark.parametrize(
    "overrides", [["dataset.origin=floor"], ["dataset.size=stature"], ["dataset.walks=all"]]
)
def test_the_clip_is_the_one_that_the_sample_came_from(overrides: list[str], store: Store) -> None:
    walks, samples, learnt, _ = made(store, "zhang2007_fig5", *overrides)
    assert isinstance(walks, Walks)
    # Backwards, so that a walk is not its sample's number.
    backwards = {name: values[::-1] for name, values in filled(samples).items()}
    turned_round = dataclasses.replace(samples, **backwards)
    for r, walk in enumerate(turned_round.walk):
        seen = Observed2d(learnt.fold(r), walks, turned_round, r, np.array([0.0, np.pi / 2]))
        sample = turned_round.coefficients[r]
        series = fourier.shift(seen.clip.coefficients, seen._phase)
        assert np.abs(series - sample).max() < 0.05 * np.abs(sample[1:]).max()
        assert np.abs(series[:, 0] - sample[0]).max() < 5.0
        # The phase is that of the motion's own series at the frequency of the view.
        for a, frequency in enumerate(seen.clip.frequency_hz):
            own = fourier.represent(
                walks.motion(walk), walks.frame_rate_hz[walk], frequency_hz=float(frequency)
            )
            assert abs(np.sin(own.phase_rad - seen._phase[a])) < 1e-3


def test_against_the_fourier_part_the_residual_is_left_out(store: Store) -> None:
    motion, series = (
        made(store, "zhang2007_fig5", OBSERVED, f"sweep.truth={t}").sweep for t in ("motion", "fourier")
    )
    assert (series.absolute_error_mm2 < motion.absolute_error_mm2).all()
    more = motion.absolute_error_mm2.mean(axis=-1) - series.absolute_error_mm2.mean(axis=-1)
    less = motion.missing_variance_mm2 - series.missing_variance_mm2
    assert np.allclose(more, less, rtol=1e-6)


def test_the_papers_way_is_the_default_and_looks_at_samples_alone(store: Store) -> None:
    experiment = smoke("zhang2007_fig5")
    kept = stored_stages(experiment, store)
    _, samples, learnt, ours = (of_stage.value for of_stage in kept)
    view = np.radians(ours.view_angle_deg)
    for r in (0, 5):
        for m, noise in enumerate((None, 70.0)):
            direct = reconstruction.from_known_views(
                learnt.fold(r), learnt.samples[r], view, noise_variance=noise
            )
            expected = errors.absolute_error(
                direct.delta, errors.along_missing(samples.residual_covariance[r], view)
            )
            assert np.array_equal(ours.absolute_error_mm2[m, r], expected)

    other_clips = dataclasses.replace(kept[0], artefact=dataclasses.replace(kept[0].artefact, key="0" * 16))
    observed = smoke("zhang2007_fig5", OBSERVED)
    keys = [
        sweep.run(options, clips, *kept[1:3], store).artefact.key
        for options in (experiment, observed)
        for clips in (kept[0], other_clips)
    ]
    assert keys[0] == keys[1] == kept[3].artefact.key, "the clips are no input"
    assert len(set(keys)) == 3, "of the views' own phase they are"


def test_the_papers_way_with_an_unknown_view_is_the_default(store: Store) -> None:
    _, _, learnt, ours = made(store, "zhang2007_fig6")
    walker = unflatten(learnt.samples[3])
    image = np.stack([camera.project(walker, a).ravel() for a in np.radians(ours.view_angle_deg)])
    direct = viewpoint.estimate(learnt.fold(3), image, method="map", noise_variance=70.0)
    assert np.array_equal(ours.angle_deg[1, 3], np.degrees(direct.angle_rad))


@pytest.mark.parametrize(
    ("figure", "overrides", "words"),
    [
        ("zhang2007_fig5", ["sweep.phase_source=motion2d"], ["sweep.phase_source", "motion3d, observed2d"]),
        ("zhang2007_fig6", ["sweep.phase_source=''"], ["sweep.phase_source", "motion3d, observed2d"]),
        ("zhang2007_fig6", [OBSERVED, "sweep.solver=published"], ["sweep.solver: only the global solver"]),
    ],
)
def test_what_cannot_be_is_refused(figure: str, overrides: list[str], words: list[str]) -> None:
    with pytest.raises(Exception) as caught:  # of composition, or ours
        smoke(figure, *overrides)
    said = sentence(caught.value)
    assert [word for word in words if word not in said] == [], said


@pytest.mark.parametrize("figure", ["zhang2007_fig5", "zhang2007_fig6"])
def test_a_figure_is_made_with_the_phase_unknown(figure: str, store: Store, tmp_path: Path) -> None:
    experiment = smoke(figure, COARSE, OBSERVED, "figure.picture=false", "figure.recording=false")
    outcome = make_figure(experiment, tmp_path / figure, store=store)
    table = tables.read(outcome.folder / "table.csv")
    ours = np.isin(table["method"], ["least_squares", "map"])
    assert ours.sum() == 2 * 5
    with np.load(outcome.folder / "arrays.npz", allow_pickle=False) as arrays:
        assert arrays["phase_error_rad"].shape == (2, 12, 5)
