"""A population of walkers on a treadmill, made by kinematics alone: bodies, joint angles and strides, no positions.

`walking_population` draws it, with every walker's true stature, speed and stride frequency.
"""

from pipeline.synthetic.walkers.population import (
    LEAST_CYCLES,
    LEAST_FRAME_RATE_HZ,
    WalkingPopulation,
    walking_population,
)

__all__ = ["LEAST_CYCLES", "LEAST_FRAME_RATE_HZ", "WalkingPopulation", "walking_population"]
