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

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import lapack

from pipeline.core.anatomical.prior import JOINTS, TurnedPrior, image_axes
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
    factor, failed = lapack.dpotrf(matrix.T, lower=1)
    if failed:
        raise InvalidInput(
            "a covariance of unknown coefficients is not positive definite", expected="tau above 0"
        )
    half, _ = lapack.dpotri(factor, lower=1, overwrite_c=1)
    whole = half + half.T  # each has zeros in place of the other triangle
    whole[np.diag_indices_from(whole)] /= 2.0
    return np.asarray(whole)


@dataclass(frozen=True)
class Conditional:
    """The Gaussian conditional of the unknown coefficients, for A views of one prior.

    Attributes
    ----------
    unknown : (45 B,) bool
        Which coefficients are unknown: U of them.
    mean : (A, 45 B)
        Prior mean of all coefficients in the axes of each view, mm.
    order : (O,) int
        Of the observed coefficients in `factor` and `crossed`: axis by axis.
    factor : (A, O, O)
        Lower Cholesky factor of ``C_oo + N``.
    crossed : (A, U, O)
        ``C_uo``, mm².
    before : (A, U, U)
        ``C_uu``, mm².
    view_angle_rad : (A,)
    """

    unknown: np.ndarray
    mean: np.ndarray
    order: np.ndarray
    factor: np.ndarray
    crossed: np.ndarray
    before: np.ndarray
    view_angle_rad: np.ndarray

    @cached_property
    def covariance(self) -> np.ndarray:
        """Sigma (A, U, U), mm²."""
        found = self.before.copy()
        for sigma, factor, crossed in zip(found, self.factor, self.crossed, strict=True):
            white, _ = lapack.dtrtrs(factor, crossed.T, lower=1)
            sigma -= white.T @ white
        return found

    @cached_property
    def precision(self) -> np.ndarray:
        """Inverses (A, U, U) of the covariances."""
        return np.stack([inverse(covariance) for covariance in self.covariance])

    def expect(self, observed: np.ndarray) -> np.ndarray:
        """mu (A, M, U) of the observed coefficients (A, M, O) of M walkers, mm."""
        off = (observed - self.mean[:, None, ~self.unknown])[..., self.order]
        found = np.repeat(self.mean[:, None, self.unknown], observed.shape[1], axis=1)
        for mean, factor, crossed, of_view in zip(found, self.factor, self.crossed, off, strict=True):
            mean += lapack.dpotrs(factor, of_view.T, lower=1)[0].T @ crossed.T
        return found


def condition(
    turned: TurnedPrior,
    *,
    noise: Noise,
    hidden: np.ndarray = NOTHING_HIDDEN,
) -> Conditional:
    """Return the conditional of what A views do not show.

    Parameters
    ----------
    turned : TurnedPrior
        The prior in the axes of the views.
    noise : Noise
    hidden : (15,) bool
        Joints that the image does not show.

    Raises
    ------
    InvalidInput
        If the noise is negative, or prior and noise leave the observed coefficients without variance.
    """
    _require_noise(noise)
    views, blocks = len(turned.mean), turned.mean.shape[-1]
    unknown = unknown_coefficients(hidden, blocks)
    place = np.arange(len(unknown)).reshape(JOINTS, 3, blocks).swapaxes(0, 1).ravel()  # by axis, of by joint
    seen = np.flatnonzero(~unknown[place])
    order = (np.cumsum(~unknown) - 1)[place[seen]]
    if hidden.any():
        C, missing = turned.covariance, np.argsort(place)[unknown]
        observed, crossed, before = (
            np.array(C[:, rows[:, None], columns], order="C")
            for rows, columns in ((seen, seen), (missing, seen), (missing, missing))
        )
    else:
        observed, crossed, before = turned.seen.copy(), turned.crossed, turned.away
    floor = np.broadcast_to(noise.floor(blocks), (3, JOINTS, blocks)).ravel()[seen]
    diagonal = np.arange(len(seen))
    observed[:, diagonal, diagonal] += noise.variance + noise.share * observed[:, diagonal, diagonal] + floor
    for of_view in observed:
        _, failed = lapack.dpotrf(of_view.T, lower=1, overwrite_a=1)
        if failed:
            raise InvalidInput(
                "the observed coefficients have no variance", expected="a noise variance or tau above 0"
            )
    return Conditional(
        unknown=unknown,
        mean=turned.mean.reshape(views, -1),
        order=order,
        factor=np.swapaxes(observed, 1, 2),
        crossed=crossed,
        before=before,
        view_angle_rad=turned.view_angle_rad,
    )


def _require_noise(noise: Noise) -> None:
    for name in ("variance", "share", "bias", "slow"):
        require_range(f"the noise's {name}", getattr(noise, name), at_least=0)


def expect_from_walks(
    mean: np.ndarray,
    walks: np.ndarray,
    observed: np.ndarray,
    view_angles_rad: np.ndarray,
    *,
    unknown: np.ndarray,
    noise_variances: Sequence[float],
) -> np.ndarray:
    """mu (S, A, M, U) of M walkers for each of S noise variances, mm, where the covariance is that of N walks.

    Parameters
    ----------
    mean, walks : (45 B,), (N, 45 B)
        As `Walks.centred` has them: C is ``walks^T walks``.
    observed : (A, M, O)
        In the axes of A views, mm.
    view_angles_rad : (A,)
    unknown : (45 B,) bool
    noise_variances : (S,)
        sigma², mm², positive.

    Raises
    ------
    InvalidInput
        If a noise variance is not positive, or so small that the system is singular to rounding.

    Notes
    -----
    With C_oo = X_o^T X_o and C_uo = X_u^T X_o, mu is ``m_u + X_u^T (X_o X_o^T + sigma² I)^-1 X_o (o - m_o)``: a system
    of the size of the walks, whose products serve every sigma², and no covariance.
    """
    found = np.empty((len(noise_variances), *observed.shape[:2], int(unknown.sum())))
    rows = np.concatenate([mean[None], walks]).reshape(len(walks) + 1, JOINTS, 3, -1)
    diagonal = np.diag_indices(len(walks))
    for a, axes in enumerate(image_axes(view_angles_rad)):
        turned = (axes @ rows).reshape(len(rows), -1)
        seen, hidden = turned[:, ~unknown], turned[:, unknown]
        products, right = seen[1:] @ seen[1:].T, seen[1:] @ (observed[a] - seen[0]).T
        for s, variance in enumerate(noise_variances):
            require_range("the noise variance (sigma²)", variance, above=0, unit="mm²")
            matrix = products.copy()
            matrix[diagonal] += variance
            _, shares, failed = lapack.dposv(matrix.T, right, lower=1, overwrite_a=1)
            if failed:
                raise InvalidInput(
                    "walks that depend on each other need more noise", expected="a larger sigma²"
                )
            found[s, a] = hidden[0] + shares.T @ hidden[1:]
    return found
