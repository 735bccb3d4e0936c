"""Accepted postures drawn from the action model, and how far they lie from what was recorded: mozerov2006 figure 4.

"For each selected mean posture, only similar and meaningful postures are generated."  Similar is measured by the
distance from the mean posture, meaningful by that to the nearest recorded posture; both are to be read beside the
recorded postures of the same frame, and beside postures that the action model rejects.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from pipeline.core import action_model, posture
from pipeline.core.action_model import ActionModel
from pipeline.core.aspace import ASpace
from pipeline.core.posture import LimbLengths
from pipeline.storage.store import Artefact
from pipeline.studies.actions.held_out import frame_of
from pipeline.studies.options import PostureSamplesSweep
from pipeline.threads import map_threads
from pipeline.validation import InvalidInput

KINDS = ("accepted", "outside", "training")
"""Drawn within the bounds; every coordinate drawn beyond them; recorded, synchronized, at this frame."""

BEYOND = (1.0, 3.0)
"""How many standard deviations beyond the bounds the rejected postures are drawn."""

_STREAM = 20064  # keeps these draws apart from those of other stages with the same seed
_BLOCK = 64


def measure(
    options: PostureSamplesSweep, dataset: Artefact, model: Artefact, workers: int, seed: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Mean postures, accepted ones to be shown, and distances of many to the recorded ones.

    Parameters
    ----------
    options : PostureSamplesSweep
        Frames are postures of the mean performance, counted from 1 as [mozerov2006 2, 6] counts them.
    dataset, model : Artefact
    workers, seed : int

    Returns
    -------
    arrays : dict
        ``frames`` (N,); ``mean_joints`` (N, 15, 3), ``sample_joints`` (N, S, 15, 3), ``mean_performance``
        (P, 15, 3) in mm of a body with the actors' mean limb lengths; ``kinds`` (K,); ``draws``, ``acceptance``,
        ``nearest_training_mm``, ``nearest_training_max_mm``, ``spread_mm``, ``limb_direction_norm_min``,
        ``limb_direction_norm_max``, ``bounds_held_fraction`` (N, K).
    notes : dict
        The bound.

    Raises
    ------
    InvalidInput
        Frames that the mean performance does not have, or nothing to draw.
    """
    arrays, bound = model.arrays, float(model.notes["options"]["bound"])
    space = ASpace(
        arrays["mean_posture"], arrays["components"], arrays["eigenvalues"], model.notes["total_variance"]
    )
    performances = arrays["synchronized"]
    learnt = ActionModel(arrays["mean"], arrays["standard_deviation"], arrays["floored"], len(performances))
    _check(options, len(learnt.mean))
    body, frame = mean_body(dataset), frame_of(dataset)

    def joints(coordinates: np.ndarray) -> np.ndarray:
        return posture.joints(space.postures(coordinates), body, frame=frame)

    training = joints(performances)
    found: dict[str, list[list[float]]] = {}
    samples = []
    for number in options.frames:
        at = number - 1
        generator = np.random.default_rng([seed, _STREAM, number])
        drawn = {
            "accepted": action_model.sample(learnt, options.measured, generator, at=at, bound=bound),
            "outside": beyond(learnt, options.measured, generator, at=at, bound=bound),
            "training": performances[:, at],
        }
        samples.append(joints(drawn["accepted"][: options.samples]))
        rows = [
            _measured(learnt, space, drawn[kind], joints, training, at, bound, kind == "training", workers)
            for kind in KINDS
        ]
        for name in rows[0]:
            found.setdefault(name, []).append([row[name] for row in rows])
    mean_performance = joints(learnt.mean)
    return {
        "frames": np.array(options.frames),
        "mean_joints": mean_performance[np.array(options.frames) - 1],
        "sample_joints": np.stack(samples),
        "mean_performance": mean_performance,
        "kinds": np.array(KINDS),
        **{name: np.array(values) for name, values in found.items()},
    }, {"bound": bound}


def mean_body(dataset: Artefact) -> LimbLengths:
    """Limb lengths of a body that is the mean of the actors', each counted as often as it performs."""
    arrays = dataset.arrays
    return LimbLengths(*(arrays[name].mean(axis=0) for name in ("limbs_mm", "pelvis_mm", "shoulders_mm")))


def beyond(
    model: ActionModel, count: int, generator: np.random.Generator, *, at: int, bound: float
) -> np.ndarray:
    """Postures (count, b) that the action model rejects: every coordinate beyond the bounds, on either side.

    Parameters
    ----------
    model : ActionModel
    count : int
    generator : numpy.random.Generator
    at : int
        The sample at which to draw.
    bound : float
        Standard deviations.
    """
    shape = (count, model.mean.shape[1])
    far = bound + generator.uniform(*BEYOND, shape)
    side = np.where(generator.random(shape) < 0.5, -1.0, 1.0)
    return np.asarray(model.mean[at] + side * far * model.standard_deviation[at])


def nearest(joints: np.ndarray, recorded: np.ndarray, workers: int) -> np.ndarray:
    """Mean joint distance (S, M) in mm from each posture to the nearest one of each performance.

    Parameters
    ----------
    joints : (S, J, 3)
        mm.
    recorded : (M, P, J, 3)
        mm.
    workers : int
    """
    count, length = recorded.shape[:2]
    flat = recorded.reshape(count * length, *recorded.shape[2:])
    powers = (flat**2).sum(axis=-1)

    def block(first: int) -> np.ndarray:
        some = joints[first : first + _BLOCK]
        total = np.zeros((len(some), len(flat)))
        for j in range(joints.shape[1]):
            # |a - b|² by one product of matrices: a hundredth of a millimetre is lost in it at most.
            squares = (some[:, j] ** 2).sum(axis=-1)[:, None] + powers[:, j] - 2.0 * some[:, j] @ flat[:, j].T
            total += np.sqrt(np.maximum(squares, 0.0))
        return total.reshape(len(some), count, length).min(axis=-1) / joints.shape[1]

    return np.concatenate(map_threads(block, range(0, len(joints), _BLOCK), workers))


def _measured(
    learnt: ActionModel,
    space: ASpace,
    coordinates: np.ndarray,
    joints: Callable[[np.ndarray], np.ndarray],
    training: np.ndarray,
    at: int,
    bound: float,
    recorded: bool,
    workers: int,
) -> dict[str, float]:
    """What is said of postures of one kind at one frame."""
    drawn = joints(coordinates)
    distances = nearest(drawn, training, workers)
    if recorded:
        # The nearest of the other performances: its own posture is no distance away.
        np.fill_diagonal(distances, np.inf)
    closest = distances.min(axis=1)
    from_mean = np.linalg.norm(drawn - joints(learnt.mean[at]), axis=-1).mean(axis=-1)
    cosines = space.postures(coordinates)[:, 1:].reshape(len(coordinates), -1, 3)
    norms = np.linalg.norm(cosines, axis=-1)
    away = np.abs(coordinates - learnt.mean[at])
    return {
        "draws": len(coordinates),
        "acceptance": float(action_model.accepted(learnt, coordinates, at=at, bound=bound).mean()),
        "nearest_training_mm": float(np.median(closest)),
        "nearest_training_max_mm": float(closest.max()),
        "spread_mm": float(np.median(from_mean)),
        "limb_direction_norm_min": float(norms.min()),
        "limb_direction_norm_max": float(norms.max()),
        "bounds_held_fraction": float((away <= bound * learnt.standard_deviation[at]).mean()),
    }


def _check(options: PostureSamplesSweep, length: int) -> None:
    frames = options.frames
    if not frames or len(set(frames)) < len(frames) or not all(1 <= f <= length for f in frames):
        raise InvalidInput(
            "the mean performance has no such frames, or they stand twice",
            where="sweep.frames",
            expected=f"some of 1 to {length}",
            received=", ".join(map(str, frames)) or "none",
        )
    if not 1 <= options.samples <= options.measured:
        raise InvalidInput(
            "not so many postures to show",
            where="sweep.samples",
            expected=f"1 to sweep.measured, {options.measured}",
            received=str(options.samples),
        )
