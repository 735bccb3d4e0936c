"""A whole skeleton from one camera, from the root to the leaves: park2011 sections 2 to 5 in one piece."""

from pipeline.core.articulated_trajectory.tree import (
    COMPARING,
    MARGIN_OF_DOUBT,
    Articulated,
    LimbChoice,
    Smoothness,
    SmoothnessByRule,
    choose_limb,
    reconstruct,
    taken,
)

__all__ = [
    "COMPARING",
    "MARGIN_OF_DOUBT",
    "Articulated",
    "LimbChoice",
    "Smoothness",
    "SmoothnessByRule",
    "choose_limb",
    "reconstruct",
    "taken",
]
