"""A skeleton as a tree of limbs, from the root to the leaves (park2011 sections 2 and 3.1)."""

from pipeline.core.limb_chain.chain import (
    WALKER14,
    Chain,
    forward,
    relative_trajectories,
    true_lengths,
)

__all__ = ["WALKER14", "Chain", "forward", "relative_trajectories", "true_lengths"]
