"""What is tracked and under which conditions: one quantity varied at a time, performances evenly over all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.studies.actions.held_out import LEAVE_OUT
from pipeline.studies.options import TrackingSweep
from pipeline.validation import InvalidInput

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


def conditions(options: TrackingSweep) -> list[tuple[str, Condition]]:
    """What is varied, and the condition, for every point of the sweep: one quantity at a time.

    Raises
    ------
    InvalidInput
        If there is nothing to try, or it cannot be.
    """
    for name, values, good in (
        ("particles", options.particles, all(n >= 1 for n in options.particles)),
        ("noise_mm", options.noise_mm, all(0.0 <= v < np.inf for v in options.noise_mm)),
        ("occluded", options.occluded, all(0.0 <= v < 1.0 for v in options.occluded)),
        ("baseline_noise_mm", [options.baseline_noise_mm], 0.0 <= options.baseline_noise_mm < np.inf),
    ):
        if not values or len(set(values)) < len(values) or not good:
            raise InvalidInput(
                "values to be tried are none, out of range or stand twice",
                where=f"sweep.{name}",
                received=", ".join(map(str, values)) or "none",
            )
    particles = sorted(options.particles)
    usual = USUAL_PARTICLES if USUAL_PARTICLES in particles else particles[len(particles) // 2]
    noise = options.baseline_noise_mm
    return [
        *(("particles", Condition(n, noise, 0.0)) for n in particles),
        *(("noise", Condition(usual, v, 0.0)) for v in sorted(options.noise_mm)),
        *(("occlusion", Condition(usual, noise, v)) for v in sorted(options.occluded)),
    ]


def demonstrated(options: TrackingSweep) -> Condition:
    """The condition that is shown: the middle share of hidden joints."""
    of_occlusion = [condition for varied, condition in conditions(options) if varied == "occlusion"]
    return of_occlusion[len(of_occlusion) // 2]


def tracked(wanted: int, count: int) -> np.ndarray:
    """Indices of the performances that are tracked, evenly over all."""
    if wanted < 0:
        raise InvalidInput(
            "fewer performances than none",
            where="sweep.tracked",
            expected="0 for all, or more",
            received=str(wanted),
        )
    if not 0 < wanted < count:
        return np.arange(count)
    return np.unique(np.rint(np.linspace(0, count - 1, wanted)).astype(int))


def ways(leave_out: list[str], people: np.ndarray) -> tuple[list[str], list[str]]:
    """Ways of leaving out that this data has, and what is to be said of those it has not."""
    if not leave_out or not set(leave_out) <= set(LEAVE_OUT) or len(set(leave_out)) < len(leave_out):
        raise InvalidInput(
            "what is left out is unknown or stands twice",
            where="sweep.leave_out",
            expected=" or ".join(LEAVE_OUT) + ", or both",
            received=", ".join(leave_out) or "none",
        )
    if "person" not in leave_out or len(np.unique(people)) > 1:
        return list(leave_out), []
    if leave_out == ["person"]:
        raise InvalidInput(
            "one person cannot be left out", where="sweep.leave_out", expected="several people", received="1"
        )
    return ["performance"], ["tracking: one person alone, so no person is left out"]
