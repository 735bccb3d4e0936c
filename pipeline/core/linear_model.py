"""The linear model behind eigenwalkers and the aSpace (zhang2007 section 3.1, mozerov2006 section 2).

Symbols
-------
``W``        samples, one walker (or posture) to a row here (to a column in the paper), (R, D)
``w_bar``    average walker, (D,)
``e_n``      eigenwalkers: orthonormal rows, (N, D)
``lambda_n`` eigenvalues of the covariance, divisor R - 1 unless stated otherwise
``k_n``      coefficients

Only this module flattens a Fourier representation (5, 15, 3) to 225 numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.core.choice import first_lowest
from pipeline.shortened import shortened
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput, require_choice, require_count, require_range

_SAME_MAGNITUDE = 1e-6
"""Relative tolerance for ties among the largest entries of an eigenvector; the first one gets a positive sign."""

_WELL_DETERMINED = 1e-5
"""Ratio of eigenvalues, smallest to largest, above which they may be computed from a product of sample matrices."""

_MANY, _FOLDS_AT_A_TIME = 4, 64
"""Number of samples per dimension above which cross-validation folds share sums of products, and folds per sum."""

_NO_VARIATION = 1e-12
"""Standard deviation along an eigenwalker, relative to the largest one, below which it is rounding error."""


@shortened
class LinearModel:
    """Mean and principal components of a set of samples.

    Attributes
    ----------
    mean : (D,)
    components : (N, D)
        Orthonormal rows, largest variance first; the entry of largest magnitude is positive (the first of those
        that are within a millionth of it).
    eigenvalues : (N,)
        Variance along each component.
    total_variance : float
        Sum of all eigenvalues, the discarded ones included.
    last_scale : float
        What the last number of each sample was multiplied by before everything else (1 unless the model was
        fitted with `scale_last`).
    """

    mean: np.ndarray
    components: np.ndarray
    eigenvalues: np.ndarray
    total_variance: float
    last_scale: float = 1.0


def flatten(coefficients: np.ndarray, frequency_hz: np.ndarray | None = None) -> np.ndarray:
    """Return walks as rows (R, 225), or (R, 226) with the angular frequency, rad/s, last [zhang2007 3.2] [zhang2004 2].

    `coefficients` is (R, 5, 15, 3), `frequency_hz` (R,).
    """
    rows = np.asarray(coefficients, float).reshape(len(coefficients), -1)
    if frequency_hz is None:
        return rows
    return np.column_stack([rows, 2.0 * np.pi * np.asarray(frequency_hz, float)])


def unflatten(rows: np.ndarray) -> np.ndarray:
    """Return the Fourier representations (…, 1 + 2H, 15, 3) of flattened walks (…, D), without the frequency."""
    rows, joints = np.asarray(rows), len(WALKER15.joints)
    blocks = rows.shape[-1] // (3 * joints)
    return rows[..., : 3 * joints * blocks].reshape(*rows.shape[:-1], blocks, joints, 3)


def fit(
    samples: np.ndarray,
    n_components: int,
    *,
    divisor: str = "R-1",
    scale_last: float | None = 1.0,
) -> LinearModel:
    """Fit the average walker and the eigenwalkers [zhang2007 3.3] [zhang2004 3].

    Parameters
    ----------
    samples : (R, D)
    n_components : int
        At most min(R - 1, D) are returned: a covariance of R samples has no more.
    divisor : {"R-1", "R"}
        Of the covariance; the paper is silent.
    scale_last : float or None
        Positive; multiplies the last number of each sample (the frequency of zhang2004).  None makes its
        variance equal to the mean variance of the others, from these samples alone.

    Raises
    ------
    InvalidInput
        Fewer than two samples, values that are not finite, fewer than one component, an unknown divisor, or a
        scale that is not positive.

    Notes
    -----
    Where samples repeat each other, the last eigenvalues are zero (to rounding) and their components arbitrary
    directions at right angles to the rest.
    """
    samples = np.asarray(samples, float)
    if samples.ndim != 2 or len(samples) < 2:
        raise InvalidInput(
            "a linear model needs at least two walkers",
            expected="(R, D), R > 1",
            received=samples.shape,
            code="too_few_people",
            shape=samples.shape,
        )
    require_count("the number of components", n_components)
    require_choice("the divisor", divisor, ("R-1", "R"))
    if not np.isfinite(samples).all():
        walker = np.argwhere(~np.isfinite(samples))[0][0]
        raise InvalidInput(
            f"walker {walker} has values that are not finite", code="not_finite", walker=walker
        )
    if scale_last is not None:
        require_range("the scale of the last number", scale_last, above=0)
    if scale_last is None:
        variances = samples.var(axis=0)
        varies = np.ptp(samples[:, -1]) > 0 and variances[:-1].any()
        scale_last = np.sqrt(variances[:-1].mean() / variances[-1]) if varies else 1.0
    if scale_last != 1.0:
        samples = np.column_stack([samples[:, :-1], scale_last * samples[:, -1]])
    mean = samples.mean(axis=0)
    count = min(n_components, len(samples) - 1, samples.shape[1])
    squares, components = _principal_directions(samples - mean, count)
    return _model(mean, squares, components, len(samples) - (divisor == "R-1"), float(scale_last))


def _model(
    mean: np.ndarray, squares: np.ndarray, components: np.ndarray, divisor: int, last_scale: float
) -> LinearModel:
    """Return a linear model from squared singular values of the samples and the retained principal directions."""
    largest = first_lowest(-np.abs(components), margin=_SAME_MAGNITUDE)
    signs = np.where(components[np.arange(len(components)), largest] < 0, -1.0, 1.0)
    variances = squares / divisor
    return LinearModel(
        mean=mean,
        components=components * signs[:, None],
        eigenvalues=variances[: len(components)],
        total_variance=variances.sum(),
        last_scale=last_scale,
    )


def _principal_directions(centred: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return all squared singular values, largest first, and the first `count` right singular vectors as rows.

    A few of many come from the eigenvectors of the samples' products, three times as fast as from the singular value
    decomposition: rounding of the products is 1e-16 of the largest square, so that the directions are good to 1e-11
    where no wanted square is below 1e-5 of it.  Otherwise, singular values are computed themselves.
    """
    if 2 * count <= len(centred) <= centred.shape[1]:
        squares, vectors = np.linalg.eigh(centred @ centred.T)
        squares = np.maximum(squares[::-1], 0.0)
        if squares[count - 1] > _WELL_DETERMINED * squares[0]:
            rows = vectors[:, ::-1][:, :count].T @ centred
            return squares, rows / np.sqrt(squares[:count, None])
    _, singular, rows = np.linalg.svd(centred, full_matrices=False)
    return singular**2, rows[:count]


def leave_one_out(
    samples: np.ndarray,
    n_components: int,
    *,
    groups: np.ndarray | None = None,
    mirrors: np.ndarray | None = None,
    divisor: str = "R-1",
    scale_last: float | None = 1.0,
    only: Sequence[int] | None = None,
) -> Iterator[tuple[LinearModel, int]]:
    """Yield (model, r) for each walk r in order, where the model is fitted without the person of walk r.

    Parameters
    ----------
    samples : (R, D)
    n_components : int
    groups : (R,), optional
        Walks with the same value belong to the same person and leave together; by default every walk is of
        another person.
    mirrors : (R, D), optional
        Each walker's mirror image: joins the training set, and leaves with its walker.
    divisor, scale_last
        As for `fit`.
    only : sequence of int, optional
        The walkers whose models are wanted.

    Raises
    ------
    InvalidInput
        If a fold would have fewer than two people left to learn from, or `groups` or `mirrors` do not match
        the samples.
    """
    samples = np.asarray(samples, float)
    labels = np.arange(len(samples)) if groups is None else np.asarray(groups)
    if labels.shape != samples.shape[:1] or (mirrors is not None and np.shape(mirrors) != samples.shape):
        raise InvalidInput(
            "the array of groups or of mirrored walkers has the wrong shape",
            expected=f"groups {samples.shape[:1]}, mirrors {samples.shape}",
            received=f"groups {labels.shape}" + ("" if mirrors is None else f", mirrors {np.shape(mirrors)}"),
            code="mismatch",
            groups=labels.shape,
            mirrors=None if mirrors is None else np.shape(mirrors),
        )
    if len(np.unique(labels)) < 3:
        raise InvalidInput(
            "leave-one-out needs at least three people",
            expected="3 or more",
            received=len(np.unique(labels)),
            code="too_few_people",
            count=len(np.unique(labels)),
        )
    rows, owners = samples, labels
    if mirrors is not None:
        rows, owners = np.concatenate([samples, np.asarray(mirrors, float)]), np.tile(labels, 2)
    left_out = range(len(samples)) if only is None else only
    if len(rows) < _MANY * rows.shape[1] or scale_last != 1.0 or not np.isfinite(rows).all():
        for r in left_out:
            yield fit(rows[owners != labels[r]], n_components, divisor=divisor, scale_last=scale_last), r
        return
    for start in range(0, len(left_out), _FOLDS_AT_A_TIME):
        block = left_out[start : start + _FOLDS_AT_A_TIME]
        for r, (mean, products, count) in zip(
            block, _moments_without(rows, owners, labels[block]), strict=True
        ):
            squares, directions = np.linalg.eigh(products)
            squares, rank = np.maximum(squares[::-1], 0.0), min(n_components, len(squares))
            if squares[rank - 1] > _WELL_DETERMINED * squares[0]:
                components = directions[:, ::-1].T[:rank]
                yield _model(mean, squares, components, count - (divisor == "R-1"), 1.0), r
            else:
                yield fit(rows[owners != labels[r]], n_components, divisor=divisor), r


def _moments_without(
    rows: np.ndarray, owners: np.ndarray, people: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray, int]]:
    """Yield mean (D,), scatter matrix (D, D) and number of the samples that remain without each person.

    Rows of other people are summed once. No sum is subtracted again, so that the person who is left out
    moves no digit.
    """
    near = np.isin(owners, people)
    centre = np.zeros(rows.shape[1]) if near.all() else rows[~near].mean(axis=0)
    far = rows[~near] - centre
    products, rows, owners = far.T @ far, rows[near] - centre, owners[near]
    for person in people:
        others = rows[owners != person]
        count = len(far) + len(others)
        shift = others.sum(axis=0) / count
        yield centre + shift, products + others.T @ others - count * np.outer(shift, shift), count


def leave_two_out(
    samples: np.ndarray,
    n_components: int,
    *,
    groups: np.ndarray,
    mirrors: np.ndarray | None = None,
    divisor: str = "R-1",
    scale_last: float | None = 1.0,
) -> Iterator[tuple[LinearModel, int, int]]:
    """Yield (model, g, h) for each pair of groups g < h, where the model is fitted without both groups.

    Parameters
    ----------
    samples : (R, D)
    n_components : int
    groups : (R,) int
        0 to G - 1; walks of one person belong to one group.
    mirrors, divisor, scale_last
        As for `leave_one_out`.

    Raises
    ------
    InvalidInput
        If there are fewer than three groups.
    """
    samples = np.asarray(samples, float)
    count = int(groups.max()) + 1
    require_range("the number of groups", count, at_least=3)
    for g in range(count):
        for h in range(g + 1, count):
            remaining = (groups != g) & (groups != h)
            training = samples[remaining]
            if mirrors is not None:
                training = np.concatenate([training, np.asarray(mirrors, float)[remaining]])
            yield fit(training, n_components, divisor=divisor, scale_last=scale_last), g, h


def truncated(model: LinearModel, n_components: int) -> LinearModel:
    """Return the linear model with only its first `n_components` components."""
    return replace(
        model, components=model.components[:n_components], eigenvalues=model.eigenvalues[:n_components]
    )


def without_joints(rows: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Return samples or eigenwalkers (…, D) with zeros in place of joints that were not measured.

    Where every joint was measured, they are returned as they are.

    Parameters
    ----------
    rows : (…, D)
        A trailing frequency is kept.
    measured : (15,) bool
    """
    if measured.all():
        return rows
    masked = np.array(rows, float)
    unflatten(masked)[..., ~measured, :] = 0.0  # a view of `kept`
    return masked


def of_measured(model: LinearModel, measured: np.ndarray) -> LinearModel:
    """Return the linear model for a walker with unmeasured joints: its entries for these joints are zero.

    Rows of the missing joints are zero, so that they neither count as observed nor add to an error; eigenwalkers are
    then not orthonormal.

    Parameters
    ----------
    model : LinearModel
    measured : (15,) bool
    """
    if measured.all():
        return model
    return replace(
        model,
        mean=without_joints(model.mean, measured),
        components=without_joints(model.components, measured),
    )


def largest_coefficients(model: LinearModel, samples: np.ndarray) -> np.ndarray:
    """Return the largest magnitude (N,), mm, that each model coefficient has among the samples (R, D)."""
    return np.abs(coefficients(model, samples)).max(axis=0)


def coefficients(
    model: LinearModel, samples: np.ndarray, *, measured: np.ndarray | None = None
) -> np.ndarray:
    """Return the model coefficients (R, N), mm, of samples (R, D), from the measured joints (15,) only."""
    scaled = np.array(samples, float)
    scaled[:, -1] *= model.last_scale
    if measured is None or measured.all():
        return (scaled - model.mean) @ model.components.T
    visible = of_measured(model, measured)
    away = (without_joints(scaled, measured) - visible.mean).T
    return np.linalg.lstsq(visible.components.T, away)[0].T


@dataclass(frozen=True)
class WhitenedModel:
    """Linear model whose eigenwalkers are multiplied by their standard deviations, split into x, y and z.

    Attributes
    ----------
    scale : (N,)
        k is z times this: sqrt(lambda), mm, or one where the form is without a prior.
    mean_x, mean_y : (P,)
        Average walker, P = 75.
    mean_z : (P or P + 1,)
        With the frequency appended where the model has one: it is observed from every view, as z is.
    bx, by, bz : (P, N), (P, N), (P or P + 1, N)
        Eigenwalkers times `scale`.
    """

    scale: np.ndarray
    mean_x: np.ndarray
    mean_y: np.ndarray
    mean_z: np.ndarray
    bx: np.ndarray
    by: np.ndarray
    bz: np.ndarray


def whiten(model: LinearModel, *, prior: bool = True) -> WhitenedModel:
    """Return a linear model with eigenwalkers multiplied by their standard deviations, and split into x, y and z.

    Without a `prior` the eigenwalkers keep their length, as approach I has them, but for those along which the
    training walkers do not vary (zero eigenvalues, to rounding): their directions are arbitrary.
    """
    size = model.mean.shape[0]
    points = 3 * (size // 3)
    scale = np.sqrt(model.eigenvalues)
    if not prior:
        scale = (scale > _NO_VARIATION * scale.max()).astype(float)
    scaled = scale[:, None] * model.components
    mx, my, mz = (model.mean[:points][axis::3] for axis in range(3))
    bx, by, bz = (scaled[:, :points][:, axis::3].T for axis in range(3))
    if size > points:
        mz = np.append(mz, model.mean[points:])
        bz = np.concatenate([bz, scaled[:, points:].T])
    return WhitenedModel(scale, mx, my, mz, *(np.ascontiguousarray(b) for b in (bx, by, bz)))
