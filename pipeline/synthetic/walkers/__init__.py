"""Synthetic population of walkers on a treadmill, from bodies, joint angles and strides.

`walking_population` generates all walkers, with true stature, speed and stride frequency.  `members` and `walker`
generate them one by one.
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
