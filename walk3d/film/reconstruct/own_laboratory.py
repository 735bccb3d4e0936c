"""Calibration of the shipped model on the 3D walks of a few people from another laboratory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.clips.kinds import Walks
from pipeline.core import fourier
from walk3d.anatomy import prior as anatomical
from walk3d.film.reconstruct.model_file import TrainedModel
from walk3d.film.simulation.filmed import training_walks
from walk3d.film.walk import CompactMoments, expand, model_of


def calibrate(trained: TrainedModel, walks: Walks) -> TrainedModel:
    """Shift the joints of a model to a laboratory's joint definitions, learnt from walks of a few people there.

    Parameters
    ----------
    trained : TrainedModel
        Model of other laboratories.
    walks : Walks
        Walks of one or more people of the new laboratory.

    Notes
    -----
    Only the average walker moves, in its constant coefficients.  Differences between people and the multipliers of
    error bars stay those of the model.  Size is not calibrated, since one camera cannot distinguish it from distance.
    """
    people = list(dict.fromkeys(walks.person.tolist()))
    each = anatomical.by_block(np.stack([walk.walker for walk in training_walks(walks)]))
    both = (each + fourier.mirrored(each)) / 2.0
    moved = calibrated(
        trained.compact,
        np.stack([both[walks.person == person].mean(axis=0) for person in people]),
        trained.concentration,
    )
    counts = {"people": len(people), "walks": len(walks)}
    return replace(trained, compact=moved, about={**trained.about, "calibrated_on": counts})


def calibrated(compact: CompactMoments, walkers: np.ndarray, share: float) -> CompactMoments:
    """Return statistics of walkers whose average walker is calibrated on the walkers of one laboratory.

    Parameters
    ----------
    compact : CompactMoments
    walkers : (K, 9, 15, 3)
        Fourier coefficients, mm, one entry per person, mean of left and right.
    share : float
        Concentration of the laboratories of the model, see `walk3d.anatomy.prior.concentration`.
    """
    model = model_of(expand(compact))
    shape = (*model.mean.shape, *model.mean.shape)
    prior = anatomical.Prior(
        model.mean, model.covariance.reshape(shape), model.bone_variance, model.pair_variance
    )
    calibrated_prior = anatomical.unfamiliar(prior, anatomical.Differences(size=0.0), share, list(walkers))
    return replace(compact, mean=calibrated_prior.mean)
