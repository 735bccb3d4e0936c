"""Random number generators that depend only on a seed and on the purpose of the numbers."""

from __future__ import annotations

import hashlib

import numpy as np


def derive_generator(seed: int, purpose: str) -> np.random.Generator:
    """Return the random number generator for one purpose, such as a stage.

    Parameters
    ----------
    seed : int
        Seed of the experiment.
    purpose : str
        Name of the stage or other consumer of random numbers.

    Examples
    --------
    >>> bool(derive_generator(7, "sweep").random() == derive_generator(7, "sweep").random())
    True
    """
    entropy = int(hashlib.sha256(f"{seed}:{purpose}".encode()).hexdigest(), 16)
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(entropy)))
