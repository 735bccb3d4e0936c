"""Percentage of coefficients outside the range of the training people, by image noise and number of components.

Each of 80 synthetic people is left out in turn and reconstructed by least squares from 13 views [zhang2007 3.9].

noise_mm     white noise on each observed number, sd in mm
components   components of the model; the rest of the variance cannot be represented
over_range   coefficients below the lowest or above the highest of the training people, %
observed     the same for coefficients of all 225 numbers without noise, %
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pipeline.core import linear_model, reconstruction
from pipeline.seeding import derive_generator
from tests.benchmarks.inputs import samples
from tests.benchmarks.naive import projected
from tests.benchmarks.tables import Row

NOISE_MM, COMPONENTS = (0.0, 5.0, 10.0), (28, 78)
VIEWS_RAD = np.radians(np.arange(-90.0, 91.0, 15.0))


def over_range(coefficients: np.ndarray, training: np.ndarray) -> float:
    """Return the percentage of coefficients (…, N) outside the range of the training people's coefficients (R, N)."""
    beyond = (coefficients < training.min(axis=0)) | (coefficients > training.max(axis=0))
    return 100.0 * float(beyond.mean())


def _shares(people: np.ndarray, components: int, noise_mm: float) -> Iterator[tuple[float, float]]:
    """Yield, for each left-out person and view, the percentages outside the range, from an image and from 3D data."""
    rng = derive_generator(0, "noise of images")  # the same numbers for all sizes
    for model, number in linear_model.leave_one_out(people, components):
        training = (np.delete(people, number, axis=0) - model.mean) @ model.components.T
        whole = over_range(model.components @ (people[number] - model.mean), training)
        for view in VIEWS_RAD:
            image = projected(people[number] - model.mean, view)
            image = image + noise_mm * rng.standard_normal(len(image))
            k = reconstruction.least_squares(projected(model.components.T, view), image)
            yield over_range(k, training), whole


def run() -> list[Row]:
    """Return a row for each number of components and each noise level."""
    people, rows = samples(), list[Row]()
    for components in COMPONENTS:
        for noise in NOISE_MM:
            share, whole = np.mean(list(_shares(people, components, noise)), axis=0).tolist()
            rows.append({"components": components, "noise_mm": noise, "over_range": share, "observed": whole})
    return rows
