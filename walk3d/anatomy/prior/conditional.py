"""The missing coefficients given the observed ones, before lengths: a Gaussian conditional.

Symbols
-------
``o, u``   observed and unknown coefficients of a view: across and up of the joints seen; away of all joints, and all of
           the joints hidden
``N``      ``sigma² I + delta diag C_oo + floor``, noise of the observed coefficients
``mu``     ``m_u + C_uo (C_oo + N)^-1 (o - m_o)``, the mean of u given o
``Sigma``  ``C_uu - C_uo (C_oo + N)^-1 C_ou``, its covariance, the same for all walkers

Up is the same from all views.  It is therefore observed first, once for all of them, and then across.

The dual form of [zhang2007 3.15]: with C = E diag(lambda) E^T and N = sigma² I the mean is that of approach II.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import lapack

from pipeline.validation import InvalidInput
from walk3d.anatomy.prior.prior import JOINTS, Prior, image_axes


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
    unknown = np.zeros((JOINTS, 3, blocks), bool)
    unknown[:, 2] = True
    unknown[hidden] = True
    return unknown.ravel()


NOTHING_HIDDEN = np.zeros(JOINTS, bool)


def inverse(matrix: np.ndarray) -> np.ndarray:
    """The inverse of a positive definite matrix.  Raises InvalidInput if it is not positive definite."""
    factor, failed = lapack.dpotrf(matrix.T, lower=1)
    if failed:
        raise InvalidInput(
            "a covariance of unknown coefficients is not positive definite",
            expected="tau above 0",
            code="not_positive_definite",
        )
    half, _ = lapack.dpotri(factor, lower=1, overwrite_c=1)
    whole = half + half.T  # each has zeros in place of the other triangle
    whole[np.diag_indices_from(whole)] /= 2.0
    return whole


@dataclass(frozen=True)
class HeightsSeen:
    """A prior of which the vertical of the joints seen has been observed, as every view does alike.

    What is left to a view is a system of half the size.  Axes stand one after the other in it: forwards and sideways
    (x, y) of all joints, n = 15 B of each, and up of the hidden ones, R in all.

    Attributes
    ----------
    prior : Prior
    noise : Noise
    hidden : (15,) bool
        Joints that the image does not show.
    factor : (Z, Z)
        Lower Cholesky factor of the covariance of what is seen of the vertical, with its noise.
    tied : (Z, R)
        Covariance of what is seen of the vertical with the rest, mm².
    covariance : (R, R)
        Of the rest, given the vertical, mm².
    """

    prior: Prior
    noise: Noise
    hidden: np.ndarray
    factor: np.ndarray
    tied: np.ndarray
    covariance: np.ndarray

    def from_views(self, view_angles_rad: np.ndarray) -> Conditional:
        """Return the conditional of what A views do not show."""
        mean, blocks = self.prior.mean, self.prior.mean.shape[-1]
        axes, n, hidden = image_axes(view_angles_rad), JOINTS * blocks, self.hidden
        views, seen = len(axes), np.repeat(~hidden, blocks)
        level = np.ascontiguousarray(self.covariance[: 2 * n, : 2 * n].reshape(2, n, 2, n).swapaxes(1, 2))
        own = np.diagonal(self.prior.by_axis.reshape(3, n, 3, n), axis1=1, axis2=3)[:2, :2]
        own = np.einsum("ai,ijk,aj->ak", axes[:, 0, :2], own, axes[:, 0, :2])
        added = (self.noise.variance + self.noise.share * own + np.tile(self.noise.floor(blocks), JOINTS))[
            :, seen
        ]
        rows = np.empty((JOINTS, 3, blocks), int)  # in what is left, turned into across, away and up
        rows[:, 0], rows[:, 2] = np.split(np.arange(2 * n).reshape(-1, blocks), 2)
        rows[hidden, 1] = np.arange(2 * n, len(self.covariance)).reshape(-1, blocks)
        unknown = unknown_coefficients(hidden, blocks)
        across, missing = rows[~hidden, 0].ravel(), rows.ravel()[unknown]
        observed = np.empty((views, len(across), len(across)))
        crossed = np.empty((views, len(missing), len(across)))
        before = np.empty((views, len(missing), len(missing)))
        for view, (right, _, away) in enumerate(axes[:, :, :2]):
            pairs = np.stack([np.outer(right, right), np.outer(away, right), np.outer(away, away)])
            parts = (pairs.reshape(3, 4) @ level.reshape(4, -1)).reshape(3, n, n)
            if hidden.any():
                whole = self.covariance.copy()
                whole[:n, :n], whole[n : 2 * n, :n], whole[n : 2 * n, n : 2 * n] = parts
                whole[:n, n : 2 * n] = parts[1].T
                up = whole[2 * n :, : 2 * n].reshape(-1, 2, n)
                whole[2 * n :, : 2 * n] = (np.stack([right, away]) @ up).reshape(-1, 2 * n)
                whole[: 2 * n, 2 * n :] = whole[2 * n :, : 2 * n].T
                parts = (whole[np.ix_(*pair)] for pair in ((across,) * 2, (missing, across), (missing,) * 2))
            observed[view], crossed[view], before[view] = parts
            observed[view].flat[:: len(across) + 1] += added[view]
            _factorise(observed[view])
        return Conditional(
            unknown=unknown,
            mean=np.einsum("aij,kjb->akib", axes, mean).reshape(views, -1),
            heights=self,
            axes=axes,
            across=across,
            missing=missing,
            factor=np.swapaxes(observed, 1, 2),
            crossed=crossed,
            before=before,
        )


@dataclass(frozen=True)
class Conditional:
    """The Gaussian conditional of the unknown coefficients, for A views of one prior.

    Attributes
    ----------
    unknown : (45 B,) bool
        Which coefficients are unknown: U of them.
    mean : (A, 45 B)
        Prior mean of all coefficients in the axes of each view, mm.
    heights : HeightsSeen
        The vertical comes first.
    axes : (A, 3, 3)
        Of the views, as `image_axes` has them.
    across, missing : (O,), (U,) int
        Rows of what is left then, turned into the axes of a view, that it shows and does not show.
    factor : (A, O, O)
        Lower Cholesky factor of the covariance of the former given the vertical, with its noise.
    crossed : (A, U, O)
        Covariance of the latter with the former, given the vertical, mm².
    before : (A, U, U)
        Of the latter.
    """

    unknown: np.ndarray
    mean: np.ndarray
    heights: HeightsSeen
    axes: np.ndarray
    across: np.ndarray
    missing: np.ndarray
    factor: np.ndarray
    crossed: np.ndarray
    before: np.ndarray

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
        _, off, found = self._given_heights(observed)
        found += self.mean[:, None, self.unknown]
        for mean, factor, crossed, of_view in zip(found, self.factor, self.crossed, off, strict=True):
            mean += lapack.dpotrs(factor, of_view.T, lower=1)[0].T @ crossed.T
        return found

    def cost(self, observed: np.ndarray) -> np.ndarray:
        """-2 log p (A, M) of the same observed coefficients (M, O) from every view, but for a constant."""
        heights, off, _ = self._given_heights(observed[None])
        found = []
        for factor, values in ((self.heights.factor, heights[0]), *zip(self.factor, off, strict=True)):
            white, _ = lapack.dtrtrs(factor, values.T, lower=1)
            found.append((white**2).sum(axis=0) + 2.0 * np.log(np.diag(factor)).sum())
        return np.stack(found[1:]) + found[0]

    def _given_heights(self, observed: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What the vertical is off by, what is across once it is known, and what it makes of the unknown.

        Observed are (A, M, O), or (1, M, O) from every view.
        """
        off = observed - self.mean[:, None, ~self.unknown]
        off = off.reshape(*off.shape[:2], -1, 2, self.heights.prior.mean.shape[-1])
        shape, level = off.shape[:2], 2 * JOINTS * off.shape[-1]
        heights = off[: len(observed), :, :, 1].reshape(len(observed) * shape[1], -1)
        rest = lapack.dpotrs(self.heights.factor, heights.T, lower=1)[0].T @ self.heights.tied
        rest = rest.reshape(len(observed), shape[1], -1)
        turned = self.axes[:, None, ::2, :2] @ rest[..., :level].reshape(*rest.shape[:2], 2, -1)
        rest = np.broadcast_to(rest, (*shape, rest.shape[-1])).copy()
        rest[..., :level] = turned.reshape(*shape, -1)
        across = off[..., 0, :].reshape(*shape, -1)
        return (
            heights.reshape(len(observed), shape[1], -1),
            across - rest[..., self.across],
            rest[..., self.missing],
        )


def condition(
    prior: Prior, view_angles_rad: np.ndarray, *, noise: Noise, hidden: np.ndarray = NOTHING_HIDDEN
) -> Conditional:
    """Return the conditional of what A views do not show, as `heights_seen` and `HeightsSeen.from_views` make it."""
    return heights_seen(prior, noise=noise, hidden=hidden).from_views(view_angles_rad)


def heights_seen(prior: Prior, *, noise: Noise, hidden: np.ndarray = NOTHING_HIDDEN) -> HeightsSeen:
    """Return the prior once the vertical of the joints seen has been observed.

    Parameters
    ----------
    prior : Prior
    noise : Noise
    hidden : (15,) bool
        Joints that the image does not show.

    Raises
    ------
    InvalidInput
        If prior and noise leave the observed coefficients without variance.
    """
    blocks = prior.mean.shape[-1]
    C, n = prior.by_axis, JOINTS * blocks
    heights: slice | np.ndarray = slice(2 * n, None)
    rest: slice | np.ndarray = slice(2 * n)
    seen = np.repeat(~hidden, blocks)
    if hidden.any():
        heights, rest = (
            np.flatnonzero(np.append(np.repeat(left, 2 * n), part))
            for left, part in ((False, seen), (True, ~seen))
        )
    K, tied = C[heights][:, heights].copy(), C[heights][:, rest]
    floor = np.tile(noise.floor(blocks), JOINTS)[seen]
    K.flat[:: len(K) + 1] += noise.variance + noise.share * np.diag(K) + floor
    _factorise(K)
    white, _ = lapack.dtrtrs(K.T, tied, lower=1)
    return HeightsSeen(
        prior, noise, hidden, factor=K.T, tied=tied, covariance=C[rest][:, rest] - white.T @ white
    )


def _factorise(covariance: np.ndarray) -> None:
    """Put the upper Cholesky factor, the transpose of the lower one, in the place of a covariance."""
    _, failed = lapack.dpotrf(covariance.T, lower=1, overwrite_a=1)
    if failed:
        raise InvalidInput(
            "the observed coefficients have no variance",
            expected="a noise variance or tau above 0",
            code="no_variance",
        )


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
        If a noise variance is so small that the system is singular to rounding.

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
            matrix = products.copy()
            matrix[diagonal] += variance
            _, shares, failed = lapack.dposv(matrix.T, right, lower=1, overwrite_a=1)
            if failed:
                raise InvalidInput(
                    "walks that depend on each other need more noise",
                    expected="a larger sigma²",
                    code="too_little_noise",
                )
            found[s, a] = hidden[0] + shares.T @ hidden[1:]
    return found
