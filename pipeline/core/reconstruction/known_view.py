"""3D from one known view: zhang2007 section 3.2 and appendix A, zhang2004 section 3.2.

Symbols
-------
``E``        eigenwalkers as columns, (225, N); ``E_hat = C E`` their projection, (150, N)
``d``        ``w_hat - w_bar_hat``: the observation less the projected average walker
``k``        coefficients of the eigenwalkers
``B``        whitened eigenwalkers E diag(sqrt(lambda)); ``z = k / sqrt(lambda)``
``A``        ``B_hat^T B_hat``, N x N; ``h = B_hat^T d``
``sigma2``   noise variance of [zhang2007 3.12], mm²

Why computed differently from how it is printed: the normal equations [zhang2007 3.9] square the condition
number, so the two printed estimators are solved as (stacked) least squares.  For sweeps, four products per fold
give A at every angle, A(alpha) = cos² Gxx + sin cos (Gxy + Gxy^T) + sin² Gyy + Gzz, and whitening turns
[zhang2007 3.15] into (A + sigma2 I) z = h.  Least squares knows no prior, so there B = E.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core.linear_model import LinearModel, WhitenedModel, whiten
from pipeline.validation import InvalidInput

_UNSEEN = 1e-13
"""Eigenvalue of A, relative to the largest, at which a view does not show its direction."""


def least_squares(E: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Coefficients (N,) that bring E k closest to d: approach I [zhang2007 3.9] [zhang2004 9].

    Parameters
    ----------
    E : (M, N) projected eigenwalkers, the printed E_hat of [zhang2007 3.8] [zhang2004 8]
    d : (M,) observation less projected average walker [zhang2007 3.7] [zhang2004 7]

    Notes
    -----
    The pseudo-inverse through the SVD; equal to the printed normal equations where those can be solved.

    Examples
    --------
    >>> least_squares(np.eye(2), np.array([3.0, 4.0]))
    array([3., 4.])
    """
    E, d = _checked(E, d)
    return np.linalg.lstsq(E, d, rcond=None)[0]


def maximum_a_posteriori(
    E: np.ndarray, d: np.ndarray, eigenvalues: np.ndarray, *, noise_variance: float
) -> np.ndarray:
    """Coefficients (N,) of maximum posterior probability: approach II [zhang2007 3.14, 3.15, A.5].

    Parameters
    ----------
    E : (M, N)
    d : (M,)
    eigenvalues : (N,)
        Prior variances, mm² [zhang2007 3.11]; zero pins its coefficient to zero.
    noise_variance : float
        sigma² of [zhang2007 3.12], mm², positive.

    Raises
    ------
    InvalidInput
        If shapes disagree, the noise variance is not positive, or an eigenvalue is negative.

    Notes
    -----
    The posterior [zhang2007 3.10] [zhang2007 3.13] is minimised as one least squares problem, whitened and
    stacked: [E sqrt(lambda); sigma I] z = [d; 0], k = sqrt(lambda) z.  Setting its gradient to zero gives
    [zhang2007 A.1-A.4]; the sums over k_i / lambda_i printed in A.3 and A.4 are vectors.
    """
    E, d = _checked(E, d)
    eigenvalues = np.asarray(eigenvalues, dtype=float)
    if eigenvalues.shape != (E.shape[1],):
        raise InvalidInput(
            "eigenvalues and eigenwalkers disagree",
            expected=f"({E.shape[1]},)",
            received=str(eigenvalues.shape),
        )
    check_noise_variance(noise_variance)
    if (eigenvalues < 0).any():
        raise InvalidInput("an eigenvalue is negative", received=f"{eigenvalues.min():g}")
    spread = np.sqrt(eigenvalues)
    stacked = np.concatenate([E * spread, np.sqrt(noise_variance) * np.eye(len(spread))])
    target = np.concatenate([d, np.zeros(len(spread))])
    return spread * np.linalg.lstsq(stacked, target, rcond=None)[0]


def check_noise_variance(noise_variance: float) -> None:
    """Nothing; a InvalidInput unless the noise variance is positive and finite."""
    if not (np.isfinite(noise_variance) and noise_variance > 0):
        raise InvalidInput(
            "the noise variance (sigma²) is not positive", expected="mm² > 0", received=f"{noise_variance:g}"
        )


def _checked(E: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    E, d = np.asarray(E, dtype=float), np.asarray(d, dtype=float)
    if E.ndim != 2 or d.shape != (len(E),):
        raise InvalidInput(
            "eigenwalkers and observation disagree",
            expected="E (M, N) and d (M,)",
            received=f"E {E.shape} and d {d.shape}",
        )
    if not (np.isfinite(E).all() and np.isfinite(d).all()):
        raise InvalidInput("an observed value is not finite")
    return E, d


def less_average(
    model: LinearModel, white: WhitenedModel, sample: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y and (z, scaled frequency) of one sample (225,) or (226,), less the average walker's."""
    sample = np.asarray(sample, dtype=float)
    if sample.shape != model.mean.shape:
        raise InvalidInput(
            "the walker has another size than the model",
            expected=str(model.mean.shape),
            received=str(sample.shape),
        )
    if not np.isfinite(sample).all():
        raise InvalidInput("a value of the walker is not finite")
    points = 3 * len(white.mean_x)
    x, y, z = (sample[:points][axis::3] for axis in range(3))
    up = np.append(z, model.last_scale * sample[points:])
    return x - white.mean_x, y - white.mean_y, up - white.mean_z


@dataclass(frozen=True)
class KnownViews:
    """One walker reconstructed from A known views.

    Attributes
    ----------
    coefficients : (A, N)
        k in mm.
    missing : (A, B, J)
        Reconstructed Fourier coefficients of the missing dimension, the printed w_tilde; B = 5.
    delta : (A, B, J)
        True less reconstructed.
    """

    coefficients: np.ndarray
    missing: np.ndarray
    delta: np.ndarray


def from_known_views(
    model: LinearModel,
    sample: np.ndarray,
    view_angles_rad: np.ndarray,
    *,
    noise_variance: float | None,
    joints: int = 15,
) -> KnownViews:
    """One walker's missing dimension from each of A known views [zhang2007 3.5, 3.6] [zhang2004 5, 6].

    Parameters
    ----------
    model : LinearModel
        Learnt without this walker.
    sample : (225,) or (226,)
        The walker; only its projection reaches the estimate, the rest only `delta`.
    view_angles_rad : (A,)
    noise_variance : float or None
        None for least squares (approach I), sigma² in mm² for MAP (approach II).
    joints : int
        J, how many joints a block of the Fourier representation has.

    Raises
    ------
    InvalidInput
        If the walker does not fit the model or is not finite, or the noise variance is not positive.
    """
    if noise_variance is not None:
        check_noise_variance(noise_variance)
    white = whiten(model, prior=noise_variance is not None)
    dx, dy, dz = less_average(model, white, sample)
    c, s = np.cos(view_angles_rad), np.sin(view_angles_rad)
    gram = white.gram(c, s)
    h = right_hand_side(white, dx, dy, dz, c, s)
    coordinates = _solve(gram, h, noise_variance)
    c, s = c[:, None], s[:, None]
    mean = -s * white.mean_x + c * white.mean_y
    varying = -s * (coordinates @ white.bx.T) + c * (coordinates @ white.by.T)
    shape = (len(c), -1, joints)
    return KnownViews(
        coefficients=coordinates * white.spread,
        missing=(mean + varying).reshape(shape),
        delta=(-s * dx + c * dy - varying).reshape(shape),
    )


def right_hand_side(
    white: WhitenedModel, dx: np.ndarray, dy: np.ndarray, dz: np.ndarray, c: np.ndarray, s: np.ndarray
) -> np.ndarray:
    """h(alpha) = B_hat^T d, (A, N)."""
    parts = np.stack([white.bx.T @ dx, white.bx.T @ dy + white.by.T @ dx, white.by.T @ dy, white.bz.T @ dz])
    return np.stack([c**2, s * c, s**2, np.ones_like(c)], axis=-1) @ parts


def _solve(gram: np.ndarray, h: np.ndarray, noise_variance: float | None) -> np.ndarray:
    """z of (A + sigma² I) z = h, batched (A, N); without a noise variance the least squares solution.

    Where A is singular to working precision (an eigenwalker that the view does not show) the solution of least
    norm is taken, as the pseudo-inverse does.
    """
    size = gram.shape[-1]
    if noise_variance is not None:
        return np.linalg.solve(gram + noise_variance * np.eye(size), h[..., None])[..., 0]
    if _well_conditioned(gram):
        return np.linalg.solve(gram, h[..., None])[..., 0]
    values, vectors = np.linalg.eigh(gram)
    return np.einsum("anm,am->an", vectors, _pseudo(values, np.einsum("anm,an->am", vectors, h)))


def _well_conditioned(gram: np.ndarray) -> bool:
    """Whether every matrix has a Cholesky factor with no pivot near rounding: eight times cheaper than eigh."""
    try:
        pivots = np.diagonal(np.linalg.cholesky(gram), axis1=-2, axis2=-1) ** 2
    except np.linalg.LinAlgError:
        return False
    return bool((pivots.min(axis=-1) > 1e-10 * pivots.max(axis=-1)).all())


def _pseudo(values: np.ndarray, projected: np.ndarray) -> np.ndarray:
    """`projected` over `values` where those are above rounding, else zero."""
    # The products that make A cancel where a view shows nothing, to some hundred roundings at worst.
    kept = values > _UNSEEN * values.max(axis=-1, keepdims=True)
    return np.where(kept, projected, 0.0) / np.where(kept, values, 1.0)
