"""Test that estimated joints do not affect any error, whatever their positions are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.clips.kinds import Walks
from pipeline.clips.walks import synthetic_walks
from pipeline.core import errors, linear_model, reconstruction
from pipeline.ingestion.data import SyntheticData
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.model import EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierDataset, FourierSamples
from pipeline.studies.study import Grid, SweepInputs
from pipeline.studies.walks.known_view import KnownView, KnownViewErrors, MissingVariance, Truth
from pipeline.studies.walks.methods import PUBLISHED
from pipeline.studies.walks.nested import nested_choice
from pipeline.studies.walks.unknown_view import UnknownView
from tests.rejects import rejects
from walk3d.anatomy.study.model import AnatomicalModel

R, HEAD = 2, WALKER15.index("head")
SIGMA2 = np.array([1.0, 40.0, 200.0, 600.0])
OPTIONS = EigenwalkersModel(components=3)


@pytest.fixture(scope="module")
def people() -> tuple[Walks, FourierSamples]:
    """Return eight walkers from two sources, one of them with an estimated head."""
    data = SyntheticData(name="synthetic", walkers=8, duration_s=4.0)
    clips = synthetic_walks(data, 3, 1)
    estimated = clips.estimated.copy()
    estimated[R, HEAD] = True
    clips = replace(clips, estimated=estimated, source=np.array(["a", "b"] * 4))
    return clips, FourierDataset().build(clips, workers=1)


def planted(clips: Walks, samples: FourierSamples) -> tuple[Walks, FourierSamples]:
    """Return the same walkers with the estimated head moved at random by metres."""
    wild = np.random.default_rng(1)
    changed = {}
    for name, size in (("coefficients", 3e3), ("residual_covariance", 1e5), ("temporal_covariance", 1e6)):
        array = getattr(samples, name).copy()
        position = array[R, ..., HEAD, :] if name == "coefficients" else array[R, HEAD]
        position[...] = wild.normal(scale=size, size=position.shape)
        changed[name] = array
    positions = clips.positions.copy()
    first, last = clips.first[R], clips.first[R + 1]
    positions[first:last, HEAD] += wild.normal(scale=3e3, size=(last - first, 3))
    return replace(clips, positions=positions), replace(samples, **changed)


def measured(sweep: KnownView | UnknownView, clips: Walks, samples: FourierSamples) -> KnownViewErrors:
    model = OPTIONS.learn(samples, workers=1)
    return sweep.measure(SweepInputs(clips, samples, model, OPTIONS, 1, 1))


@pytest.mark.parametrize("truth", Truth)
def test_no_number_of_a_walker_moves_with_an_estimated_joint(
    people: tuple[Walks, FourierSamples], truth: Truth
) -> None:
    sweep = KnownView(
        view_angle_deg=Grid(start=-90, stop=90, step=90),
        sigma2_mm2=Grid(start=1, stop=301, step=100),
        methods=[*PUBLISHED, "anatomical"],
        truth=truth,
        missing_variance=MissingVariance.overall if truth is Truth.motion else MissingVariance.temporal,
    )
    start, moved = measured(sweep, *people), measured(sweep, *planted(*people))
    clip = people[1].clip[R]
    for name in ("rows", "demonstrations", "coefficients", "sigma2", "chosen", "joints"):
        first, other = (getattr(result, name) for result in (start, moved))
        if name in ("sigma2", "chosen"):
            first, other = (rows(people[1].clip) for rows in (first, other))
        first, other = (rows[rows["walker"] == clip].select_dtypes("number") for rows in (first, other))
        unknown = np.zeros(len(first), dtype=bool)
        if name == "joints":  # the estimated one has no error, the others are as they were
            unknown = np.tile(np.arange(15) == HEAD, len(first) // 15)
            assert first["absolute_error_mm2"][unknown].isna().all()
        assert np.isfinite(first[~unknown]).all(axis=None), name
        np.testing.assert_allclose(other[~unknown], first[~unknown], rtol=1e-9, atol=1e-9, err_msg=name)
    observed = np.arange(15) != HEAD
    for name in ("missing", "average_walker"):
        first, other = (getattr(result, name)[..., R, :, :, observed] for result in (start, moved))
        np.testing.assert_allclose(other, first, rtol=1e-9, atol=1e-9, err_msg=name)


def test_the_view_angle_is_found_without_it(people: tuple[Walks, FourierSamples]) -> None:
    sweep = UnknownView(view_angle_deg=Grid(start=-60, stop=60, step=60), methods=list(PUBLISHED))
    start, moved = measured(sweep, *people), measured(sweep, *planted(*people))
    first, other = (result.rows[result.rows["walker"] == people[1].clip[R]] for result in (start, moved))
    np.testing.assert_allclose(other["error_deg"], first["error_deg"], atol=1e-6)
    assert first["error_deg"][first["method"].isin(start.methods)].abs().max() < 20


def test_sigma2_is_chosen_by_the_errors_of_measured_joints(people: tuple[Walks, FourierSamples]) -> None:
    """The selected sigma² equals that of a direct computation without the estimated head."""
    _, samples = planted(*people)
    observed = np.repeat((np.arange(15) != HEAD)[None], 8, axis=0)
    observed[np.arange(8) != R] = True
    views = np.radians([0.0, 50.0, 90.0])
    rows = linear_model.flatten(samples.coefficients)
    votes = np.zeros((8, len(SIGMA2)))
    for model, g, h in linear_model.leave_two_out(rows, OPTIONS.components, groups=np.arange(8)):
        for voter, other in ((g, h), (h, g)):
            of_joints = np.repeat(observed[voter], 3)
            retained = np.tile(of_joints, 5)
            for s, sigma2 in enumerate(SIGMA2):
                for view in views:
                    across = np.array([[np.cos(view), np.sin(view), 0], [0, 0, 1]])
                    away = np.array([-np.sin(view), np.cos(view), 0])
                    E = model.components[:, retained].reshape(OPTIONS.components, -1, 3)
                    d = (rows[voter] - model.mean)[retained].reshape(-1, 3)
                    k = reconstruction.maximum_a_posteriori(
                        (E @ across.T).reshape(OPTIONS.components, -1).T,
                        (d @ across.T).ravel(),
                        model.eigenvalues,
                        noise_variance=float(sigma2),
                    )
                    off = (d - np.tensordot(k, E, axes=1)) @ away
                    votes[other, s] += errors.absolute_error(off.reshape(5, -1)).mean()
    result = nested_choice(samples, OPTIONS, views, SIGMA2, 1)
    np.testing.assert_array_equal(result, votes.argmin(axis=1))


def test_error_bars_are_not_made_of_estimated_joints(people: tuple[Walks, FourierSamples]) -> None:
    with rejects("joints_not_measured", "synthetic_003", joints=["head"]):
        AnatomicalModel().learn(people[1], workers=1)
