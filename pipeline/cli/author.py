"""Return average walkers of the BioMotion Lab for commands, and write walks in the laboratory's ``mm`` format."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.cli.walkers import Walk
from pipeline.core import fourier
from pipeline.formats import fourier_walks
from pipeline.formats.fourier_walks import FourierWalk
from pipeline.ingestion.author import AVERAGE, find_here
from pipeline.skeleton import ANKLES, WALKER15
from pipeline.validation import InvalidInput


def author_walk(**values: float) -> Walk:
    """Return the BioMotion Lab's average walker, or a walker with the given values on its attribute axes (mood, …).

    The walker's name states source and terms.

    Raises
    ------
    InvalidInput
        If the file is not on this machine, or a value is out of range.
    """
    average = fourier_walks.average_walker(find_here(AVERAGE, None).path)
    walk = average.at(**values)
    ours = fourier_walks.in_world(walk.coefficients)
    ours[0] -= ours[0, WALKER15.index("pelvis")]
    left, right = ANKLES
    _, sine, cosine, *_ = (ours[:, left] - ours[:, right])[:, 1]
    ours = fourier.shift(ours, np.arctan2(cosine, sine))
    moved = ", ".join(f"{axis} {value:+g}" for axis, value in values.items() if value)
    name = "average walker" + (f", {moved}" if moved else "") + f" ({average.source})" * bool(average.source)
    return Walk(name, ours, walk.stride_hz, np.zeros(len(WALKER15.joints), bool), walk.speed_mm_s)


def write_mm(path: Path, walk: Walk, speed_mm_s: float) -> None:
    """Write a walk, relative to its mean pelvis position, as an ``mm`` file of the BioMotion Lab.

    At time zero, the left ankle is in front.

    Raises
    ------
    InvalidInput
        If the walk does not have two harmonics.
    """
    if len(walk.coefficients) != 5:
        harmonics = len(walk.coefficients) // 2
        raise InvalidInput(
            "must be 2, because an mm file stores two harmonics",
            "harmonics",
            received=harmonics,
            code="two_harmonics",
        )
    later = fourier.shift(walk.coefficients, -np.pi / 2)
    coefficients = fourier_walks.from_world(later)
    period = fourier_walks.RATE_HZ / walk.stride_hz
    written = FourierWalk(coefficients, period, speed=speed_mm_s / fourier_walks.RATE_HZ)
    fourier_walks.write_mm(path, written)
