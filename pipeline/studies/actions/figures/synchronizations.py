"""What the figures of mozerov2006 share: the ways of synchronizing an action, and what lies along their time.

``raw``           performances as recorded, each of its own length
``linear``        one constant rate each                                             [mozerov2006 7]
``keyframe``      the same number of samples between key-frames, the paper's comparison
``synchronized``  brought to the rate of the median sequence, the paper's proposal    [mozerov2006 18]
``true_warp``     brought to it by the true course of the action, where that is known
"""

from __future__ import annotations

import numpy as np

from pipeline.core import posture, synchronization
from pipeline.core.action_model import variance_left
from pipeline.core.aspace import ASpace
from pipeline.studies.actions.learning import limb_lengths_of, split
from pipeline.studies.figure_inputs import ANKLE_HEIGHT_MM, Made
from pipeline.studies.options import ActionSpaceModel, PostureDataset

STAGES = ("raw", "linear", "keyframe", "synchronized")

STAGE_NAMES = {
    "raw": "not synchronized",
    "linear": "linearly synchronized",
    "keyframe": "synchronized by key-frames",
    "synchronized": "synchronized automatically",
    "true_warp": "synchronized by the true course",
}
STAGE_COLOURS = {
    "raw": "grey",
    "linear": "orange",
    "keyframe": "green",
    "synchronized": "blue",
    "true_warp": "purple",
}

SIDE_BY_SIDE_MM = 650.0
"""From the middle to either of two people who are shown together."""


def options_of(made: Made) -> ActionSpaceModel:
    """The options that the action was learnt with."""
    options = made.config.model
    if not isinstance(options, ActionSpaceModel):
        raise TypeError(f"no action is learnt with {type(options).__name__}")
    return options


def sequences(made: Made, stage: str) -> list[np.ndarray]:
    """Every performance in the aSpace: (F_i, b) when raw, else (P, b)."""
    arrays = made.model.arrays
    if stage == "raw":
        return split(arrays["raw"], arrays["first"])
    if stage == "true_warp":
        warps = true_frames(made)
        return [read_at(x, at) for x, at in zip(sequences(made, "raw"), warps, strict=True)]
    return list(arrays[stage])


def read_at(x: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """A sequence (F, b) at fractional frames (P,), linear in between (P, b)."""
    return np.stack([np.interp(frames, np.arange(len(x)), values) for values in x.T], axis=-1)


def lengths(made: Made) -> np.ndarray:
    """Frames of each performance (M,)."""
    return np.diff(made.model.arrays["first"])


def durations_s(made: Made) -> np.ndarray:
    """Seconds from the first to the last frame of each performance (M,)."""
    return np.asarray((lengths(made) - 1) / made.dataset.arrays["frame_rate_hz"])


def linear_frames(made: Made) -> np.ndarray:
    """Frame of each performance, fractional, at each sample of a constant rate (M, P)."""
    samples = made.model.arrays["linear"].shape[1]
    return np.asarray((lengths(made) - 1)[:, None] * np.arange(samples) / (samples - 1))


def synchronized_frames(made: Made) -> np.ndarray:
    """Frame of each performance, fractional, that matches each sample of the median sequence (M, P)."""
    tau = synchronization.rate_to_rate(made.model.arrays["disparity"])
    return np.asarray((lengths(made) - 1)[:, None] * tau / (tau.shape[1] - 1))


def key_frame_frames(made: Made) -> np.ndarray:
    """The same by key-frames: where each performance is when the median sequence has come to a sample (M, P)."""
    warp, median = made.model.arrays["keyframe_warp"], made.model.notes["median"]
    at = linear_frames(made)[median]
    return np.stack([np.interp(at, warp[median], frames) for frames in warp])


def true_frames(made: Made) -> np.ndarray:
    """The same by the true course of the action, which only synthetic performances have (M, P)."""
    phases = split(made.dataset.arrays["phase"], made.dataset.arrays["first"])
    median = made.model.notes["median"]
    at = linear_frames(made)[median]
    there = np.interp(at, np.arange(len(phases[median])), phases[median])
    return np.stack([np.interp(there, phase, np.arange(len(phase))) for phase in phases])


def farthest(made: Made) -> int:
    """The performance that differs most from the median sequence in time: the largest disparity, the first on ties."""
    return int(np.abs(made.model.arrays["disparity"]).max(axis=1).argmax())


def variances_left(made: Made, stage: str) -> tuple[np.ndarray, np.ndarray]:
    """Variance between performances at each sample (P,), and how many performances there are to vary (P,).

    Raw performances are compared frame by frame from their first, as long as two of them last.
    """
    performances = sequences(made, stage)
    lasting = np.sort([len(x) for x in performances])
    frames = np.arange(lasting[-2])
    still = len(lasting) - np.searchsorted(lasting, frames, side="right")
    if lasting[0] == lasting[-1]:
        return variance_left(np.stack(performances)), still
    each = [variance_left(np.stack([x[p : p + 1] for x in performances if len(x) > p])) for p in frames]
    return np.concatenate(each), still


def mean_variance_left(made: Made, stage: str) -> float:
    """Variance left over all samples, each with the weight of the performances that reach it."""
    variance, weight = variances_left(made, stage)
    return float(np.average(variance, weights=weight))


def aspace_of(made: Made) -> ASpace:
    """The aSpace of the model stage."""
    arrays = made.model.arrays
    return ASpace(
        arrays["mean_posture"],
        arrays["components"],
        arrays["eigenvalues"],
        float(made.model.notes["total_variance"]),
    )


def skeleton(made: Made, coordinates: np.ndarray, performance: int, *, aside_mm: float = 0.0) -> np.ndarray:
    """Joints (T, 15, 3) mm of points (T, b) of the aSpace, with the limbs of a performer, standing on the ground.

    `aside_mm` moves the person to where they face at first, +y, so that two who bend forwards are seen apart from the
    side.
    """
    dataset = made.config.dataset
    if not isinstance(dataset, PostureDataset):
        raise TypeError(f"no postures are made by {type(dataset).__name__}")
    lengths_mm = limb_lengths_of(made.dataset, performance)
    joints = posture.joints(aspace_of(made).postures(coordinates), lengths_mm, frame=dataset.frame)
    return np.asarray(joints + np.array([0.0, aside_mm, ANKLE_HEIGHT_MM]))
