"""Performances in every alignment as table rows, lines and skeletons, for the figures of mozerov2006."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import pandas as pd

from pipeline.core import posture
from pipeline.core.action_model import variance_left
from pipeline.palette import Style
from pipeline.studies.actions.dataset import Postures
from pipeline.studies.actions.model import ALIGNMENTS, Action, ActionSpaceModel
from pipeline.studies.figure_inputs import ANKLE_HEIGHT_MM, FigureInputs

STYLES = {
    "raw": Style("not synchronized", "grey"),
    "linear": Style("linearly synchronized", "orange"),
    "keyframe": Style("synchronized by key-frames", "green"),
    "synchronized": Style("synchronized automatically", "blue"),
}

Inputs = FigureInputs[Postures, Action, Any]


def options_of(inputs: Inputs) -> ActionSpaceModel:
    """Return the options of the model stage with which the action model was learnt."""
    return cast(ActionSpaceModel, inputs.experiment.model)


def sequence_rows(inputs: Inputs, components: Sequence[int]) -> pd.DataFrame:
    """Return a row for each alignment, performance, sample and component of the posture space, counted from 1."""
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "performance": name,
                    "stage": alignment,
                    "sample": np.arange(len(x)),
                    "component": component,
                    "value": x[:, component - 1],
                }
            )
            for alignment in ALIGNMENTS
            for name, x in zip(inputs.samples, inputs.model.sequences(alignment), strict=True)
            for component in components
        ],
        ignore_index=True,
    )


def mean_variance_left(performances: Sequence[np.ndarray]) -> float:
    """Return the variance between performances, averaged over samples and weighted by the number of performances.

    Performances of unequal lengths are compared frame by frame, while at least two of them last.
    """
    lengths = np.sort([len(x) for x in performances])
    frames = np.arange(lengths[-2])
    lasting = len(lengths) - np.searchsorted(lengths, frames, side="right")
    each = [variance_left(np.stack([x[p : p + 1] for x in performances if len(x) > p])) for p in frames]
    return np.average(np.concatenate(each), weights=lasting)


def skeleton(
    inputs: Inputs, coordinates: np.ndarray, performance: int, *, aside_mm: float = 0.0
) -> np.ndarray:
    """Return the joints (T, 15, 3), mm, of a performer who stands on the ground, from aSpace coordinates (T, b).

    `aside_mm` moves the person along the first heading, +y, so that two people who bend forwards do not overlap when
    seen from the side.
    """
    dataset = inputs.dataset
    postures = inputs.model.space.postures(coordinates)
    joints = posture.joints(postures, dataset.body(performance), frame=dataset.frame)
    return joints + np.array([0.0, aside_mm, ANKLE_HEIGHT_MM])
