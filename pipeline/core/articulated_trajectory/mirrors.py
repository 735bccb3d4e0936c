"""Which limbs are to be mirrored, judged by the images once all limbs are refined together: beyond park2011 3.2.

The programme judges every limb alone, by what the trajectory basis leaves of its candidates.  Where a ray nearly
touches the sphere, noise of the image is multiplied in them, so that with noise the mirror is often the smoother of
the two.  The reprojection error of the refined tree is in pixels, where noise is what it is, and children bear
witness for their parents.  So mirrors are tried limb by limb, from the root to the leaves: what hangs on a mirrored
limb is chosen anew, all limbs are refined, and the mirror stays if the cost [park2011 5] falls by more than `MARGIN`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pipeline.core.articulated_trajectory.limb_choice import LimbChoice
from pipeline.core.limb_chain import Chain
from pipeline.core.refinement import Refinement
from pipeline.validation import InvalidInput

MARGIN = 1e-6
"""Fraction of the cost by which a mirror has to be better: less may be rounding."""


def better_mirrors(
    chain: Chain,
    root: np.ndarray,
    start: dict[str, LimbChoice],
    choose: Callable[[str, np.ndarray], LimbChoice],
    refine: Callable[[dict[str, LimbChoice]], Refinement],
) -> dict[str, LimbChoice]:
    """The limbs, each as it was chosen or mirrored, whichever lowers the cost of the refined tree.

    Parameters
    ----------
    chain : Chain
    root : (F, 3)
        Its trajectory, mm.
    start : dict
        A choice by the name of each limb.
    choose : callable
        From a limb and the trajectory (F, 3) of its parent to its choice.
    refine : callable
        From choices of all limbs to the refined tree; a few steps of it are enough to compare.

    Raises
    ------
    InvalidInput
        As `choose` and `refine` do for the start.

    Notes
    -----
    Only limbs in doubt are tried (`LimbChoice.undecided`), once each.  The cost as `refine` gives it never rises;
    the best of all 2^L combinations is not promised.  A limb that was mirrored already, by a hinge, stays the mirror
    of what is chosen anew where its parent is mirrored.  A second round from the root to the leaves, or more than
    ten steps to a refinement, took half as long again and changed mean errors by a few percent either way.
    """
    known: dict[tuple[str, tuple[bool, ...]], tuple[LimbChoice, LimbChoice]] = {}

    def made(mirrored: frozenset[str]) -> dict[str, LimbChoice]:
        hung = {chain.root: root}
        way: dict[str, tuple[bool, ...]] = {chain.root: ()}
        limbs: dict[str, LimbChoice] = {}
        for limb in chain.limbs:
            holder = chain.held_by(limb)
            place = (limb, way[holder])
            if place not in known:
                choice = choose(limb, hung[holder])
                known[place] = (choice, choice.mirror() if choice.undecided else choice)
            limbs[limb] = known[place][limb in mirrored]
            way[limb] = (*way[holder], limb in mirrored)
            hung[limb] = hung[holder] + limbs[limb].hits.radius * limbs[limb].directions
        return limbs

    mirrored = frozenset(limb for limb, choice in start.items() if choice.mirrored)
    best, cost = start, refine(start).cost
    for limb in chain.limbs:
        if not best[limb].undecided:
            continue
        try:
            other = made(mirrored ^ {limb})
            other_cost = refine(other).cost
        except InvalidInput:  # what hangs on the mirror would be behind the camera, say: no candidate
            continue
        if other_cost < cost * (1.0 - MARGIN):
            mirrored, best, cost = mirrored ^ {limb}, other, other_cost
    return best
