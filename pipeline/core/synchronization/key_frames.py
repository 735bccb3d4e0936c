"""Synchronization by key-frames, the baseline in mozerov2006 section 4.

Five key-frames are chosen in each performance, by curvature.

The paper selects them "by hand following a maximum curvature subjective criterion.  Then, the training set was
resampled so each sequence had the same number of frames between each key-frame".  Here a rule does what a hand does.

Curvature
    That of `curvature`: largest where a movement begins or ends.
The same key-frames in every performance
    A hand sees what posture a key-frame shows, and takes the same ones from all performances.  So frames are taken
    where curvature less `CONSISTENCY` times the squared distance from the mean posture of that key-frame is largest,
    and mean postures and frames are found in turn until nothing changes.
Ends
    The first and last frames always correspond [mozerov2006 9]; they are no key-frames.

Legend: ``x`` performance in the aSpace (F, b); ``K`` key-frames; ``P`` samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.core.resampling import interpolate
from pipeline.core.synchronization.curvature import checked, curvature
from pipeline.validation import InvalidInput, require_count, require_shape

SEPARATION, CONSISTENCY = 0.06, 1.0
"""Smallest distance between key-frames, as a fraction of the duration, and weight of posture similarity in their
choice.

The distance also applies between a key-frame and an end of the performance.

The unit of the weight is the largest curvature for a distance of one root mean square deviation.  The variance left
changes by about a tenth between weights of 0.3 and 3, on synthetic bends and on the squats and bends of HDM05.
"""

_ROUNDS, _GRID = 500, 201


@dataclass(frozen=True)
class KeyFrames:
    """Frame indices of the K key-frames in each of M performances, which show corresponding postures.

    Attributes
    ----------
    frames : (M, K) int
        Increasing, the ends of the performance not among them.
    converged : bool
        Whether mean postures and frames agreed in the end.
    n_iterations : int
    """

    frames: np.ndarray
    converged: bool
    n_iterations: int


@dataclass(frozen=True)
class KeyFrameSynchronization:
    """Performances that are resampled so that corresponding key-frames have the same sample index.

    Attributes
    ----------
    sequences : (M, P, b)
    warp : (M, P)
        Frame of each performance, fractional, that became each sample: linear between key-frames.
    samples : (K,) int
        Where the key-frames are now.
    """

    sequences: np.ndarray
    warp: np.ndarray
    samples: np.ndarray


def choose_key_frames(sequences: Sequence[np.ndarray], *, count: int = 5) -> KeyFrames:
    """Choose key-frames of maximum curvature that show corresponding postures in all performances.

    Parameters
    ----------
    sequences : sequence of (F_i, b)
        Performances in the aSpace, of any lengths.
    count : int
        K; five in the paper.

    Raises
    ------
    InvalidInput
        If there are no performances or no key-frames, or performances differ in dimension, are too short for the
        number of key-frames, do not move or are not finite.

    Notes
    -----
    The best frames of a performance for given mean postures are found exactly, by dynamic programming; ties go to the
    earlier.  Frames and mean postures in turn only raise the total score, so they converge; where depends on where they
    begin, which is at the peaks of the mean curvature.  (Several beginnings with the best score kept gave no better
    agreement of timing: a posture is passed on the way down and up.)
    """
    performances = _all_checked(sequences)
    require_count("the number of key-frames", count)
    for number, x in enumerate(performances):
        least = (count + 1) * _apart(len(x)) + 1
        if len(x) < least:
            raise InvalidInput(
                f"too short for {count} key-frames at distances of {SEPARATION:.0%} of the duration",
                f"performance {number}",
                f"{least} frames",
                len(x),
                code="too_short",
                frames=len(x),
                needed=least,
            )
    bends = [curvature(x, where=f"performance {number}") for number, x in enumerate(performances)]
    bends = [c / c.max() for c in bends]
    # To begin with: the peaks of the mean curvature over relative time, and the postures there.
    grid = np.linspace(0.0, 1.0, _GRID)
    common = np.mean([interpolate(c, grid * (len(c) - 1)) for c in bends], axis=0)
    peaks = grid[_best(common, count)]
    postures = [x[np.round(peaks * (len(x) - 1)).astype(int)] for x in performances]
    weight = CONSISTENCY / np.mean([x.var(axis=0).sum() for x in performances])
    frames = np.zeros((len(performances), count), int)
    for iteration in range(1, _ROUNDS + 1):
        before, means = frames, np.mean(postures, axis=0)[:, None]
        frames = np.array(
            [
                _best(c - weight * ((x - means) ** 2).sum(axis=-1), count)
                for x, c in zip(performances, bends, strict=True)
            ]
        )
        if np.array_equal(frames, before):
            return KeyFrames(frames, True, iteration)
        postures = [x[chosen] for x, chosen in zip(performances, frames, strict=True)]
    return KeyFrames(frames, False, _ROUNDS)


def resample_by_key_frames(
    sequences: Sequence[np.ndarray], frames: np.ndarray, n_samples: int
) -> KeyFrameSynchronization:
    """Resample performances linearly, so that corresponding key-frames have the same sample index.

    Parameters
    ----------
    sequences : sequence of (F_i, b)
    frames : (M, K) int
        Key-frames, increasing and without the ends.
    n_samples : int
        P.  Key-frames come to lie at their mean relative times.

    Raises
    ------
    InvalidInput
        Key-frames that do not match the performances, do not increase or are ends, or fewer samples than key-frames
        and ends.
    """
    performances = _all_checked(sequences)
    frames = np.asarray(frames)
    require_shape("key-frames", frames, (len(performances), "K"))
    count = frames.shape[1]
    if n_samples < count + 2:
        raise InvalidInput(
            "too few samples for the key-frames and both ends of a performance",
            expected=f"{count + 2} or more",
            received=n_samples,
            code="too_few_samples",
            samples=n_samples,
        )
    ends = np.array([len(x) - 1 for x in performances])
    nodes = np.column_stack([np.zeros_like(ends), frames, ends])
    steps = np.diff(nodes, axis=1) > 0
    if not steps.all():
        raise InvalidInput(
            "the key-frames do not increase, or include an end of the performance",
            f"performance {(~steps.all(axis=1)).argmax()}",
            code="not_increasing",
        )
    samples = np.round((frames / ends[:, None]).mean(axis=0) * (n_samples - 1)).astype(int)
    # With few samples two key-frames may round to one: moved apart, forwards and then back from the end.
    order = np.arange(1, count + 1)
    samples = np.maximum.accumulate(np.maximum(samples, 1) - order) + order
    samples = np.minimum(samples, n_samples - 1 - order[::-1])
    places = np.concatenate([[0], samples, [n_samples - 1]])
    warp = np.array([np.interp(np.arange(n_samples), places, node) for node in nodes])
    return KeyFrameSynchronization(
        np.stack([interpolate(x, w) for x, w in zip(performances, warp, strict=True)]), warp, samples
    )


def _apart(frames: int) -> int:
    """Return the smallest allowed distance between key-frames, in frames."""
    return max(1, int(np.ceil(SEPARATION * (frames - 1) - 1e-9)))


def _best(score: np.ndarray, count: int) -> np.ndarray:
    """Return the increasing frames (K,) with the largest sum of scores (F,) or (K, F).

    If two choices are equal, the earlier frames are taken.
    """
    score = np.broadcast_to(score, (count, score.shape[-1]))
    frames = score.shape[1]
    distance = _apart(frames)
    inner = slice(distance, frames - distance)
    total = np.full((count, frames), -np.inf)
    before = np.zeros((count, frames), int)
    total[0, inner] = score[0, inner]
    for k in range(1, count):
        most = np.maximum.accumulate(total[k - 1])
        # Where that largest total was first reached.
        reached = np.maximum.accumulate(np.where(np.r_[False, most[1:] > most[:-1]], np.arange(frames), 0))
        total[k, inner] = most[: frames - 2 * distance] + score[k, inner]
        before[k, inner] = reached[: frames - 2 * distance]
    chosen = [int(total[-1].argmax())]
    for k in range(count - 1, 0, -1):
        chosen.append(int(before[k, chosen[-1]]))
    return np.array(chosen[::-1])


def _all_checked(sequences: Sequence[np.ndarray]) -> list[np.ndarray]:
    if not len(sequences):
        raise InvalidInput("there are no performances", expected="one or more", code="no_performances")
    performances = [checked(x, f"performance {number}") for number, x in enumerate(sequences)]
    for number, x in enumerate(performances):
        if x.shape[1] != performances[0].shape[1]:
            raise InvalidInput(
                "the performances have different dimensions",
                f"performance {number}",
                performances[0].shape[1],
                x.shape[1],
                code="other_dimension",
                dimension=x.shape[1],
            )
    return performances
