"""Reconstruction in 3D from one known view: zhang2007 section 3.2 and appendix A, zhang2004 section 3.2.

Symbols
-------
``E``        eigenwalkers as columns, (225, N); ``E_hat = C E`` their projection, (150, N)
``d``        ``w_hat - w_bar_hat``: the observation less the projected average walker
``k``        coefficients of the eigenwalkers
``B, h, z``  whitened eigenwalkers, right-hand side and coefficients: see `gram`

`least_squares` and `maximum_a_posteriori` are the printed estimators, for one view and one sigma².  Sweeps take
`from_known_views`, which solves the same problems through `gram` for many views at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core.linear_model import LinearModel, WhitenedModel
from pipeline.core.reconstruction.gram import gram_of, require_noise_variance
from pipeline.shortened import shortened
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput, require_finite, require_shape


def least_squares(E: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Return the least squares coefficients k (N,) of the eigenwalkers: approach I [zhang2007 3.9] [zhang2004 9].

    Parameters
    ----------
    E : (M, N)
        Projected eigenwalkers, the printed E_hat of [zhang2007 3.8] [zhang2004 8].
    d : (M,)
        Observation less projected average walker, mm [zhang2007 3.7] [zhang2004 7].

    Notes
    -----
    The pseudo-inverse through the SVD; equal to the printed normal equations where those can be solved.

    Examples
    --------
    >>> least_squares(np.eye(2), np.array([3.0, 4.0]))
    array([3., 4.])
    """
    E, d = _problem(E, d)
    return np.linalg.lstsq(E, d)[0]


def maximum_a_posteriori(
    E: np.ndarray, d: np.ndarray, eigenvalues: np.ndarray, *, noise_variance: float
) -> np.ndarray:
    """Return the MAP coefficients k (N,) of the eigenwalkers: approach II [zhang2007 3.14, 3.15, A.5].

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
    E, d = _problem(E, d)
    eigenvalues = require_shape("eigenvalues", np.asarray(eigenvalues, float), (E.shape[1],))
    require_noise_variance(noise_variance)
    if (eigenvalues < 0).any():
        raise InvalidInput(
            "an eigenvalue of the linear model is negative",
            received=f"{eigenvalues.min():g}",
            code="out_of_range",
            value=eigenvalues.min(),
        )
    scale = np.sqrt(eigenvalues)
    stacked = np.concatenate([E * scale, np.sqrt(noise_variance) * np.eye(len(scale))])
    target = np.concatenate([d, np.zeros(len(scale))])
    return scale * np.linalg.lstsq(stacked, target)[0]


def _problem(E: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    E = require_shape("E", np.asarray(E, float), ("M", "N"))
    d = require_shape("d", np.asarray(d, float), (len(E),))
    return require_finite("E", E), require_finite("d", d)


@dataclass(frozen=True)
class Deviation:
    """Difference between one walker and the average walker, split into x, y and z.

    Attributes
    ----------
    x, y : (75,)
        mm.
    z : (75,) or (76,)
        With the scaled frequency last where the model has one: it is observed from every view, as z is.
    """

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray


def deviation(model: LinearModel, white: WhitenedModel, sample: np.ndarray) -> Deviation:
    """Return the difference between one walker, (225,) or (226,), and the average walker, split into x, y and z."""
    sample = require_shape("the walker", np.asarray(sample, float), model.mean.shape)
    require_finite("the walker", sample)
    points = 3 * len(white.mean_x)
    x, y, z = (sample[:points][axis::3] for axis in range(3))
    up = np.append(z, model.last_scale * sample[points:])
    return Deviation(x - white.mean_x, y - white.mean_y, up - white.mean_z)


@shortened
class KnownViews:
    """Reconstructions of one walker, each from one of A known views.

    Attributes
    ----------
    coefficients : (A, N)
        k in mm.
    missing : (A, 5, 15)
        Reconstructed Fourier coefficients of the missing dimension, mm, the printed w_tilde.
    delta : (A, 5, 15)
        True less reconstructed, mm.
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
) -> KnownViews:
    """Reconstruct the missing dimension of one walker from each of A known views [zhang2007 3.5, 3.6] [zhang2004 5, 6].

    Parameters
    ----------
    model : LinearModel
        Learnt without this walker.
    sample : (225,) or (226,)
        The walker; only its projection reaches the estimate, the rest only `delta`.
    view_angles_rad : (A,)
    noise_variance : float or None
        None for least squares (approach I), sigma² in mm² for MAP (approach II).

    Raises
    ------
    InvalidInput
        If the walker does not fit the model or is not finite, or the noise variance is not positive.
    """
    gram = gram_of(model, noise_variance)
    white = gram.white
    d = deviation(model, white, sample)
    c, s = np.cos(view_angles_rad), np.sin(view_angles_rad)
    z = gram.solve(c, s, right_hand_side(white, d, c, s)[..., None], noise_variance)[..., 0]
    c, s = c[:, None], s[:, None]
    mean = -s * white.mean_x + c * white.mean_y
    varying = -s * (z @ white.bx.T) + c * (z @ white.by.T)
    shape = (len(c), -1, len(WALKER15.joints))
    return KnownViews(
        coefficients=z * white.scale,
        missing=(mean + varying).reshape(shape),
        delta=(-s * d.x + c * d.y - varying).reshape(shape),
    )


def right_hand_side(white: WhitenedModel, d: Deviation, c: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Return the right-hand side h (A, N) of the linear system at A view angles, given their cosines and sines (A,)."""
    parts = np.stack(
        [white.bx.T @ d.x, white.bx.T @ d.y + white.by.T @ d.x, white.by.T @ d.y, white.bz.T @ d.z]
    )
    return np.stack([c**2, s * c, s**2, np.ones_like(c)], axis=-1) @ parts
