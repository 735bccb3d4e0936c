"""The missing coefficients given the observed ones, before lengths: a Gaussian conditional.

Symbols
-------
``o, u``   observed and unknown coefficients of a view: across and up of the joints seen; away of all joints, and all of
           the joints hidden
``N``      ``sigma² I + delta diag C_oo + floor``, noise of the observed coefficients
``mu``     ``m_u + C_uo (C_oo + N)^-1 (o - m_o)``, the mean of u given o
``Sigma``  ``C_uu - C_uo (C_oo + N)^-1 C_ou``, its covariance, the same for all walkers

The dual form of [zhang2007 3.15]: with C = E diag(lambda) E^T and N = sigma² I the mean is that of approach II.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import lapack

from pipeline.core.anatomical.prior import JOINTS, Prior, turned
from pipeline.validation import InvalidInput, require_range, require_shape


@dataclass(frozen=True, kw_only=True)
class Noise:
    """What the observed coefficients are off by.

    Attributes
    ----------
    variance : float
        sigma², mm².
    share : float
        delta, a share of each observed coefficient's own variance.
    bias : float
        Standard deviation of a constant offset of each joint, mm: what a detector puts beside the joint.
    slow : float
        Root mean square over the cycle of an error that repeats with it, mm.
    """

    variance: float = 100.0
    share: float = 0.2
    bias: float = 0.0
    slow: float = 0.0

    def floor(self, blocks: int) -> np.ndarray:
        """Variance (1 + 2H,) of bias and slow error in each coefficient of a joint, mm²."""
        harmonics = max(blocks // 2, 1)
        return np.concatenate([[self.bias**2], np.full(blocks - 1, self.slow**2 / harmonics)])


def unknown_coefficients(hidden: np.ndarray, blocks: int) -> np.ndarray:
    """Which of the 45 B coefficients (joint, across-up-away, block) a view does not show, (45 B,) bool."""
    hidden = require_shape("the hidden joints", np.asarray(hidden, dtype=bool), (JOINTS,))
    unknown = np.zeros((JOINTS, 3, blocks), dtype=bool)
    unknown[:, 2] = True
    unknown[hidden] = True
    return unknown.ravel()


NOTHING_HIDDEN = np.zeros(JOINTS, dtype=bool)


def inverse(matrix: np.ndarray) -> np.ndarray:
    """The inverse of a positive definite matrix.  Raises InvalidInput if it is not positive definite."""
    factor, failed = lapack.dpotrf(matrix, lower=1)
    if failed:
        raise InvalidInput(
            "a covariance of unknown coefficients is not positive definite", expected="tau above 0"
        )
    inverse, _ = lapack.dpotri(factor, lower=1)
    return np.asarray(np.tril(inverse) + np.tril(inverse, -1).T)


@dataclass(frozen=True)
class Conditional:
    """The Gaussian conditional of the unknown coefficients, for A views of one prior.

    Attributes
    ----------
    unknown : (45 B,) bool
        Which coefficients are unknown: U of them.
    mean : (A, 45 B)
        Prior mean of all coefficients in the axes of each view, mm.
    factor : (A, O, O)
        L, the lower Cholesky factor of ``C_oo + N``.
    cross : (A, O, U)
        ``L^-1 C_ou``.
    covariance : (A, U, U)
        Sigma, mm².
    view_angle_rad : (A,)
    """

    unknown: np.ndarray
    mean: np.ndarray
    factor: np.ndarray
    cross: np.ndarray
    covariance: np.ndarray
    view_angle_rad: np.ndarray

    @cached_property
    def precision(self) -> np.ndarray:
        """Inverses (A, U, U) of the covariances."""
        return np.stack([inverse(covariance) for covariance in self.covariance])

    def expect(self, observed: np.ndarray) -> np.ndarray:
        """mu (A, M, U) of the observed coefficients (A, M, O) of M walkers, mm."""
        off = observed - self.mean[:, None, ~self.unknown]
        white = np.stack([lapack.dtrtrs(L, d.T, lower=1)[0].T for L, d in zip(self.factor, off, strict=True)])
        return np.asarray(self.mean[:, None, self.unknown] + white @ self.cross)


def condition(
    prior: Prior,
    view_angles_rad: np.ndarray,
    *,
    noise: Noise,
    hidden: np.ndarray = NOTHING_HIDDEN,
) -> Conditional:
    """Return the conditional of what A views do not show.

    Parameters
    ----------
    prior : Prior
    view_angles_rad : (A,)
    noise : Noise
    hidden : (15,) bool
        Joints that the image does not show.

    Raises
    ------
    InvalidInput
        If the noise is negative, or prior and noise leave the observed coefficients without variance.
    """
    _require_noise(noise)
    mean, C = turned(prior, view_angles_rad)
    blocks = prior.mean.shape[-1]
    unknown = unknown_coefficients(hidden, blocks)
    seen, missing = np.flatnonzero(~unknown), np.flatnonzero(unknown)
    floor = np.broadcast_to(noise.floor(blocks), (JOINTS, 3, blocks)).ravel()[seen]
    factors = np.empty((len(C), len(seen), len(seen)))
    crosses = np.empty((len(C), len(seen), len(missing)))
    covariance = np.empty((len(C), len(missing), len(missing)))
    diagonal = np.arange(len(seen))
    for a, of_view in enumerate(C):
        observed = of_view[np.ix_(seen, seen)]
        observed[diagonal, diagonal] += noise.variance + noise.share * np.diag(observed) + floor
        factor, failed = lapack.dpotrf(observed.T, lower=1)
        if failed:
            raise InvalidInput(
                "the observed coefficients have no variance", expected="a noise variance or tau above 0"
            )
        cross, _ = lapack.dtrtrs(factor, of_view[np.ix_(missing, seen)].T, lower=1)
        factors[a], crosses[a] = factor, cross
        covariance[a] = of_view[np.ix_(missing, missing)] - cross.T @ cross
    angles = np.atleast_1d(np.asarray(view_angles_rad, dtype=float))
    return Conditional(unknown, mean.reshape(len(mean), -1), factors, crosses, covariance, angles)


def _require_noise(noise: Noise) -> None:
    for name in ("variance", "share", "bias", "slow"):
        require_range(f"the noise's {name}", getattr(noise, name), at_least=0)
