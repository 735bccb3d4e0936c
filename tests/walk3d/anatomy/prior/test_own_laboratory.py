"""Tests of a prior from other laboratories that is calibrated on a few people of the walker's laboratory."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline import plugins
from pipeline.cli.compose import compose
from pipeline.clips.kinds import WALKS, Walks
from pipeline.core import errors, fourier
from pipeline.studies.eigenwalkers.samples import FourierDataset, FourierSamples, Selection
from tests.rejects import rejects
from tests.strategies import walkers
from tests.walk3d.anatomy.study.test_anatomical import samples
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.other_laboratories import OtherLaboratories
from walk3d.anatomy.prior.own_laboratory import Learnt, calibrated, height_mm, truncated
from walk3d.film.reconstruct.model_file import TrainedModel, load
from walk3d.film.simulation.filmed import training_walks
from walk3d.film.walk import compact, moments

VIEWS = np.radians([0.0, 30.0, 60.0, 90.0])
MIRROR = os.environ.get("MOCAP_MIRROR", "")


def shipped(harmonics: int = 2) -> Learnt:
    learnt = load().learnt
    return replace(learnt, prior=truncated(learnt.prior, 1 + 2 * harmonics))


def test_the_prior_is_scaled_to_the_height_of_the_walker() -> None:
    learnt = shipped()
    learnt_mm = height_mm(anatomical.by_block(learnt.prior.mean))
    prior = calibrated(learnt, 0.8 * learnt_mm, [], [])
    np.testing.assert_allclose(prior.mean, 0.8 * learnt.prior.mean)
    expected = anatomical.unfamiliar(learnt.prior, anatomical.Differences(), learnt.share)
    np.testing.assert_allclose(prior.covariance, 0.64 * expected.covariance, atol=250.0)  # offsets keep 25 mm
    harmonic = np.s_[:, :, 1:, :, :, 1:]
    np.testing.assert_allclose(prior.covariance[harmonic], 0.64 * expected.covariance[harmonic])


def test_covariances_are_pooled_by_numbers_of_people() -> None:
    """The covariances of n and K people are pooled as (n C + K S) / (n + K), where 36 people count as n = 18."""
    learnt, people = shipped(), list(walkers(np.random.default_rng(3), 4))
    heights = [height_mm(walker) for walker in people]
    height = 1400.0
    prior = calibrated(learnt, height, people, heights)
    alone = calibrated(replace(learnt, people=10**12), height, people, heights)  # K people count nothing
    np.testing.assert_array_equal(alone.mean, prior.mean)
    size = prior.mean.size
    same = [height / tall_mm * walker for walker, tall_mm in zip(people, heights, strict=True)]
    off = [anatomical.by_joint(w) - prior.mean for s in same for w in (s, fourier.mirrored(s))]
    sample = sum(np.outer(o.ravel(), o.ravel()) for o in off) / len(off)
    of_people = anatomical.structured_covariance(sample, 5, anatomical.Shrinkage())
    expected = (18 * alone.covariance.reshape(size, size) + 4 * of_people) / 22
    np.testing.assert_allclose(prior.covariance.reshape(size, size), expected, rtol=1e-6, atol=1e-3)


def test_no_walk_of_the_person_reaches_the_prior_but_by_its_height() -> None:
    """A person's own walks do not change the prior for this person, except by the height of the person.

    Walks 0 and 1 are of one person; the depth of one walk, and all of the other walk, are changed.
    """
    data = samples()
    spoilt = data.coefficients.copy()
    spoilt[0] *= 1.5
    spoilt[1, ..., :2] += 70.0
    before, after = (
        OtherLaboratories(each, shipped()).prior(1) for each in (data, replace(data, coefficients=spoilt))
    )
    np.testing.assert_array_equal(before.mean, after.mean)
    np.testing.assert_array_equal(before.covariance, after.covariance)
    other = data.coefficients.copy()
    other[3] *= 1.1
    moved = OtherLaboratories(replace(data, coefficients=other), shipped()).prior(1)
    assert not np.array_equal(before.covariance, moved.covariance)


def test_the_image_is_kept_and_hidden_joints_are_not_read() -> None:
    data = samples()
    unmeasured = data.unmeasured.copy()
    unmeasured[3, 4] = unmeasured[5, 0] = True
    wrong = data.coefficients.copy()
    wrong[3, :, 4] += 50.0
    wrong[5, :, 0] += 50.0
    lacking = [replace(data, unmeasured=unmeasured), replace(data, unmeasured=unmeasured, coefficients=wrong)]
    for walk in (3, 5):
        results = [OtherLaboratories(each, shipped()).missing(None, walk, VIEWS) for each in lacking]
        assert results[0].shape == (4, 5, 15)
        np.testing.assert_array_equal(*results)


def test_more_harmonics_than_the_model_has_are_rejected() -> None:
    data = samples()
    more = np.zeros((len(data.coefficients), 11, 15, 3))
    with rejects("out_of_range", "dataset.harmonics", value=5):
        OtherLaboratories(replace(data, coefficients=more), shipped(4))


def test_the_option_names_a_method_with_a_model_of_other_people() -> None:
    fig5 = ["experiment=zhang2007_fig5", "scale=smoke"]
    assert compose([*fig5, "model.prior=shipped"]).sweep.methods == ["least_squares", "map", "shipped"]
    chosen = compose([*fig5, "model.prior=shipped", "sweep.methods=[map]"]).sweep
    assert chosen.methods == ["map", "shipped"]
    assert {path.name for path in chosen.further_files(None).values()} == {"manifest.json", "model.npz"}
    assert "walk3d.film.reconstruct.shipped_prior" in chosen.modules()
    with rejects("unknown_choice", "model.prior", value="anatomical"):
        compose([*fig5, "model.prior=anatomical"])
    assert plugins.priors() == ["shipped"]


# --- recorded people --------------------------------------------------------------------------------------


def recorded(source: str) -> tuple[Walks, FourierSamples]:
    experiment = compose(["experiment=zhang2007_fig5", "data=many", f"data.sources=[{source}]"])
    walks = experiment.data.request(WALKS, experiment.skeleton, 1, 1).make()
    assert isinstance(walks, Walks)
    return walks, FourierDataset(walks=Selection.best).build(walks, workers=1)


@pytest.mark.skipif(not Path(MIRROR, "biomechzoo").is_dir() or not MIRROR, reason="needs MOCAP_MIRROR")
@pytest.mark.parametrize(
    ("model_of", "tested", "below_mm2"), [("cmu", "biomechzoo", 563), ("biomechzoo", "cmu", 720)]
)
def test_eight_known_people_of_a_laboratory_that_is_not_in_the_model(
    model_of: str, tested: str, below_mm2: float
) -> None:
    """With eight known people of the tested laboratory, depth errors are below those of zhang2007_sources.

    The 95 % error bars cover 93 to 97 %.
    """
    walks, _ = recorded(model_of)
    sample = moments(training_walks(walks), walks.person)
    about = {"people_by_source": {model_of: sample.walkers}}
    learnt = TrainedModel(compact(sample, (sample.walkers - 1) // 2), {}, about).learnt
    _, data = recorded(tested)
    rng, squares, covered = np.random.default_rng(1), [], []
    for walk in range(len(data.person)):
        others = rng.permutation(np.delete(np.arange(len(data.person)), walk))[:8]
        few = np.array([walk, *others])
        part = replace(
            data,
            **{
                name: getattr(data, name)[few]
                for name in ("coefficients", "unmeasured", "person", "residual_covariance")
            },
        )
        approach = OtherLaboratories(part, learnt)
        prior = approach.prior(0)
        away = anatomical.image_axes(VIEWS)[:, 2]
        true = np.einsum("aj,bkj->abk", away, data.coefficients[walk])
        off = true - approach.missing(None, 0, VIEWS)
        beyond = errors.along_missing(data.residual_covariance[walk], VIEWS)
        squares.append((np.moveaxis(off, 1, -1) ** 2 @ errors.parseval_weights(5) + beyond).mean())
        conditional = anatomical.condition(prior, VIEWS, noise=anatomical.Noise())
        turned = np.einsum(
            "aij,kjb->akib", anatomical.image_axes(VIEWS), anatomical.by_joint(data.coefficients[walk])
        )
        observed = turned.reshape(len(VIEWS), -1)[:, None, ~conditional.unknown]
        posterior = anatomical.fit_lengths(
            conditional, observed, anatomical.tolerances(prior), with_covariance=True
        )
        split = posterior.covariance[:, 0].reshape(len(VIEWS), 15, 5, 15, 5)
        basis = fourier.cycle_basis(fourier.equal_phases(8), 5)
        variance = np.einsum("kp,ajpjq,kq->akj", basis, split, basis)
        covered.append((np.einsum("kp,apj->akj", basis, off) ** 2 <= 1.96**2 * variance).mean())
    assert np.mean(squares) < below_mm2
    assert 0.93 <= np.mean(covered) <= 0.97
