"""The model that comes with the package, for people of another laboratory of whom a few are known in 3D."""

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
    """Move the joints of a model to where a laboratory puts them, as far as persons do not differ by as much.

    Parameters
    ----------
    trained : TrainedModel
        Of other laboratories.
    walks : Walks
        Of one person or more.

    Notes
    -----
    The average walker alone moves, by its constant coefficients; what people differ by, and the multipliers of error
    bars, stay those of the model.  Size is left to the distance.
    """
    people = list(dict.fromkeys(walks.person.tolist()))
    each = anatomical.by_block(np.stack([walk.walker for walk in training_walks(walks)]))
    both = (each + fourier.mirrored(each)) / 2.0
    moved = calibrated(
        trained.compact,
        np.stack([both[walks.person == person].mean(axis=0) for person in people]),
        trained.concentration,
    )
    known = {"people": len(people), "walks": len(walks)}
    return replace(trained, compact=moved, about={**trained.about, "calibrated_on": known})


def calibrated(compact: CompactMoments, known: np.ndarray, share: float) -> CompactMoments:
    """Return moments whose average walker is that of a laboratory with the known walkers, mm.

    Parameters
    ----------
    compact : CompactMoments
    known : (K, 9, 15, 3)
        Fourier representations, one to each person, mean of left and right.
    share : float
        Of the laboratories of the model, as `walk3d.anatomy.prior.concentration` gives it.
    """
    model = model_of(expand(compact))
    shape = (*model.mean.shape, *model.mean.shape)
    prior = anatomical.Prior(
        model.mean, model.covariance.reshape(shape), model.bone_variance, model.pair_variance
    )
    found = anatomical.unfamiliar(prior, anatomical.Differences(size=0.0), share, list(known))
    return replace(compact, mean=found.mean)
