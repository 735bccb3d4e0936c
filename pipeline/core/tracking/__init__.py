"""Particle filter that uses the action model as prior, the application in mozerov2006 sections 1 and 4.

`track` follows one performance from its 2D image: `Dynamics` predict postures along the action model and prune those
outside of its bounds, a `Likelihood` weighs them by the image; both go through the compiled loops of `kernels`.  The
remaining functions give the errors of a track, and those of the mean performance alone.

Symbols
-------
``p, v``     phase, the position along the mean performance in samples, and its rate, samples per frame
``z``        deviation from the mean performance, in units of the model's standard deviation
``L, w``     likelihood of a particle and its weight
"""

from pipeline.core.tracking.errors import best_phase, joint_error
from pipeline.core.tracking.filter import Track, track
from pipeline.core.tracking.likelihood import Likelihood
from pipeline.core.tracking.prediction import Dynamics, learnt_diffusion

__all__ = [
    "Dynamics",
    "Likelihood",
    "Track",
    "best_phase",
    "joint_error",
    "learnt_diffusion",
    "track",
]
