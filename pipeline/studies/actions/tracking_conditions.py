"""What is tracked and under which conditions: one quantity varied at a time, performances evenly over all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

USUAL_PARTICLES = 500
"""Where particles are not what varies, if they are among those tried."""


@dataclass(frozen=True, order=True)
class Condition:
    """What one track is made of, besides performance and method."""

    particles: int
    noise_mm: float
    occluded: float

    @property
    def words(self) -> tuple[int, ...]:
        """For a seed."""
        return self.particles, round(1e3 * self.noise_mm), round(1e6 * self.occluded)


def conditions(
    particles: Sequence[int], noise_mm: Sequence[float], occluded: Sequence[float], usual_noise_mm: float
) -> list[tuple[str, Condition]]:
    """Return what is varied, and the condition, for every point of the sweep: one quantity at a time.

    Parameters
    ----------
    particles, noise_mm, occluded : sequence
        What is tried, in any order.
    usual_noise_mm : float
        Where noise is not what varies.
    """
    ordered = sorted(particles)
    usual = USUAL_PARTICLES if USUAL_PARTICLES in ordered else ordered[len(ordered) // 2]
    return [
        *(("particles", Condition(n, usual_noise_mm, 0.0)) for n in ordered),
        *(("noise", Condition(usual, v, 0.0)) for v in sorted(noise_mm)),
        *(("occlusion", Condition(usual, usual_noise_mm, v)) for v in sorted(occluded)),
    ]
