"""Cosine basis for smooth trajectories with gaps, with a hard or a gradual limit of frequency (park2011 section 2).

Symbols
-------
``F``      frames, ``K`` components, ``Theta`` basis (F, K) of orthonormal columns, lowest frequency first
``a``      coefficients of a trajectory, a column for each coordinate
``R``      ridge (K,): what each squared coefficient costs
``B``      basis (n, K) of the n observed frames, with ``min over a of ||c - Theta_o a||² + a^T R a``
           equal to ``||c||² - ||B^T c||²``

The hard basis, as printed, has no ridge: component K - 1 is free and component K is forbidden.  The soft one lets
components cost more with their frequency, ``R_k = (k / k0)^6``; the same quadratic form with shorter columns, it
needs no tuning and, unlike the hard one, does not run wild in gaps.  The null space of the basis is never formed:
all that it is needed for is a sum of squares less another.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from pipeline.validation import InvalidInput, require_count, require_finite, require_range, require_shape

EXPONENT = 6.0
"""Exponent of the penalty on frequency in a soft basis; 6 penalises the square of the third derivative."""

COSINES_PER_S = 8.0
"""Number of cosines in the trajectory basis per second of a clip.

At 3, 4, 6, 8 and 12 cosines per second, the mean error of limbs was 136, 113, 108, 95 and 102 mm. The test
had 24 clips of varied motion, with moving and shaking cameras, without noise and with noise of 1 px.
"""

_SINGULAR = 1e-9
"""Smallest singular value, at most one, at which observed frames determine all coefficients of a trajectory."""


def cosine_basis(F: int, K: int, *, at: np.ndarray | None = None) -> np.ndarray:
    """Return the first K orthonormal discrete cosines (DCT-II) over F frames, (F, K) [park2011 2].

    Parameters
    ----------
    F : int
        Frames, at least one.
    K : int
        Components, from 1 to F.
    at : (T,), optional
        Times, counted in frames from 0 to F - 1: rows (T, K) there, between frames as well.

    Raises
    ------
    InvalidInput
        If there are no frames, or fewer components than asked for.

    Examples
    --------
    >>> cosine_basis(4, 2).round(3)
    array([[ 0.5  ,  0.653],
           [ 0.5  ,  0.271],
           [ 0.5  , -0.271],
           [ 0.5  , -0.653]])
    >>> cosine_basis(4, 2, at=np.array([1.5])).round(3) + 0.0
    array([[0.5, 0. ]])
    """
    require_count("frames", F)
    require_count("components", K, at_most=F)
    return _cosines(F, K).copy() if at is None else _cosines_at(F, K, np.asarray(at))


@lru_cache(maxsize=32)
def _cosines(F: int, K: int) -> np.ndarray:
    return _cosines_at(F, K, np.arange(F))


def _cosines_at(F: int, K: int, times: np.ndarray) -> np.ndarray:
    # Multiples of a quarter turn over F, reduced in whole numbers: exact for sequences of any length.
    quarters = (2 * times[:, None] + 1) * np.arange(K) % (4 * F)
    basis = np.sqrt(2.0 / F) * np.cos(np.pi / (2 * F) * quarters)
    basis[:, 0] = np.sqrt(1.0 / F)
    return basis


class BasisProducts(NamedTuple):
    """Products of pairs of basis columns, from which Theta^T diag(w) Theta can be computed for any weights w (F,).

    With sums = w^T columns it is ``scale * (sums[first] + sums[second])``.

    Attributes
    ----------
    columns : (F, n)
    first, second : (K, K) int
        Places of a product among the columns.
    scale : (K, K)
    """

    columns: np.ndarray
    first: np.ndarray
    second: np.ndarray
    scale: np.ndarray


def products(basis: np.ndarray) -> BasisProducts:
    """Return the products of all pairs of columns of a basis (F, K).

    Products of cosines are cosines of sum and difference, 2 K - 1 in all.

    Examples
    --------
    >>> found, weights = products(cosine_basis(4, 2)), np.array([1.0, 2.0, 3.0, 4.0])
    >>> sums = weights @ found.columns
    >>> blocks = found.scale * (sums[found.first] + sums[found.second])
    >>> np.allclose(blocks, cosine_basis(4, 2).T @ np.diag(weights) @ cosine_basis(4, 2))
    True
    """
    frames, components = basis.shape
    if components <= frames and np.array_equal(basis, _cosines(frames, components)):
        return _products_of_cosines(frames, components)
    k = np.arange(components)
    pairs = k[:, None] * components + k
    columns = (basis[:, :, None] * basis[:, None]).reshape(frames, -1)
    return BasisProducts(columns, pairs, pairs, np.full(pairs.shape, 0.5))


@lru_cache(maxsize=32)
def _products_of_cosines(frames: int, components: int) -> BasisProducts:
    k = np.arange(components)
    quarters = (2 * np.arange(frames)[:, None] + 1) * np.arange(2 * components - 1) % (4 * frames)
    size = np.where(k > 0, np.sqrt(2.0 / frames), np.sqrt(1.0 / frames))
    columns = np.cos(np.pi / (2 * frames) * quarters)
    return BasisProducts(columns, np.abs(k[:, None] - k), k[:, None] + k, 0.5 * np.outer(size, size))


def soft_ridge(components: int, cutoff: float) -> np.ndarray:
    """Return the penalties (K,) on the coefficients of a soft basis: R = (k / k0)^6.

    The constant is not penalised; coefficient k0 is halved.

    Parameters
    ----------
    components : int
        K.
    cutoff : float
        k0, in components: 8 to 14 for limbs over 100 frames at 30 Hz.

    Raises
    ------
    InvalidInput
        If it is not positive.

    Examples
    --------
    >>> soft_ridge(4, 1.0)
    array([  0.,   1.,  64., 729.])
    """
    return (np.arange(components) / require_range("cutoff", cutoff, above=0.0)) ** EXPONENT


@dataclass(frozen=True)
class TrajectoryBasis:
    """Options of a trajectory basis: number of cosines, and cutoff if high frequencies are penalised (soft basis).

    Attributes
    ----------
    components : int
        K.
    cutoff : float or None
        k0 of a soft basis: coefficient k is drawn to zero with weight (k / k0)^6; None for a hard one, as printed.

    Raises
    ------
    InvalidInput
        If there is no component, or the cutoff is not a number above zero.
    """

    components: int
    cutoff: float | None = None

    def __post_init__(self) -> None:
        require_count("components", self.components)
        _ = self.ridge

    @classmethod
    def of_clip(cls, frames: int, frame_rate_hz: float) -> TrajectoryBasis:
        """Return the default basis of a clip: `COSINES_PER_S` cosines per second, but at most half as many as frames.

        Examples
        --------
        >>> TrajectoryBasis.of_clip(300, 30.0), TrajectoryBasis.of_clip(300, 10.0)
        (TrajectoryBasis(components=80, cutoff=None), TrajectoryBasis(components=150, cutoff=None))

        Raises
        ------
        InvalidInput
            If the frame rate is not positive.
        """
        seconds = frames / require_range("frame_rate_hz", frame_rate_hz, above=0.0, unit="Hz")
        return cls(max(1, min(round(COSINES_PER_S * seconds), frames // 2)))

    @property
    def ridge(self) -> np.ndarray:
        """Penalties (K,) on the coefficients: R = (k / k0)^6 for a soft basis, zero for a hard basis."""
        return np.zeros(self.components) if self.cutoff is None else soft_ridge(self.components, self.cutoff)

    def rows(self, frames: int, observed: np.ndarray) -> np.ndarray:
        """Return the trajectory basis (n, K) restricted to the n observed frames.

        If n is smaller than K, it is (n, n) with the same B B^T.

        Parameters
        ----------
        frames : int
        observed : (F,) bool
        """
        observed = np.asarray(observed)
        return _rows(self, frames, observed.tobytes(), observed.dtype, observed.shape)


@lru_cache(maxsize=64)
def _rows(
    basis: TrajectoryBasis, frames: int, observed: bytes, kind: np.dtype, shape: tuple[int, ...]
) -> np.ndarray:
    """Return the trajectory basis restricted to observed frames; cached, because many limbs share these frames."""
    mask = np.frombuffer(observed, kind).reshape(shape)
    rows = restricted(cosine_basis(frames, basis.components), mask, ridge=basis.ridge)
    if len(rows) < basis.components:
        left, size, _ = np.linalg.svd(rows, full_matrices=False)
        rows = left * np.minimum(size, 1.0)
    rows.flags.writeable = False
    return rows


def restricted(theta: np.ndarray, observed: np.ndarray, *, ridge: np.ndarray | None = None) -> np.ndarray:
    """Return a basis B (n, K) of the n observed frames, such that ||c||² - ||B^T c||² is the error of the best fit to
    c.

    B = Theta_o L^-T, with L L^T = Theta_o^T Theta_o + diag(R).

    Parameters
    ----------
    theta : (F, K)
        Basis of all frames.
    observed : (F,) bool
        Frames that were seen.
    ridge : (K,), optional
        R; without it the basis is hard, and the columns of B are orthonormal.

    Raises
    ------
    InvalidInput
        If no frame was observed, or too few for this number of components.

    Notes
    -----
    By orthogonal factors of Theta_o above diag(sqrt(R)), which lose half as many digits as L does.
    """
    above, stacked = _stacked(theta, observed, ridge)
    q, r = np.linalg.qr(stacked)
    return q[:above] * np.where(np.diag(r) < 0, -1.0, 1.0)


def coefficients(
    theta: np.ndarray, observed: np.ndarray, values: np.ndarray, *, ridge: np.ndarray | None = None
) -> np.ndarray:
    """Return the coefficients (K, D) of the trajectory that fits the observed frames best [park2011 2].

    Parameters
    ----------
    theta : (F, K)
        Basis of all frames.
    observed : (F,) bool
        Frames that were seen.
    values : (F, D)
        Coordinates, any unit; those of frames that were not seen are not read.
    ridge : (K,), optional
        R.

    Raises
    ------
    InvalidInput
        If the observed frames do not determine the coefficients, or are not finite.
    """
    above, stacked = _stacked(theta, observed, ridge)
    values = require_shape("trajectory", np.asarray(values, float), (len(theta), "D"))
    samples = values[np.asarray(observed, bool)]
    _check_finite(samples, np.flatnonzero(observed))
    q, r = np.linalg.qr(stacked)
    return np.linalg.solve(r, q[:above].T @ samples)


def on_rays(theta: np.ndarray, middle: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return the trajectory (F, 3), mm, in the span of the basis that is nearest to the image rays.

    The length of the limb is not used.  If several trajectories are equally near, the one with the smallest
    norm is returned.

    The linear solution of Park et al. 2010, reference 28 of park2011, which says of it what cannot be had by the
    basis alone [park2011 4].  It is as good as the rays' own motion lies outside the basis.

    Parameters
    ----------
    theta : (F, K)
        Basis of frames in which the rays are known.
    middle, direction : (F, 3)
        A point of each ray, mm, and its unit direction.

    Examples
    --------
    >>> theta, rays = cosine_basis(4, 1), np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 0]])
    >>> on_rays(theta, 3.0 - 2.0 * rays, rays).round(9)[0]
    array([3., 3., 3.])
    """
    across = np.eye(3) - direction[:, :, None] * direction[:, None]
    frames, components = theta.shape
    system = (theta[:, None, :, None] * across[:, :, None]).reshape(3 * frames, 3 * components)
    target = (across @ middle[..., None]).ravel()
    solution = np.linalg.lstsq(system, target, rcond=_SINGULAR)[0]
    return theta @ solution.reshape(components, 3)


def _stacked(theta: np.ndarray, observed: np.ndarray, ridge: np.ndarray | None) -> tuple[int, np.ndarray]:
    """Return the number of observed frames, and the rows of the least squares system: observed basis rows, then
    penalties.

    Raises
    ------
    InvalidInput
        If they do not determine the coefficients.
    """
    theta, mask = np.asarray(theta, float), np.asarray(observed)
    if theta.ndim != 2 or mask.shape != theta.shape[:1] or mask.dtype != bool:
        raise InvalidInput(
            "basis and mask of observed frames have incompatible shapes",
            expected="a basis (F, K), and a mask (F,) of booleans",
            received=f"{theta.shape}, {mask.shape} {mask.dtype}",
            code="mismatch",
        )
    frames, components = theta.shape
    count = int(mask.sum())
    if count == 0:
        raise InvalidInput(
            "the trajectory was observed in no frame",
            expected="observed frames",
            received=f"none of {frames}",
            code="all_missing",
        )
    rows = theta[mask]
    if ridge is not None:
        weights = np.asarray(ridge, float)
        require_range(
            "ridge",
            require_finite("ridge", require_shape("ridge", weights, (components,))).min(),
            at_least=0,
        )
        rows = np.concatenate([rows, np.diag(np.sqrt(weights))])
    singular = np.linalg.svd(rows, compute_uv=False)
    if len(singular) < components or singular[-1] < _SINGULAR:
        raise InvalidInput(
            f"{count} observed frames of {frames} cannot determine {components} basis components",
            expected="fewer components, a soft basis, or shorter gaps",
            code="undetermined",
            observed=count,
            components=components,
        )
    return count, rows


def _check_finite(values: np.ndarray, frames: np.ndarray) -> None:
    """Raise InvalidInput if a frame has values that are not finite."""
    wrong = ~np.isfinite(values).all(axis=1)
    if wrong.any():
        raise InvalidInput(
            "the trajectory is not finite in an observed frame",
            f"frame {frames[np.argmax(wrong)]}",
            "finite numbers",
            code="not_finite",
        )
