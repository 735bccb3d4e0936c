"""How close a way of synchronizing comes to the key-frames: "the results are very similar", mozerov2006 section 4.

Two results can agree on which postures belong together and still run along another common time: key-frames come to
lie at their mean relative times, automatic synchronization keeps the time of the median sequence.  That time is
arbitrary and is not to count, so the comparison is made in two ways that do not see it:

Sequences
    The key-frame result is brought to the stage's time as a whole: one disparity function, that of its mean
    performance onto the stage's, is applied to all of its performances.  The root mean square of the difference that
    is left, over samples and dimensions, is in units of the aSpace.
Correspondences
    While the median sequence shows a sample, each performance shows a frame: by the one synchronization and by the
    other.  Their distance is in frames of the performance; the median sequence, whose frame is its own, is left out.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.core import synchronization
from pipeline.core.action_model import mean_squared_deviation
from pipeline.studies.actions.figures.synchronizations import (
    STAGES,
    key_frame_frames,
    linear_frames,
    mean_variance_left,
    options_of,
    sequences,
    synchronized_frames,
)
from pipeline.studies.figure_inputs import Made, sd

_MATCHED = {"linear": linear_frames, "keyframe": key_frame_frames, "synchronized": synchronized_frames}


def sequence_differences(made: Made, stage: str) -> tuple[np.ndarray, float]:
    """Root mean square difference of each performance (M,) from its key-frame result, and of the mean performances."""
    options = options_of(made)
    ours = np.stack(sequences(made, stage))
    theirs = np.stack(sequences(made, "keyframe"))
    common = synchronization.synchronize(
        ours.mean(axis=0),
        theirs.mean(axis=0),
        max_disparity=options.max_disparity,
        smoothness=float(made.model.notes["smoothness"]),
        penalty=options.penalty,
        start=options.start,
        steps=options.steps,
    ).disparity
    theirs = synchronization.warp(theirs, np.broadcast_to(common, theirs.shape[:2]))
    each = ((ours - theirs) ** 2).mean(axis=(1, 2))
    means = ((ours.mean(axis=0) - theirs.mean(axis=0)) ** 2).mean()
    return np.sqrt(each), float(np.sqrt(means))


def correspondence_differences(made: Made, stage: str) -> np.ndarray:
    """Mean distance in frames (M - 1,), over samples, of the frames matched with the median sequence."""
    off = np.abs(_MATCHED[stage](made) - key_frame_frames(made)).mean(axis=1)
    return np.delete(off, int(made.model.notes["median"]))


def stages_compared(made: Made) -> dict[str, Any]:
    """Columns of ``table_stages``: what each way of synchronizing leaves, accepts, and how far it is from key-frames.

    Empty where a number means nothing: raw performances have no samples in common, and one person alone cannot be
    left out.
    """
    arrays = made.model.arrays
    linear = mean_variance_left(made, "linear")
    deviation = np.sqrt(mean_squared_deviation(arrays["linear"]) / arrays["linear"].shape[2])
    rows = []
    for stage in STAGES:
        left = mean_variance_left(made, stage)
        row = {
            "stage": stage,
            "variance_left": left,
            "variance_left_to_linear": left / linear,
            "acceptance": _mean(arrays.get(f"accepted_{stage}")),
            "acceptance_person": _mean(arrays.get(f"accepted_person_{stage}")),
            **dict.fromkeys(_FROM_KEYFRAME, np.nan),
        }
        if stage != "raw":
            each, of_means = sequence_differences(made, stage)
            frames = correspondence_differences(made, stage)
            rms = np.sqrt((each**2).mean())
            values = (rms, sd(each, 0), of_means, rms / deviation, frames.mean(), sd(frames, 0))
            row |= dict(zip(_FROM_KEYFRAME, map(float, values), strict=True))
        rows.append(row)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


_FROM_KEYFRAME = (
    "rms_from_keyframe",
    "rms_from_keyframe_sd",
    "rms_of_mean_from_keyframe",
    "rms_from_keyframe_to_deviation",
    "warp_from_keyframe_frames",
    "warp_from_keyframe_sd_frames",
)


def _mean(accepted: np.ndarray | None) -> float:
    return float("nan") if accepted is None else float(accepted.mean())
