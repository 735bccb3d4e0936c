"""Gaussian distribution of a walker's unknown coefficients given the observed ones, without bone-length constraints.

Symbols
-------
``o, u``   observed and unknown coefficients of a view; observed: across and up of visible joints; unknown: away of all
           joints, and all axes of hidden joints
``N``      ``sigma² I + delta diag C_oo + floor``, noise of the observed coefficients
``mu``     ``m_u + C_uo (C_oo + N)^-1 (o - m_o)``, mean of u given o
``Sigma``  ``C_uu - C_uo (C_oo + N)^-1 C_ou``, covariance of u given o, the same for all walkers

The vertical is the same in all views.  It is therefore conditioned on first, once for all views, and then across.

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
    """Noise model of the observed Fourier coefficients of a walker.

    Attributes
    ----------
    variance : float
        sigma², mm².
    share : float
        delta, a share of each observed coefficient's variance.
    bias : float
        Standard deviation of a constant offset of each joint, mm: bias of a detector.
    slow : float
        Root mean square of an error that repeats with the gait cycle, mm.
    """

    variance: float = 100.0
    share: float = 0.2
    bias: float = 0.0
    slow: float = 0.0

    def floor(self, blocks: int) -> np.ndarray:
        """Return the variances (1 + 2H,), mm², that constant and periodic detector errors add to a joint's
        coefficients."""
        harmonics = max(blocks // 2, 1)
        return np.concatenate([[self.bias**2], np.full(blocks - 1, self.slow**2 / harmonics)])


def unknown_coefficients(hidden: np.ndarray, blocks: int) -> np.ndarray:
    """Return the mask (45 B,) of coefficients that a view does not show, by joint, image axis and harmonic."""
    unknown = np.zeros((JOINTS, 3, blocks), bool)
    unknown[:, 2] = True
    unknown[hidden] = True
    return unknown.ravel()


NOTHING_HIDDEN = np.zeros(JOINTS, bool)
"""Mask (15,) that marks no joint as hidden."""


def inverse(matrix: np.ndarray) -> np.ndarray:
    """Return the inverse of a positive definite matrix.  Raises InvalidInput if it is not positive definite."""
    factor, failed = lapack.dpotrf(matrix.T, lower=1)
    if failed:
        raise InvalidInput(
            "the covariance of the unknown coefficients is not positive definite",
            expected="a variance tau above 0 in directions without training walks",
            code="not_positive_definite",
        )
    half, _ = lapack.dpotri(factor, lower=1, overwrite_c=1)
    full = half + half.T  # dpotri leaves the other triangle zero
    full[np.diag_indices_from(full)] /= 2.0
    return full


@dataclass(frozen=True)
class HeightsSeen:
    """Prior of a walker, conditioned on the vertical coordinates of the visible joints, which every view shows.

    Each view then needs a system of half the size, for the remaining R coefficients.  They are ordered by axis: x and y
    of all joints, n = 15 B each, then the vertical of hidden joints.

    Attributes
    ----------
    prior : Prior
    noise : Noise
    hidden : (15,) bool
        Joints that are not visible in the image.
    factor : (Z, Z)
        Lower Cholesky factor of the covariance of the observed vertical coefficients, with their noise.
    tied : (Z, R)
        Covariance of the observed vertical coefficients with the remaining ones, mm².
    covariance : (R, R)
        Covariance of the remaining coefficients given the vertical, mm².
    """

    prior: Prior
    noise: Noise
    hidden: np.ndarray
    factor: np.ndarray
    tied: np.ndarray
    covariance: np.ndarray

    def from_views(self, view_angles_rad: np.ndarray) -> Conditional:
        """Return the Gaussian distribution of the unknown coefficients given the observed ones, for A views."""
        mean, blocks = self.prior.mean, self.prior.mean.shape[-1]
        axes, n, hidden = image_axes(view_angles_rad), JOINTS * blocks, self.hidden
        views, visible = len(axes), np.repeat(~hidden, blocks)
        level = np.ascontiguousarray(self.covariance[: 2 * n, : 2 * n].reshape(2, n, 2, n).swapaxes(1, 2))
        variance = np.diagonal(self.prior.by_axis.reshape(3, n, 3, n), axis1=1, axis2=3)[:2, :2]
        variance = np.einsum("ai,ijk,aj->ak", axes[:, 0, :2], variance, axes[:, 0, :2])
        added = (
            self.noise.variance + self.noise.share * variance + np.tile(self.noise.floor(blocks), JOINTS)
        )[:, visible]
        rows = np.empty(
            (JOINTS, 3, blocks), int
        )  # rows of the remaining coefficients, turned into across, away and up
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
                turned = self.covariance.copy()
                turned[:n, :n], turned[n : 2 * n, :n], turned[n : 2 * n, n : 2 * n] = parts
                turned[:n, n : 2 * n] = parts[1].T
                up = turned[2 * n :, : 2 * n].reshape(-1, 2, n)
                turned[2 * n :, : 2 * n] = (np.stack([right, away]) @ up).reshape(-1, 2 * n)
                turned[: 2 * n, 2 * n :] = turned[2 * n :, : 2 * n].T
                parts = (turned[np.ix_(*pair)] for pair in ((across,) * 2, (missing, across), (missing,) * 2))
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
    """Gaussian distribution of a walker's unknown coefficients given the observed ones, for A views of one prior.

    Attributes
    ----------
    unknown : (45 B,) bool
        Mask of the U unknown coefficients.
    mean : (A, 45 B)
        Prior mean of all coefficients in the axes of each view, mm.
    heights : HeightsSeen
        Prior given the vertical.
    axes : (A, 3, 3)
        Axes of the views from `image_axes`.
    across, missing : (O,), (U,) int
        Rows of the remaining coefficients, in the axes of a view, that the view shows and does not show.
    factor : (A, O, O)
        Lower Cholesky factor of the covariance of the rows `across`, given the vertical, with noise.
    crossed : (A, U, O)
        Covariance of the rows `missing` with the rows `across`, given the vertical, mm².
    before : (A, U, U)
        Covariance of the rows `missing`, given the vertical, mm².
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
        """Covariances Sigma (A, U, U), mm², of the unknown coefficients given the observed ones, for A views."""
        covariances = self.before.copy()
        for sigma, factor, crossed in zip(covariances, self.factor, self.crossed, strict=True):
            white, _ = lapack.dtrtrs(factor, crossed.T, lower=1)
            sigma -= white.T @ white
        return covariances

    @cached_property
    def precision(self) -> np.ndarray:
        """Inverses (A, U, U), mm⁻², of the covariances of the unknown coefficients given the observed ones."""
        return np.stack([inverse(covariance) for covariance in self.covariance])

    def expect(self, observed: np.ndarray) -> np.ndarray:
        """Return the expected unknown coefficients mu (A, M, U), mm, given observed coefficients (A, M, O) of M
        walkers."""
        _, off, expected = self._given_heights(observed)
        expected += self.mean[:, None, self.unknown]
        for mean, factor, crossed, of_view in zip(expected, self.factor, self.crossed, off, strict=True):
            mean += lapack.dpotrs(factor, of_view.T, lower=1)[0].T @ crossed.T
        return expected

    def cost(self, observed: np.ndarray) -> np.ndarray:
        """Return twice the negative log likelihood (A, M) of A views, up to a constant, given observed coefficients (M,
        O)."""
        heights, off, _ = self._given_heights(observed[None])
        terms = []
        for factor, values in ((self.heights.factor, heights[0]), *zip(self.factor, off, strict=True)):
            white, _ = lapack.dtrtrs(factor, values.T, lower=1)
            terms.append((white**2).sum(axis=0) + 2.0 * np.log(np.diag(factor)).sum())
        return np.stack(terms[1:]) + terms[0]

    def _given_heights(self, observed: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the deviations of observed coefficients from their expectation, and the expected unknown deviations.

        In order: vertical deviations, horizontal deviations given the vertical ones, and the deviations of the unknown
        coefficients that are expected given the vertical ones.

        `observed` is (A, M, O), or (1, M, O) for the same coefficients in every view.
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
    """Return the Gaussian distribution of the unknown coefficients given the observed ones, for A views."""
    return heights_seen(prior, noise=noise, hidden=hidden).from_views(view_angles_rad)


def heights_seen(prior: Prior, *, noise: Noise, hidden: np.ndarray = NOTHING_HIDDEN) -> HeightsSeen:
    """Return the prior of a walker, conditioned on the vertical coordinates of the visible joints.

    Parameters
    ----------
    prior : Prior
    noise : Noise
    hidden : (15,) bool
        Joints that are not visible in the image.

    Raises
    ------
    InvalidInput
        If the covariance of the observed coefficients, with noise, is singular.
    """
    blocks = prior.mean.shape[-1]
    C, n = prior.by_axis, JOINTS * blocks
    heights: slice | np.ndarray = slice(2 * n, None)
    rest: slice | np.ndarray = slice(2 * n)
    visible = np.repeat(~hidden, blocks)
    if hidden.any():
        heights, rest = (
            np.flatnonzero(np.append(np.repeat(left, 2 * n), part))
            for left, part in ((False, visible), (True, ~visible))
        )
    K, tied = C[heights][:, heights].copy(), C[heights][:, rest]
    floor = np.tile(noise.floor(blocks), JOINTS)[visible]
    K.flat[:: len(K) + 1] += noise.variance + noise.share * np.diag(K) + floor
    _factorise(K)
    white, _ = lapack.dtrtrs(K.T, tied, lower=1)
    return HeightsSeen(
        prior, noise, hidden, factor=K.T, tied=tied, covariance=C[rest][:, rest] - white.T @ white
    )


def _factorise(covariance: np.ndarray) -> None:
    """Overwrite a covariance matrix with its upper Cholesky factor."""
    _, failed = lapack.dpotrf(covariance.T, lower=1, overwrite_a=1)
    if failed:
        raise InvalidInput(
            "the covariance of the observed coefficients is singular",
            expected="a noise variance sigma² above 0, or a variance tau above 0 in directions without training walks",
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
    """Return the expected unknown coefficients (S, A, M, U), mm, of M walkers in A views for S noise variances.

    The prior has the sample covariance of N training walks.

    Parameters
    ----------
    mean, walks : (45 B,), (N, 45 B)
        Mean and rows from `Walks.centred`: C is ``walks^T walks``.
    observed : (A, M, O)
        Observed coefficients in the axes of A views, mm.
    view_angles_rad : (A,)
    unknown : (45 B,) bool
    noise_variances : (S,)
        sigma², mm², positive.

    Raises
    ------
    InvalidInput
        If a noise variance is so small that the system is numerically singular.

    Notes
    -----
    With C_oo = X_o^T X_o and C_uo = X_u^T X_o, mu is ``m_u + X_u^T (X_o X_o^T + sigma² I)^-1 X_o (o - m_o)``.  This
    system has one unknown per walk, and all sigma² share its products; no covariance is needed.
    """
    expected = np.empty((len(noise_variances), *observed.shape[:2], int(unknown.sum())))
    rows = np.concatenate([mean[None], walks]).reshape(len(walks) + 1, JOINTS, 3, -1)
    diagonal = np.diag_indices(len(walks))
    for a, axes in enumerate(image_axes(view_angles_rad)):
        turned = (axes @ rows).reshape(len(rows), -1)
        visible, hidden = turned[:, ~unknown], turned[:, unknown]
        products, right = visible[1:] @ visible[1:].T, visible[1:] @ (observed[a] - visible[0]).T
        for s, variance in enumerate(noise_variances):
            matrix = products.copy()
            matrix[diagonal] += variance
            _, shares, failed = lapack.dposv(matrix.T, right, lower=1, overwrite_a=1)
            if failed:
                raise InvalidInput(
                    "the training walks are linearly dependent and need a larger noise variance",
                    expected="a larger sigma²",
                    code="too_little_noise",
                )
            expected[s, a] = hidden[0] + shares.T @ hidden[1:]
    return expected
