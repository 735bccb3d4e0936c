"""Synchronization of performances: one is resampled so that its timing follows another (mozerov2006 section 3).

`synchronize` does it for a pair, `synchronize_all` for all ordered pairs, `distances` says how far
these are apart, `median_sequence` chooses the pattern to which all are brought; `normalise` aligns ends
alone, and `choose_key_frames` with `resample_by_key_frames` is the paper's comparison.

Symbols
-------
``x_n, x_m``  base sequence and the one that is brought to it, (P, b) in the aSpace
``Delta``     disparity function, in samples; ``tau = p + Delta(p)`` the rate-to-rate synchronization function
``mu``        smoothness, in squared aSpace units per sample of change
``E``         disparity space image, squared distances of x_n(p) and x_m(p + d)
"""

from pipeline.core.synchronization.all_pairs import AllPairs, distances, median_sequence, synchronize_all
from pipeline.core.synchronization.key_frames import (
    KeyFrames,
    KeyFrameSynchronization,
    choose_key_frames,
    resample_by_key_frames,
)
from pipeline.core.synchronization.pair import (
    Synchronization,
    disparity_space_image,
    normalise,
    rate_to_rate,
    synchronization_distance,
    synchronize,
    warp,
)
from pipeline.core.synchronization.trellis import PENALTIES, STARTS, Trellis, allowed_disparities

__all__ = [
    "PENALTIES",
    "STARTS",
    "AllPairs",
    "KeyFrameSynchronization",
    "KeyFrames",
    "Synchronization",
    "Trellis",
    "allowed_disparities",
    "choose_key_frames",
    "disparity_space_image",
    "distances",
    "median_sequence",
    "normalise",
    "rate_to_rate",
    "resample_by_key_frames",
    "synchronization_distance",
    "synchronize",
    "synchronize_all",
    "warp",
]
