"""A skeleton as a tree of limbs, from the root to the leaves (park2011 sections 2 and 3.1).

Symbols
-------
``X``        trajectory of a joint, (F, 3) mm; ``X_R`` that of the root
``Delta X``  relative trajectory of a limb: its child's trajectory less its parent's, (F, 3) mm
``r``        length of a limb, mm

A limb is known by its child: limb ``chain.limbs.index(j)`` leads from the parent of joint j to j.  Limbs are ordered
so that each comes after the one that carries it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pipeline.skeleton import WALKER15, Skeleton
from pipeline.validation import InvalidInput, require_choice, require_shape


@dataclass(frozen=True)
class Chain:
    """Joints of a skeleton with the parent of each joint; the root is the only joint without a parent.

    Attributes
    ----------
    joints : tuple of str
        J names, in the order of arrays of positions.
    parents : tuple of str or None
        Name of each joint's parent; None for the root.

    Examples
    --------
    >>> leg = Chain(("ankle", "hip", "knee"), ("knee", None, "hip"))
    >>> leg.root, leg.limbs
    ('hip', ('knee', 'ankle'))
    """

    joints: tuple[str, ...]
    parents: tuple[str | None, ...]

    @cached_property
    def root(self) -> str:
        """Name of the joint that has no parent."""
        return self.joints[self.parents.index(None)]

    @cached_property
    def limbs(self) -> tuple[str, ...]:
        """Names of the L = J - 1 limbs, from the root to the leaves; a limb is named after its child joint."""
        order: list[str] = []
        level: set[str | None] = {None}
        while level:
            level = {
                joint for joint, parent in zip(self.joints, self.parents, strict=True) if parent in level
            }
            order += [joint for joint in self.joints if joint in level]
        return tuple(order[1:])

    @cached_property
    def ends(self) -> np.ndarray:
        """Indices (L, 2) of the parent joint and of the child joint of each limb."""
        pairs = [[self.joints.index(joint) for joint in (self.held_by(limb), limb)] for limb in self.limbs]
        return np.array(pairs, int).reshape(-1, 2)

    def held_by(self, limb: str) -> str:
        """Return the name of the parent joint of a limb.

        Raises
        ------
        InvalidInput
            If the chain has no such limb.
        """
        require_choice("limb", limb, self.limbs)
        return str(self.parents[self.joints.index(limb)])

    @cached_property
    def ways(self) -> dict[str, tuple[str, ...]]:
        """Names of the joints on the path from the root to the parent of each limb."""
        ways: dict[str, tuple[str, ...]] = {}
        for limb in self.limbs:
            holder = self.held_by(limb)
            ways[limb] = (*ways.get(holder, ()), holder)
        return ways


def chain_of(skeleton: Skeleton) -> Chain:
    """Return the kinematic chain of a skeleton."""
    parents = (None if p < 0 else skeleton.joints[p] for p in skeleton.parents)
    return Chain(skeleton.joints, tuple(parents))


WALKER14 = chain_of(WALKER15)
"""Kinematic chain of the 15-joint walker skeleton: fourteen limbs from the pelvis to the ankles, head and wrists."""


def relative_trajectories(chain: Chain, positions: np.ndarray) -> np.ndarray:
    """Return the position (F, L, 3), mm, of each limb's child joint relative to its parent joint [park2011 1, 3].

    The series of x, y and z [park2011 1] are the last axis; their squares sum to r^2 where a limb keeps its length.

    Parameters
    ----------
    chain : Chain
    positions : (F, J, 3)
        World, mm; NaN where a joint is not known.

    Raises
    ------
    InvalidInput
        If the positions are not of the chain's joints.
    """
    positions = require_shape("positions", np.asarray(positions, float), ("F", len(chain.joints), 3))
    parent, child = chain.ends.T
    return positions[:, child] - positions[:, parent]


def forward(chain: Chain, root: np.ndarray, relative: np.ndarray) -> np.ndarray:
    """Return all joint positions (F, J, 3), mm, from the root trajectory and relative limb trajectories [park2011 6].

    Printed, the arguments of f end at limb j - 1; joint j is reached by the limbs up to its own.

    Parameters
    ----------
    chain : Chain
    root : (F, 3)
        X_R, world, mm.
    relative : (F, L, 3)
        From the root to the leaves, mm; what is NaN makes all that it carries NaN.

    Raises
    ------
    InvalidInput
        If the shapes do not fit.
    """
    root = require_shape("root", np.asarray(root, float), ("F", 3))
    relative = require_shape("relative trajectories", relative, (len(root), len(chain.limbs), 3))
    positions = np.empty((len(root), len(chain.joints), 3))
    positions[:, chain.joints.index(chain.root)] = root
    for limb, (parent, child) in enumerate(chain.ends):
        positions[:, child] = positions[:, parent] + relative[:, limb]
    return positions


def true_lengths(chain: Chain, positions: np.ndarray) -> np.ndarray:
    """Return the limb lengths (L,), mm, averaged over the frames in which both joints are known [park2011 3].

    Parameters
    ----------
    chain : Chain
    positions : (F, J, 3)
        Ground truth, mm.

    Raises
    ------
    InvalidInput
        If a limb is known in no frame.
    """
    lengths = np.linalg.norm(relative_trajectories(chain, positions), axis=-1)
    finite = np.isfinite(lengths)
    if not finite.any(axis=0).all():
        limb = chain.limbs[int(finite.any(axis=0).argmin())]
        raise InvalidInput(
            f"the length of limb {limb!r} is unknown, because no frame has both of its joints",
            code="unknown_length",
            limb=limb,
        )
    return np.where(finite, lengths, 0.0).sum(axis=0) / finite.sum(axis=0)
