"""A population of walkers on a treadmill, made by kinematics alone."""

from pipeline.synthetic.walkers.population import (
    LEAST_CYCLES,
    LEAST_FRAME_RATE_HZ,
    WalkingPopulation,
    walking_population,
)

__all__ = ["LEAST_CYCLES", "LEAST_FRAME_RATE_HZ", "WalkingPopulation", "walking_population"]
