"""Reconstruction of a 3D walk, with error bars, from the 2D keypoints of one camera.

Order of use: `train` learns the model of walkers, `prepare` adds a detector, `reconstruct` fits keypoints.

Symbols are explained at the head of each module.
"""

from walk3d.film.walk.posterior import Posterior
from walk3d.film.walk.prior import Detector, Prior, prepare
from walk3d.film.walk.reconstruction import (
    Candidate,
    Fitting,
    Reconstruction,
    reconstruct,
    reconstruct_followed,
)
from walk3d.film.walk.training import (
    HARMONICS,
    HEIGHT_MM,
    CompactMoments,
    Moments,
    TrainingWalk,
    WalkerModel,
    compact,
    expand,
    model_of,
    moments,
    train,
    training_walk,
)
from walk3d.film.walk.view import view_angle_deg

__all__ = [
    "HARMONICS",
    "HEIGHT_MM",
    "Candidate",
    "CompactMoments",
    "Detector",
    "Fitting",
    "Moments",
    "Posterior",
    "Prior",
    "Reconstruction",
    "TrainingWalk",
    "WalkerModel",
    "compact",
    "expand",
    "model_of",
    "moments",
    "prepare",
    "reconstruct",
    "reconstruct_followed",
    "train",
    "training_walk",
    "view_angle_deg",
]
