"""Action model: the mean performance and the standard deviation at each of its postures (mozerov2006 section 4).

"Only those human postures which lie within the learnt variance boundaries from the mean performance are accepted."
The model is learnt from synchronized performances, samples (M, P, b) of the aSpace.

Symbols
-------
``M, P, b``  performances, samples (postures of a performance), dimensions of the aSpace
``m, s``     mean performance and standard deviation at each sample, (P, b); divisor M - 1
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr, ndtri

from pipeline.shortened import shortened
from pipeline.validation import InvalidInput, require_count, require_shape

BOUND = 3.0
"""Largest accepted distance of a posture from the mean, in standard deviations [section 4, figure 3d]."""

FLOOR_SHARE = 0.01
"""Lower bound on the standard deviations of an action model, relative to their root mean square.

Without it, no new posture is accepted where all performances agree to rounding.
"""

_FARTHEST = 38.0
"""Number of standard deviations beyond which the normal tail probability is zero in double precision."""


@shortened
class ActionModel:
    """Mean performance of an action, and the standard deviation at each of its postures.

    Attributes
    ----------
    mean : (P, b)
        Mean performance.
    standard_deviation : (P, b)
        At each posture; at least the floor.
    floored : (P, b) bool
        Where the floor took the place of a smaller standard deviation.
    """

    mean: np.ndarray
    standard_deviation: np.ndarray
    floored: np.ndarray


def learn(performances: np.ndarray) -> ActionModel:
    """Learn an action model: the mean performance, and the standard deviation at each of its postures.

    Parameters
    ----------
    performances : (M, P, b)
        Synchronized.

    Raises
    ------
    InvalidInput
        One performance alone, all of them identical, or numbers that are not finite.
    """
    performances = _checked(performances)
    if len(performances) < 2:
        raise InvalidInput(
            "a standard deviation cannot be learnt from one performance",
            expected="two or more",
            received="1",
            code="too_few_performances",
            count=1,
        )
    deviation = performances.std(axis=0, ddof=1)
    if not np.ptp(performances, axis=0).any():
        raise InvalidInput(
            "all performances are identical, so their standard deviation is zero",
            expected="performances that differ",
            code="identical_performances",
        )
    floor = FLOOR_SHARE * np.sqrt((deviation**2).mean())
    return ActionModel(
        mean=performances.mean(axis=0),
        standard_deviation=np.maximum(deviation, floor),
        floored=deviation < floor,
    )


def accepted(
    model: ActionModel, postures: np.ndarray, *, at: int | None = None, bound: float = BOUND
) -> np.ndarray:
    """Return True for each posture that is at most `bound` standard deviations from the mean in every coordinate.

    Parameters
    ----------
    model : ActionModel
    postures : (…, P, b), or (…, b) with `at`
        In the aSpace.
    at : int, optional
        The sample to which all postures belong; by default the last axis but one runs over the samples.
    bound : float
        Standard deviations.

    Returns
    -------
    accepted : (…, P) bool, or (…,) with `at`

    Raises
    ------
    InvalidInput
        Postures of another shape, or a bound that is not positive.  A posture with NaN is not accepted.
    """
    mean, deviation = _samples_at(model, at)
    _require_bound(bound)
    postures = np.asarray(postures, float)
    if postures.shape[-mean.ndim :] != mean.shape:
        expected = ", ".join(map(str, mean.shape))
        raise InvalidInput(
            "the shape of the posture array does not match the action model",
            expected=f"(…, {expected})",
            received=postures.shape,
            code="wrong_shape",
            shape=postures.shape,
        )
    return (np.abs(postures - mean) <= bound * deviation).all(axis=-1)


def sample(
    model: ActionModel,
    count: int,
    generator: np.random.Generator,
    *,
    at: int | None = None,
    bound: float = BOUND,
) -> np.ndarray:
    """Draw random postures from an action model, with normal coordinates truncated at `bound` standard deviations.

    Parameters
    ----------
    model : ActionModel
    count : int
    generator : numpy.random.Generator
    at : int, optional
        The sample at which to draw; by default every draw is one posture for each sample, independently: postures
        of figure 4, not performances, which would be smooth.
    bound : float
        Standard deviations; infinite for none.

    Returns
    -------
    postures : (count, P, b), or (count, b) with `at`

    Raises
    ------
    InvalidInput
        A negative count, a sample that the model does not have, or a bound that is not positive.
    """
    mean, deviation = _samples_at(model, at)
    _require_bound(bound)
    require_count("the number of postures", count, at_least=0)
    below = ndtr(-bound)
    normal = ndtri(below + generator.random((count, *mean.shape)) * (1.0 - 2.0 * below))
    # A draw of exactly 0, and rounding at the bound itself.
    limit = min(bound * (1.0 - 1e-12), _FARTHEST)
    return mean + deviation * np.clip(normal, -limit, limit)


def acceptance_left_out(
    performances: np.ndarray,
    *,
    groups: np.ndarray | None = None,
    bound: float = BOUND,
) -> np.ndarray:
    """Return a mask (M, P) of the postures that an action model accepts when it is learnt without their performance.

    Parameters
    ----------
    performances : (M, P, b)
        Synchronized.  The pattern and the aSpace have seen all of them unless the caller saw to it; this leaves
        out of mean and spread only.
    groups : (M,), optional
        Performances with the same value (one actor's) leave together.
    bound : float
        As for `accepted`.

    Raises
    ------
    InvalidInput
        Groups that do not match, or fewer than two performances left to learn from; else as `learn`.
    """
    performances = _checked(performances)
    labels = np.arange(len(performances)) if groups is None else np.asarray(groups)
    require_shape("groups", labels, performances.shape[:1])
    result = np.empty(performances.shape[:2], bool)
    for label in np.unique(labels):
        out = labels == label
        if (~out).sum() < 2:
            raise InvalidInput(
                "too few performances remain to learn an action model",
                f"without group {label}",
                "two or more",
                (~out).sum(),
                code="too_few_performances",
                count=(~out).sum(),
            )
        result[out] = accepted(learn(performances[~out]), performances[out], bound=bound)
    return result


def _samples_at(model: ActionModel, at: int | None) -> tuple[np.ndarray, np.ndarray]:
    if at is None:
        return model.mean, model.standard_deviation
    require_count("the sample of the action model", at, at_least=0, at_most=len(model.mean) - 1)
    return model.mean[at], model.standard_deviation[at]


def _require_bound(bound: float) -> None:
    if not bound > 0.0:  # infinity is allowed: no bound
        raise InvalidInput(
            "must be above 0 standard deviations",
            "the bound",
            received=f"{bound:g}",
            code="out_of_range",
            value=bound,
        )


def _checked(performances: np.ndarray) -> np.ndarray:
    try:
        performances = np.asarray(performances, float)
    except ValueError:
        raise InvalidInput(
            "the performances differ in length or dimension",
            expected="synchronized performances, (M, P, b)",
            code="mismatch",
        ) from None
    if performances.ndim != 3 or not performances.size:
        raise InvalidInput(
            "the array of performances has the wrong shape",
            expected="(M, P, b)",
            received=performances.shape,
            code="wrong_shape",
            shape=performances.shape,
        )
    wrong = ~np.isfinite(performances).all(axis=-1)
    if wrong.any():
        performance, posture = np.argwhere(wrong)[0]
        raise InvalidInput(
            "a posture has a number that is not finite",
            f"performance {performance}, sample {posture}",
            code="not_finite",
        )
    return performances
