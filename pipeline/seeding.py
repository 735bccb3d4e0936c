"""Generators of random numbers that depend on the seed and on what they are for, and on nothing else."""

from __future__ import annotations

import hashlib

import numpy as np


def derive_generator(seed: int, purpose: str) -> np.random.Generator:
    """Return the generator of one purpose, e.g. of a stage.

    Parameters
    ----------
    seed : int
        Of the experiment.
    purpose : str
        Name of the stage, or of whatever else draws numbers of its own.

    Examples
    --------
    >>> bool(derive_generator(7, "sweep").random() == derive_generator(7, "sweep").random())
    True
    """
    entropy = int(hashlib.sha256(f"{seed}:{purpose}".encode()).hexdigest(), 16)
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(entropy)))
