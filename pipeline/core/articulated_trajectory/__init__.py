"""Reconstruction of a skeleton's motion from one camera, limb by limb from the root (park2011 sections 2 to 5)."""

from pipeline.core.articulated_trajectory.articulated import Articulated
from pipeline.core.articulated_trajectory.limb_choice import (
    MARGIN_OF_DOUBT,
    LimbChoice,
    choose_limb,
    select_signs,
    solved,
)
from pipeline.core.articulated_trajectory.limb_tree import LimbTree
from pipeline.core.articulated_trajectory.reconstruct import (
    Options,
    Reconstruction,
    prepared,
    reconstruct,
)
from pipeline.core.trajectory_basis import TrajectoryBasis

__all__ = [
    "MARGIN_OF_DOUBT",
    "Articulated",
    "LimbChoice",
    "LimbTree",
    "Options",
    "Reconstruction",
    "TrajectoryBasis",
    "choose_limb",
    "prepared",
    "reconstruct",
    "select_signs",
    "solved",
]
