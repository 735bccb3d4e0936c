"""Action model: the mean performance and the standard deviation at each of its postures (mozerov2006 section 4).

`learn_action` goes all the way from postures of performances to synchronized performances and the model; `learn`
takes synchronized performances.

Symbols
-------
``M, P, b``  performances, samples (postures of a performance), dimensions of the aSpace
``m, s``     mean performance and standard deviation at each sample, (P, b); divisor M - 1
"""

from pipeline.core.action_model.bounds import BOUND, ActionModel, acceptance_left_out, accepted, learn, sample
from pipeline.core.action_model.learning import (
    LearntAction,
    by_key_frames,
    learn_action,
    mean_squared_deviation,
    variance_left,
)

__all__ = [
    "BOUND",
    "ActionModel",
    "LearntAction",
    "acceptance_left_out",
    "accepted",
    "by_key_frames",
    "learn",
    "learn_action",
    "mean_squared_deviation",
    "sample",
    "variance_left",
]
