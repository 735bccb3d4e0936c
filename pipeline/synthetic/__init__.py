"""Synthetic people: walkers on a treadmill, people bending to the floor, and limbs with smooth joint angles.

The ground truth of all data is known.  None are drawn from the linear models that are tested on them.
"""
