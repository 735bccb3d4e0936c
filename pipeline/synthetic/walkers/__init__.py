"""A population of walkers on a treadmill from bodies, joint angles and strides; no positions are drawn.

`walking_population` makes it, with the true stature, speed and stride frequency of every walker; `members` and `walker`
make one after the other.
"""

from pipeline.synthetic.walkers.population import (
    LEAST_CYCLES,
    LEAST_FRAME_RATE_HZ,
    WalkingPopulation,
    members,
    walker,
    walking_population,
)

__all__ = [
    "LEAST_CYCLES",
    "LEAST_FRAME_RATE_HZ",
    "WalkingPopulation",
    "members",
    "walker",
    "walking_population",
]
