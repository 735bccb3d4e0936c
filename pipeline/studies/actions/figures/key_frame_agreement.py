"""Agreement between synchronization by key-frames and other methods to align performances in time.

The paper claims that "the results are very similar" [mozerov2006 section 4].

Two results can match the same postures and still have different common times: key-frames are placed at their mean
relative times, automatic synchronization keeps the time of the median sequence.  The common time is arbitrary, so two
comparisons are made that do not depend on it:

Sequences
    One disparity function, from the mean performance by key-frames to that of the alignment, is applied to all
    performances by key-frames.  The remaining root mean square difference, over samples and dimensions, is in units
    of the aSpace.
Correspondences
    Each synchronization matches a sample of the median sequence with a frame of every performance.  The distance
    between both frames is in frames of the performance.  The median sequence, which matches itself, is left out.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from pipeline.core import synchronization
from pipeline.core.action_model import mean_squared_deviation
from pipeline.studies.actions.figures.alignments import mean_variance_left
from pipeline.studies.actions.model import ALIGNMENTS, Action, ActionSpaceModel
from pipeline.studies.figure_inputs import sd


def sequence_differences(
    action: Action, options: ActionSpaceModel, alignment: str
) -> tuple[np.ndarray, float]:
    """Return rms differences from synchronization by key-frames, of each performance (M,) and of their mean.

    The first result compares each performance in the given alignment with the same performance synchronized by
    key-frames.  The second compares the means over performances.
    """
    aligned, by_key_frames = np.stack(action.sequences(alignment)), action.keyframe
    common = synchronization.synchronize(
        aligned.mean(axis=0), by_key_frames.mean(axis=0), smoothness=action.smoothness, **options.path_options
    ).disparity
    by_key_frames = synchronization.warp(by_key_frames, np.broadcast_to(common, by_key_frames.shape[:2]))
    each = ((aligned - by_key_frames) ** 2).mean(axis=(1, 2))
    means = ((aligned.mean(axis=0) - by_key_frames.mean(axis=0)) ** 2).mean()
    return np.sqrt(each), np.sqrt(means)


def correspondence_differences(action: Action, alignment: str) -> np.ndarray:
    """Return the mean absolute time difference (M - 1,), frames, between an alignment and key-frames."""
    off = np.abs(action.matched_frames(alignment) - action.matched_frames("keyframe")).mean(axis=1)
    return np.delete(off, action.median)


def alignments_compared(action: Action, options: ActionSpaceModel) -> pd.DataFrame:
    """Return ``table_stages`` with the variance between performances and the acceptance of postures, by alignment.

    Cells are empty where a number is undefined: raw performances have no common samples, and a single person cannot
    be left out.
    """
    linear = mean_variance_left(list(action.linear))
    deviation = np.sqrt(mean_squared_deviation(action.linear) / action.linear.shape[2])
    rows = []
    for alignment in ALIGNMENTS:
        sequences = action.sequences(alignment)
        left = mean_variance_left(sequences)
        row = {
            "stage": alignment,
            "variance_left": left,
            "variance_left_to_all": left / mean_squared_deviation(np.concatenate(sequences)[None]),
            "variance_left_to_linear": left / linear,
            "acceptance": np.mean(action.accepted.performances.get(alignment, np.nan)),
            "acceptance_person": np.mean(action.accepted.people.get(alignment, np.nan)),
        }
        if alignment != "raw":
            each, of_means = sequence_differences(action, options, alignment)
            frames = correspondence_differences(action, alignment)
            rms = np.sqrt((each**2).mean())
            row |= {
                "rms_from_keyframe": rms,
                "rms_from_keyframe_sd": sd(each),
                "rms_of_mean_from_keyframe": of_means,
                "rms_from_keyframe_to_deviation": rms / deviation,
                "warp_from_keyframe_frames": frames.mean(),
                "warp_from_keyframe_sd_frames": sd(frames),
            }
        rows.append(row)
    return pd.DataFrame(rows)
