"""Linear system (A + sigma² I) z = h of least squares and MAP (zhang2007 equations 3.9 and 3.15).

Every coefficient that is published comes from here, whether the view is known or searched for.

Symbols
-------
``E_hat``   eigenwalkers seen from a view, (150, N)
``B``       whitened eigenwalkers E diag(sqrt(lambda)); without a prior B = E
``A``       ``B_hat^T B_hat``, (N, N)
``h``       ``B_hat^T d``, (N,), d the observation less the projected average walker
``z``       ``k / sqrt(lambda)``; without a prior the coefficients k themselves
``sigma2``  noise variance of [zhang2007 3.12], mm²

Why computed differently from how it is printed: with k = sqrt(lambda) z, [zhang2007 3.15] becomes (A + sigma² I) z = h.
No eigenvalue is then below sigma², so the normal equations are safe; four products of a model give A at every view
angle, A(alpha) = cos² Gxx + sin cos (Gxy + Gxy^T) + sin² Gyy + Gzz; and one tridiagonal form of A serves every
sigma² (`noise_path`).  The printed forms are `least_squares` and `maximum_a_posteriori`.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from pipeline.core.linear_model import LinearModel, WhitenedModel, whiten
from pipeline.validation import require_range

_UNSEEN = 1e-13
"""Relative eigenvalue of A below which the view does not determine the coefficient along the eigenvector."""

_SAFE = 1e-10
"""Ratio of smallest to largest pivot above which least squares needs no eigenvalue decomposition."""


class Gram:
    """Solver of the linear system (A + sigma² I) z = h for any view angle, for least squares and MAP.

    Parameters
    ----------
    white : WhitenedModel
        With the prior for a noise variance, without it for least squares.
    """

    def __init__(self, white: WhitenedModel) -> None:
        self.white = white
        xy = white.bx.T @ white.by
        self._parts = np.stack(
            [white.bx.T @ white.bx, xy + xy.T, white.by.T @ white.by, white.bz.T @ white.bz]
        )

    @cached_property
    def _seen_from_everywhere(self) -> bool:
        """True if the matrix A of the linear system is well conditioned at every view angle."""
        largest = np.trace(self._parts[0] + self._parts[2] + self._parts[3])
        return bool(np.linalg.eigvalsh(self._parts[3])[0] > _SAFE * largest)

    def at(self, cosine: np.ndarray, sine: np.ndarray) -> np.ndarray:
        """Return the matrix A of the linear system at each of several view angles, (A, N, N), from cosines and sines
        (A,).
        """
        weights = np.stack([cosine**2, sine * cosine, sine**2, np.ones_like(cosine)], axis=-1)
        return np.tensordot(weights, self._parts, axes=1)

    def solve(
        self, cosine: np.ndarray, sine: np.ndarray, h: np.ndarray, noise_variance: float | None
    ) -> np.ndarray:
        """Solve (A + sigma² I) z = h for z (A, N, K) at A view angles [zhang2007 3.9, 3.15] [zhang2004 9].

        Parameters
        ----------
        cosine, sine : (A,)
        h : (A, N, K)
        noise_variance : float or None
            sigma² in mm² (approach II), or None for least squares (approach I): of all solutions the shortest, so
            that a direction which the view does not show stays at zero, as with the pseudo-inverse.
        """
        A = self.at(cosine, sine)
        if noise_variance is not None:
            return np.linalg.solve(A + noise_variance * np.eye(A.shape[-1]), h)
        if self._seen_from_everywhere or _well_conditioned(A):
            return np.linalg.solve(A, h)
        values, vectors = np.linalg.eigh(A)
        determined = values > _UNSEEN * values[:, -1:]
        inverse = np.where(determined, 1.0, 0.0) / np.where(determined, values, 1.0)
        return vectors @ (inverse[..., None] * (np.swapaxes(vectors, 1, 2) @ h))

    def eliminate(
        self,
        cosine: np.ndarray,
        sine: np.ndarray,
        G: np.ndarray,
        H: np.ndarray,
        noise_variance: float | None,
    ) -> np.ndarray:
        """Eliminate the coefficients from the cost; return its quadratic form G - H (A + sigma² I)^-1 H^T, (A, B, B).

        Parameters
        ----------
        cosine, sine : (A,)
        G : (A, B, B)
        H : (A, B, N)
        noise_variance : float or None
        """
        return G - H @ self.solve(cosine, sine, np.swapaxes(H, 1, 2), noise_variance)


def gram_of(model: LinearModel, noise_variance: float | None) -> Gram:
    """Return the linear system of a model: for MAP if a noise variance is given, else for least squares.

    Parameters
    ----------
    model : LinearModel
    noise_variance : float or None
        sigma² in mm²; None for least squares.

    Raises
    ------
    InvalidInput
        If the noise variance is not positive and finite.
    """
    if noise_variance is not None:
        require_noise_variance(noise_variance)
    return Gram(whiten(model, prior=noise_variance is not None))


def require_noise_variance(noise_variance: float) -> float:
    """Check that a noise variance, mm², is positive and finite, and return it.

    Raises
    ------
    InvalidInput
        If it is not.
    """
    return require_range("the noise variance (sigma²)", noise_variance, above=0, unit="mm²")


def _well_conditioned(A: np.ndarray) -> bool:
    """Return True if every matrix is well conditioned, by its Cholesky pivots (8 times faster than eigenvalues)."""
    try:
        pivots = np.diagonal(np.linalg.cholesky(A), axis1=-2, axis2=-1) ** 2
    except np.linalg.LinAlgError:
        return False
    return bool((pivots.min(axis=-1) > _SAFE * pivots.max(axis=-1)).all())
