"""Fraction of 95 % bootstrap intervals that contain the true mean, by number of people and shape of the distribution.

No times: shares of the samples, in percent, drawn from a fixed seed.  People are resampled as in the ledger;
populations have Student's interval of their mean.
"""

from __future__ import annotations

import numpy as np

from pipeline.core import bootstrap
from pipeline.seeding import derive_generator
from tests.benchmarks.tables import Row

PEOPLE = (3, 5, 10, 12, 33, 80)
SHAPES = {"normal": None, "gamma of shape 4": 4.0, "exponential": 1.0}


def sample(generator: np.random.Generator, shape: float | None, size: int) -> np.ndarray:
    """Return a random sample of people's values from a distribution with mean 1."""
    if shape is None:
        return generator.normal(1.0, 0.3, size=size)
    return generator.gamma(shape, 1.0 / shape, size=size)


def coverage(people: int, shape: float | None, draws: int, *, resamples: int = bootstrap.RESAMPLES) -> float:
    """Return the percentage of samples whose 95 % interval of the mean contains the true mean."""
    generator = derive_generator(0, f"coverage {people} {shape}")
    fixed = 0
    for _ in range(draws):
        values = sample(generator, shape, people)
        weights = bootstrap.resampling_weights(people, generator, resamples=resamples)
        left_out = (values.sum() - values) / (people - 1)
        low, high = bootstrap.cluster_interval(values.mean(), weights @ values / people, left_out, people)
        fixed += low <= 1.0 <= high
    return 100.0 * fixed / draws


def run(draws: int | str = 2000) -> list[Row]:
    """Return a row for each number of people, with a column for each shape of the distribution."""
    return [
        {"people": people, **{name: coverage(people, shape, int(draws)) for name, shape in SHAPES.items()}}
        for people in PEOPLE
    ]
