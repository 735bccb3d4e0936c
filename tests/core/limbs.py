"""Synthetic limbs for tests, with smooth coordinates and therefore varying length."""

from __future__ import annotations

import numpy as np

from pipeline.synthetic.limbs import smooth_series


def cartesian_limb(
    generator: np.random.Generator,
    frames: int,
    *,
    length_mm: float = 300.0,
    swing: float = 0.8,
    bandwidth: int = 6,
) -> np.ndarray:
    """Return a relative limb trajectory (F, 3), mm, whose coordinates lie in a cosine basis, so that its length varies.

    Parameters
    ----------
    generator : numpy.random.Generator
    frames : int
    length_mm : float
        Length of the mean vector.
    swing : float
        Largest departure of each coordinate, as a fraction of that length.
    bandwidth : int
        K, the constant included.
    """
    mean = generator.standard_normal(3)
    moving = swing * smooth_series(generator, frames, 3, bandwidth=bandwidth)
    return np.asarray(length_mm * (mean / np.linalg.norm(mean) + moving))
