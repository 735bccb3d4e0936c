"""Tables of individual performances and of their postures: mozerov2006 section 2 and figure 3."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from pipeline.core import action_model, synchronization
from pipeline.core.posture import PARAMETERS
from pipeline.skeleton import POSTURE12, WALKER15
from pipeline.studies.actions.dataset import Postures
from pipeline.studies.actions.figures.alignments import options_of
from pipeline.studies.actions.figures.key_frame_agreement import sequence_differences
from pipeline.studies.actions.figures.new_people import patterns_of_others, variance_along_modes
from pipeline.studies.actions.model import ALIGNMENTS, Action
from pipeline.studies.figure_inputs import FigureInputs, tidy

Inputs = FigureInputs[Postures, Action, Any]


def performances_table(inputs: Inputs) -> pd.DataFrame:
    """Table with a row for each performance, including results of models that are learnt without its person."""
    action, data = inputs.model, inputs.dataset
    postures = data.split(data.postures)
    model = options_of(inputs)
    from_median, from_any = patterns_of_others(
        action.distances, data.person, lambda others: model.teach([postures[m] for m in others]).median
    )
    along, baseline = variance_along_modes(postures, data.person)
    unseen = np.full((len(data.person), 1), np.nan)
    deviation = action.linear - action.linear.mean(axis=(0, 1))
    of_height, of_cosines = _explained(postures, action)
    columns = {
        "performance": inputs.samples,
        "person": data.person,
        "frames": np.diff(action.first),
        "duration_s": data.duration_s,
        "global_distance": action.distances.sum(axis=1),
        "is_median": np.arange(len(inputs.samples)) == action.median,
        "disparity_max_abs": np.abs(action.disparity).max(axis=1),
        **{f"acceptance_{s}": action.accepted.performances[s].mean(axis=1) for s in ALIGNMENTS[1:]},
        **{
            f"acceptance_person_{s}": action.accepted.people.get(s, unseen).mean(axis=1)
            for s in ALIGNMENTS[1:]
        },
        "distance_from_median_of_others": from_median,
        "distance_from_any_of_others": from_any,
        "variance_along_modes_of_others": along,
        "variance_along_numbers_of_others": baseline,
        **{
            f"squared_from_keyframe_{s}": sequence_differences(action, options_of(inputs), s)[0] ** 2
            for s in ("linear", "synchronized")
        },
        "squared_deviation": (deviation**2).mean(axis=(1, 2)),
        "height_explained": of_height,
        "cosines_explained": of_cosines,
        "cosine_change_max": [np.abs(np.diff(_cosines(p), axis=0)).max() for p in postures],
        "angle_change_max": [_angle_change_max(_cosines(p)) for p in postures],
    }
    return tidy(columns, by=["performance"])


def paths_table(inputs: Inputs) -> pd.DataFrame:
    """Return ``table_paths``: cost of the path from each performance to the median sequence, stored and recomputed.

    Recomputed by [mozerov2006 12] with the smoothness and the penalty of the options.  The pattern itself has no path.
    """
    action, options, names = inputs.model, options_of(inputs), np.array(inputs.samples)
    mu = options.smoothness * action_model.mean_squared_deviation(action.linear)
    others = np.flatnonzero(np.arange(len(names)) != action.median)
    recorded = action.distances[action.median, others]
    recomputed = np.array(
        [
            synchronization.synchronization_distance(
                action.linear[action.median],
                action.linear[m],
                action.disparity[m],
                smoothness=mu,
                penalty=options.penalty.value,
            )
            for m in others
        ]
    )
    columns = {
        "performance": names[others],
        "person": inputs.dataset.person[others],
        "distance": recorded,
        "recomputed": recomputed,
        # To nine decimals, since less is rounding.
        "relative_difference": np.round(np.abs(recomputed / recorded - 1.0), 9),
    }
    return tidy(columns, by=["performance"])


def _explained(postures: list[np.ndarray], action: Action) -> list[np.ndarray]:
    """Shares (M,) of the variance of the pelvis height and of the direction cosines that other performances explain."""
    normalised = np.stack([synchronization.normalise(p, action.linear.shape[1]) for p in postures])
    all_in_step = synchronization.warp(normalised, action.disparity)  # (M, P, 37)
    others = (all_in_step.sum(axis=0) - all_in_step) / (len(all_in_step) - 1)
    left = ((all_in_step - others) ** 2).mean(axis=1)
    total = all_in_step.var(axis=1)
    return [
        1.0 - left[:, numbers].sum(axis=1) / total[:, numbers].sum(axis=1)
        for numbers in (slice(1), slice(1, None))
    ]


def _cosines(postures: np.ndarray) -> np.ndarray:
    """Direction cosines (F, 12, 3) of postures (F, 37)."""
    return postures[:, 1:].reshape(len(postures), len(POSTURE12.limbs), 3)


def _angle_change_max(cosines: np.ndarray) -> float:
    """Largest change of the azimuth of any limb from one frame to the next, in half turns.

    The range of an azimuth in half turns is 2, as is the range of a cosine.
    """
    azimuth = np.arctan2(cosines[..., 1], cosines[..., 0])
    return np.abs(np.diff(azimuth, axis=0)).max() / np.pi


def posture_table(inputs: Inputs) -> pd.DataFrame:
    """Table of the length of a posture vector, the largest changes of cosines, and the asymmetry of pair distances."""
    data, distances = inputs.dataset, inputs.model.distances
    cosines = _cosines(data.postures)
    within = np.delete(np.arange(1, len(cosines)), data.first[1:-1] - 1)  # not from one clip to the next
    off_diagonal = ~np.eye(len(distances), dtype=bool)
    row = {
        "limbs": len(POSTURE12.limbs),
        "joints": len(WALKER15.joints),
        "numbers": PARAMETERS,
        "numbers_per_limb": cosines.shape[2],
        "asymmetry": np.abs(distances - distances.T)[off_diagonal].mean() / distances[off_diagonal].mean(),
        "limb_norm_error_max": np.abs(np.linalg.norm(cosines, axis=-1) - 1.0).max(),
        "cosine_change_max": np.abs(cosines[within] - cosines[within - 1]).max(),
    }
    return pd.DataFrame([row])
