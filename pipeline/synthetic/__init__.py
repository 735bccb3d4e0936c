"""The embedded people: `walkers` on a treadmill, `bending` to the floor, `limbs` and bodies of smooth angles.

All have known answers, and none is drawn from the linear models that are to be judged by them.
"""
