"""A population of walkers on a treadmill from bodies, joint angles and strides; no positions are drawn.

`walking_population` makes it, with the true stature, speed and stride frequency of every walker; `members` and `walker`
make one after the other.
"""

from pipeline.synthetic.walkers.population import (
    WalkingPopulation,
    members,
    walker,
    walking_population,
)

__all__ = [
    "WalkingPopulation",
    "members",
    "walker",
    "walking_population",
]
