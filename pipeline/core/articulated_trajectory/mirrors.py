"""Choice between limbs and their mirror images by the reprojection error of the whole skeleton (beyond park2011 3.2).

The programme judges every limb alone, by what the trajectory basis leaves of its candidates.  Where a ray nearly
touches the sphere, noise of the image is multiplied in them, so that with noise the mirror is often the smoother of
the two.  The reprojection error of the refined tree is in pixels, where noise is what it is, and the fit of a child
also constrains its parent.  So mirrors are tried limb by limb, from the root to the leaves: what a mirrored limb
carries is chosen anew, all limbs are refined, and the mirror stays if the cost [park2011 5] falls.
"""

from __future__ import annotations

from collections.abc import Callable

from pipeline.core.articulated_trajectory.limb_choice import LimbChoice
from pipeline.core.articulated_trajectory.limb_tree import LimbTree
from pipeline.validation import InvalidInput

MARGIN = 1e-6
"""Relative cost reduction, beyond rounding error, that is needed to accept the mirror image of a limb."""


def better_mirrors(
    start: LimbTree,
    choose: Callable[[LimbTree, str], LimbChoice],
    cost: Callable[[LimbTree], float],
) -> LimbTree:
    """Return the skeleton in which a limb is mirrored in depth wherever this reduces the cost after refinement.

    Parameters
    ----------
    start : LimbTree
        All limbs.
    choose : callable
        From a tree and a limb whose parent it has to the limb's choice.
    cost : callable
        Of a tree of all limbs once it is refined; a few steps of that are enough to compare.

    Raises
    ------
    InvalidInput
        As `choose` and `cost` do for the start.

    Notes
    -----
    Only limbs in doubt are tried (`LimbChoice.undecided`), once each.  The cost never rises;
    the best of all 2^L combinations is not promised.  A limb that was mirrored already, by a hinge, stays the mirror
    of what is chosen anew where its parent is mirrored.  A second round from the root to the leaves, or more than
    ten steps to a refinement, took half as long again and changed mean errors by a few percent either way.
    """
    mirrored = frozenset(limb for limb, choice in start.choices.items() if choice.mirrored)
    best, least = start, cost(start)
    for limb in start.chain.limbs:
        if not best.choices[limb].undecided:
            continue
        try:
            other = _chosen_anew(start, mirrored ^ {limb}, choose)
            other_cost = cost(other)
        except InvalidInput:  # what a mirror carries would be behind the camera, say: no candidate
            continue
        if other_cost < least * (1.0 - MARGIN):
            mirrored, best, least = mirrored ^ {limb}, other, other_cost
    return best


def _chosen_anew(
    start: LimbTree, mirrored: frozenset[str], choose: Callable[[LimbTree, str], LimbChoice]
) -> LimbTree:
    """Reconstruct all limbs again, from the root outwards, with a given set of limbs mirrored in depth."""
    tree = LimbTree(start.chain, start.root)
    for limb in start.chain.limbs:
        choice = choose(tree, limb)
        tree = tree.placed(limb, choice.mirror if limb in mirrored and choice.undecided else choice)
    return tree
