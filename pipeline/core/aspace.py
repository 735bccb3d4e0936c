"""The aSpace of an action: a low-dimensional space of postures, from a few eigenvectors (mozerov2006 section 2).

Symbols
-------
``psi``     posture, 37 numbers; ``psi_bar`` its mean over all postures of all performances
``Sigma``   covariance of the postures; ``e_j``, ``lambda_j`` its eigenvectors and eigenvalues
``b``       number of eigenvectors that are kept

The linear model is that of the eigenwalkers; only what is a sample differs: a posture, not a walk.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.core import linear_model
from pipeline.shortened import shortened
from pipeline.validation import InvalidInput, require_count, require_range, require_shape


@shortened
class ASpace:
    """Low-dimensional space of the postures of one action, with projection and inverse projection [mozerov2006 5].

    Attributes
    ----------
    mean : (37,)
        Mean posture.
    components : (b, 37)
        Orthonormal; the largest entry of each is positive.
    eigenvalues : (K,)
        All of them, descending, K = 37 or what the postures span.
    total_variance : float
    """

    mean: np.ndarray
    components: np.ndarray
    eigenvalues: np.ndarray
    total_variance: float

    @property
    def dimensions(self) -> int:
        """Number of dimensions b of the aSpace."""
        return len(self.components)

    @property
    def variance_held(self) -> float:
        """Share of the variance that the b eigenvectors explain."""
        return self.eigenvalues[: self.dimensions].sum() / self.total_variance

    def project(self, postures: np.ndarray) -> np.ndarray:
        """Project postures (…, 37) into the aSpace (…, b)."""
        return (np.asarray(postures, float) - self.mean) @ self.components.T

    def postures(self, coordinates: np.ndarray) -> np.ndarray:
        """Return the postures (…, 37) at points (…, b) of the aSpace.

        Their direction cosines must be normalised before they are drawn.
        """
        return self.mean + np.asarray(coordinates, float) @ self.components


def smallest_dimensions(eigenvalues: np.ndarray, total_variance: float, variance: float) -> int:
    """Return the smallest number of dimensions b that explains a given share of the variance [mozerov2006 4].

    Parameters
    ----------
    eigenvalues : (K,)
        Descending.
    total_variance : float
    variance : float
        Share to be held, above 0 and up to 1.

    Raises
    ------
    InvalidInput
        If the share is out of range.

    Examples
    --------
    >>> smallest_dimensions(np.array([6.0, 3.0, 1.0]), 10.0, 0.9)
    2
    """
    require_range("the share of the variance", variance, above=0, at_most=1)
    cumulative = np.cumsum(eigenvalues) / total_variance
    # Rounding must not ask for one more eigenvector.
    return min(int(np.searchsorted(cumulative, variance * (1 - 1e-12))) + 1, len(cumulative))


def learn(
    performances: Sequence[np.ndarray], *, variance: float = 0.95, dimensions: int | None = None
) -> ASpace:
    """Learn the aSpace from all postures of all performances of an action [mozerov2006 3].

    Parameters
    ----------
    performances : sequence of (F_i, 37)
        Postures.
    variance : float
        The smallest number of eigenvectors that holds so much of it is kept.
    dimensions : int, optional
        Number of dimensions to keep instead.

    Raises
    ------
    InvalidInput
        If there are no performances or a single posture, a performance is no list of postures or not finite, the
        postures do not vary, more dimensions are wanted than there are, or as `smallest_dimensions`.
    """
    samples = _all_postures(performances)
    if not np.ptp(samples, axis=0).any():
        raise InvalidInput(
            "the postures are all identical, so they span no aSpace",
            received=f"{len(samples)} postures",
            code="identical_postures",
            count=len(samples),
        )
    model = linear_model.fit(samples, samples.shape[1])
    b = smallest_dimensions(model.eigenvalues, model.total_variance, variance)
    if dimensions is not None:
        require_count("the number of dimensions", dimensions, at_most=len(model.eigenvalues))
        b = dimensions
    return ASpace(model.mean, model.components[:b], model.eigenvalues, model.total_variance)


def _all_postures(performances: Sequence[np.ndarray]) -> np.ndarray:
    if not len(performances):
        raise InvalidInput("no performances", expected="one or more", received="none", code="no_performances")
    arrays = [np.asarray(p, float) for p in performances]
    for number, performance in enumerate(arrays):
        where = f"performance {number}"
        require_shape(where, performance, ("F", arrays[0].shape[-1]))
        if not np.isfinite(performance).all():
            frame = int(np.argwhere(~np.isfinite(performance))[0][0])
            raise InvalidInput(
                f"posture {frame} has values that are not finite", where, code="not_finite", frame=frame
            )
    samples = np.concatenate(arrays)
    if len(samples) < 2:
        raise InvalidInput(
            "an aSpace cannot be learnt from one posture",
            expected="2 or more",
            received=len(samples),
            code="too_few_postures",
            count=len(samples),
        )
    return samples
