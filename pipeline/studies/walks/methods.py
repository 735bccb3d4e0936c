"""Choices that both experiments on walks share: the approaches, and baselines beside them."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

from pipeline.studies.study import Grid


class Method(StrEnum):
    """The papers' two approaches, and a third one."""

    least_squares = "least_squares"
    map = "map"
    anatomical = "anatomical"
    """Mirror images, shrinkage and bones of constant length (`pipeline.core.anatomical`)."""

    def noise_variance(self, sigma2_mm2: float) -> float | None:
        """Return sigma² for approach II, nothing for approach I, which has none."""
        return sigma2_mm2 if self is Method.map else None


PUBLISHED = (Method.least_squares, Method.map)
"""The papers' own approaches: what is tried unless more is asked for."""

IMAGE_IGNORED_MM2 = 1e15
"""A noise variance at which the image says nothing: MAP gives the average walker, to rounding."""


class Baseline(StrEnum):
    """Baselines."""

    average_walker = "average_walker"
    """The depth of the average walker; the image is kept [zhang2007 3.16]."""
    least_squares_1 = "least_squares_1"
    """Approach I with one eigenwalker."""
    map_1 = "map_1"
    """Approach II with one eigenwalker."""

    def noise_variance(self, sigma2_mm2: float) -> float | None:
        """Return sigma² with which one eigenwalker is fitted."""
        of_method = Method.map.noise_variance(sigma2_mm2) if self is Baseline.map_1 else None
        return IMAGE_IGNORED_MM2 if self is Baseline.average_walker else of_method

    @staticmethod
    def beside(methods: Sequence[Method]) -> list[Baseline]:
        """Return the average walker, and one eigenwalker for each of the papers' approaches."""
        return [
            Baseline.average_walker,
            *(Baseline(f"{method}_1") for method in methods if method in PUBLISHED),
        ]


STRIP_DEG = 10.0
"""Width of a strip of view angles; the bands of frontal, oblique and profile views end on it."""


def middles_of_strips(views: Grid) -> Grid:
    """Return the middles of strips of a grid of view angles, or itself if its steps are as wide.

    Each strip weighs the same, as in the whole grid: a mean over its views and one over the middles are one quantity.

    Examples
    --------
    >>> middles_of_strips(Grid(start=-20, stop=20, step=1)).values("views")
    array([-15.,  -5.,   5.,  15.])
    """
    if views.step >= STRIP_DEG or views.stop - views.start < STRIP_DEG:
        return views
    return Grid(start=views.start + STRIP_DEG / 2, stop=views.stop - STRIP_DEG / 2, step=STRIP_DEG)
