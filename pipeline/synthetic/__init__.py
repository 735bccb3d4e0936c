"""Synthetic people: `walkers` on a treadmill, `bending` to the floor, `limbs` and bodies with smooth joint angles.

All have known answers, and none is drawn from the linear models that are tested on them.
"""
