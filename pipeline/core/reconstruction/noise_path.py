"""Reconstruction errors of walkers for a range of noise variances (zhang2007 section 4.2).

Symbols are those of `gram`: one tridiagonal form of A serves every sigma², and a path is smooth enough to need few of
them.
"""

from __future__ import annotations

import functools

import numpy as np
from scipy.linalg import lapack

from pipeline.core import errors
from pipeline.core.linear_model import LinearModel, whiten
from pipeline.core.reconstruction.gram import Gram, require_noise_variance
from pipeline.core.reconstruction.known_view import deviation, right_hand_side
from pipeline.skeleton import WALKER15

_TERMS = 37.0
"""Negative natural logarithm of the truncation error of the Chebyshev series: e^-37 is below rounding error."""


class NoisePath:
    """Reconstruction errors for a range of noise variances, for walkers seen from the same views and one linear model.

    What depends on model and views alone is computed once, for all walkers.

    Parameters
    ----------
    model : LinearModel
    view_angles_rad : (A,)
    noise_variances : (S,)
        sigma² in mm².

    Raises
    ------
    InvalidInput
        If a noise variance is not positive and finite.

    Notes
    -----
    With A = V T V^T, T tridiagonal and V orthogonal, the coefficients are z = V y, (T + sigma² I) y = V^T h, and the
    error is the quadratic form c0 - 2 r·y + y^T Q y: no reconstruction is formed.  T takes a sixth of the time of
    eigenvectors, and a system with it a few operations for each coefficient.
    """

    def __init__(self, model: LinearModel, view_angles_rad: np.ndarray, noise_variances: np.ndarray) -> None:
        noise_variances = np.asarray(noise_variances, float)
        for value in noise_variances[~(np.isfinite(noise_variances) & (noise_variances > 0.0))]:
            require_noise_variance(value)
        self._model, self._white = model, whiten(model)
        self._cosine, self._sine = np.cos(view_angles_rad), np.sin(view_angles_rad)
        c, s, white = self._cosine, self._sine, self._white
        diagonal, off_diagonal, self._vectors = _tridiagonal(Gram(white).at(c, s))
        # Parseval weights, repeated for the joints of each block, and the mean over joints [zhang2007 4.2].
        joints = len(WALKER15.joints)
        self._weights = np.repeat(errors.parseval_weights(len(white.bx) // joints), joints)[:, None] / joints
        self._wx, self._wy = self._weights * white.bx, self._weights * white.by
        cross = self._wx.T @ white.by
        self._turn = np.stack([s**2, -s * c, c**2], axis=-1)
        parts = np.stack([self._wx.T @ white.bx, cross + cross.T, self._wy.T @ white.by])
        quadratic = np.tensordot(self._turn, parts, axes=1)
        self._rotated = np.swapaxes(self._vectors, 1, 2) @ quadratic @ self._vectors
        nodes, self._between = _interpolation(tuple(noise_variances.tolist()))
        # T + sigma² I = L D L^T: D (N, A, K), and what stands below the ones of L.
        self._pivots = diagonal.T[..., None] + nodes
        self._below = np.empty((len(self._pivots) - 1, *self._pivots.shape[1:]))
        for n, off in enumerate(off_diagonal.T[..., None]):
            self._below[n] = off / self._pivots[n]
            self._pivots[n + 1] -= off * self._below[n]

    def error(self, sample: np.ndarray) -> np.ndarray:
        """Return the error E_a (A, S), mm², of a held-out walker at A view angles and S noise variances.

        Add the residual power of the walker for errors against the motion itself.

        Raises
        ------
        InvalidInput
            If the walker does not fit the model or is not finite.
        """
        d = deviation(self._model, self._white, sample)
        h = right_hand_side(self._white, d, self._cosine, self._sine)
        projected = np.einsum("anm,an->am", self._vectors, h)
        wx, wy = self._wx, self._wy
        linear = self._turn @ np.stack([wx.T @ d.x, wx.T @ d.y + wy.T @ d.x, wy.T @ d.y])
        flat = self._weights[:, 0]
        constant = self._turn @ np.array([flat @ d.x**2, 2 * (flat * d.x) @ d.y, flat @ d.y**2])
        rotated_linear = np.einsum("anm,an->am", self._vectors, linear)
        y = np.empty_like(self._pivots)  # (N, A, K)
        y[0] = projected[:, :1]
        for n, below in enumerate(self._below):
            y[n + 1] = projected[:, n + 1, None] - below * y[n]
        y /= self._pivots
        for n in range(len(y) - 2, -1, -1):
            y[n] -= self._below[n] * y[n + 1]
        y = np.swapaxes(y, 0, 1)
        form = self._rotated @ y
        form -= 2.0 * rotated_linear[..., None]
        path = constant[:, None] + np.einsum("ank,ank->ak", form, y)
        return path @ self._between


def _tridiagonal(A: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Reduce symmetric matrices (A, N, N) to tridiagonal form: return diagonal, off-diagonal and orthogonal vectors.

    The matrices are overwritten.
    """
    N = A.shape[-1]
    diagonal, off_diagonal, vectors = A[:, 0].copy(), np.empty((len(A), N - 1)), np.zeros_like(A)
    vectors[:, 0, 0] = 1.0
    for view, matrix in enumerate(A if N > 1 else ()):
        reflectors, diagonal[view], off_diagonal[view], scales, _ = lapack.dsytrd(
            matrix.T, lower=1, overwrite_a=1
        )
        vectors[view, 1:, 1:] = lapack.dorgqr(reflectors[1:, :-1], scales)[0]
    return diagonal, off_diagonal, vectors


@functools.lru_cache(maxsize=4)
def _interpolation(wanted_variances: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return K noise variances to compute, and weights (K, S) that interpolate from them to S noise variances.

    As a function of t = log sigma² a path is analytic but for poles at log s ± i pi, s an eigenvalue of A, all
    at least pi away from the real axis.  Its Chebyshev series over t in a ± L therefore falls by a factor
    rho = pi / L + sqrt(1 + (pi / L)²) a term, for any model. This number of terms reaches rounding.
    """
    noise_variances = np.array(wanted_variances)
    low, high = np.log(noise_variances.min()), np.log(noise_variances.max())
    half = max((high - low) / 2.0, 1e-3)
    count = int(np.ceil(_TERMS / np.log(np.pi / half + np.hypot(1.0, np.pi / half)))) + 4
    if count >= len(noise_variances):
        return noise_variances, np.eye(len(noise_variances))
    at = np.cos(np.pi * (np.arange(count) + 0.5) / count)
    scaled = np.clip((np.log(noise_variances) - (low + high) / 2.0) / half, -1.0, 1.0)
    series = np.arange(count)[:, None] * np.arccos(at)  # (term, node)
    weights = np.cos(series) * np.where(np.arange(count) == 0, 1.0, 2.0)[:, None] / count
    return np.exp((low + high) / 2.0 + half * at), weights.T @ np.cos(
        np.arange(count)[:, None] * np.arccos(scaled)
    )
