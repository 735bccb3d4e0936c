"""Input of the benchmarks: synthetic walkers as vectors of 225 numbers, used for our code and for other libraries."""

from __future__ import annotations

from functools import cache

import numpy as np

from pipeline.core import fourier, linear_model, walking
from pipeline.synthetic import walkers as synthetic

COMPONENTS = 30
NOISE_VARIANCE_MM2 = 70.0
VIEWS_RAD = np.radians(np.arange(-90.0, 91.0))


@cache
def samples(male: int = 32, female: int = 48) -> np.ndarray:
    """Return the Fourier representations (R, 225), mm, of synthetic walkers."""
    walkers = synthetic.walking_population(np.random.default_rng(2007), male=male, female=female)
    rate = walkers.frame_rate_hz
    series = [
        fourier.represent(
            walking.set_origin(
                walking.treadmill_equivalent(walk, rate, locomotion="treadmill"), origin="pelvis_mean"
            ),
            rate,
        )
        for walk in walkers.positions_mm
    ]
    return linear_model.flatten(np.stack([s.coefficients for s in series]))


def split_by_sex(walkers: int) -> dict[str, int]:
    """Return the numbers of men and women in the papers' ratio of 2 to 3."""
    return {"male": round(0.4 * walkers), "female": walkers - round(0.4 * walkers)}
