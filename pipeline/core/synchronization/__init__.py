"""One performance brought to the rate of another: mozerov2006 section 3."""

from pipeline.core.synchronization.pair import (
    AllPairs,
    Synchronization,
    disparity_space_image,
    distances,
    median_sequence,
    normalise,
    rate_to_rate,
    synchronization_distance,
    synchronize,
    synchronize_all,
    warp,
)

__all__ = [
    "AllPairs",
    "Synchronization",
    "disparity_space_image",
    "distances",
    "median_sequence",
    "normalise",
    "rate_to_rate",
    "synchronization_distance",
    "synchronize",
    "synchronize_all",
    "warp",
]
