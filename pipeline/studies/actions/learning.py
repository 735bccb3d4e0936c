"""An action learnt with the options of the model stage: of all performances, or with some held out."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from pipeline.core.action_model import LearntAction
from pipeline.core.action_model import learn_action as learn
from pipeline.core.posture import LimbLengths
from pipeline.storage.store import Artefact
from pipeline.studies.options import ActionSpaceModel
from pipeline.validation import InvalidInput


def postures_of(dataset: Artefact) -> list[np.ndarray]:
    """Postures (F_i, 37) of each performance, out of the dataset stage's artefact."""
    return split(dataset.arrays["postures"], dataset.arrays["first"])


def split(values: np.ndarray, first: np.ndarray) -> list[np.ndarray]:
    """What lies end to end, one array to a clip."""
    return [values[a:b] for a, b in pairwise(first)]


def limb_lengths_of(dataset: Artefact, performance: int) -> LimbLengths:
    """Lengths of one performer's limbs."""
    arrays = dataset.arrays
    return LimbLengths(
        arrays["limbs_mm"][performance], arrays["pelvis_mm"][performance], arrays["shoulders_mm"][performance]
    )


def learn_action(options: ActionSpaceModel, postures: Sequence[np.ndarray]) -> LearntAction:
    """What these performances teach, with the options of the model.

    Raises
    ------
    InvalidInput
        If mu is not positive, the band is wider than the sequence, or as `action_model.learn_action`.
    """
    if not options.smoothness > 0:
        raise InvalidInput(
            "the smoothness is not positive: nothing would hold the path together",
            where="model.smoothness",
            expected="mu > 0; sweep=smoothness shows what less of it does",
            received=f"{options.smoothness:g}",
        )
    if not 0 < options.max_disparity < options.samples:
        raise InvalidInput(
            "the band is wider than the sequence" if options.max_disparity > 0 else "the band has no width",
            where="model.max_disparity",
            expected=f"1 to {options.samples - 1}, less than model.samples",
            received=str(options.max_disparity),
        )
    return learn(
        postures,
        samples=options.samples,
        variance=options.variance,
        dimensions=options.dimensions or None,
        max_disparity=options.max_disparity,
        smoothness=options.smoothness,
        penalty=options.penalty,
        start=options.start,
        steps=options.steps,
    )
