"""Under which conditions a performance is tracked."""

from __future__ import annotations

from dataclasses import dataclass


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
