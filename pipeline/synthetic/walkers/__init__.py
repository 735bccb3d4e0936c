"""Synthetic population of people walking on a treadmill, from body sizes, joint angles and stride timing.

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
