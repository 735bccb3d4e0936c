"""Synthetic people: `walkers` on a treadmill, `bending` to the floor, `limbs` with smooth joint angles.

The ground truth of all data is known.  None are drawn from the linear models that are tested on them.
"""
