"""A whole skeleton from one camera, from the root to the leaves: park2011 sections 2 to 5 in one piece.

Each limb in turn is chosen among its candidates and becomes angles in the trajectory basis (`limb_choice`); its end,
in the basis, is then the parent of the next limb.  In the end all limbs are refined together (`refinement`).

Symbols
-------
``X_R``  trajectory of the root, given
``J``    what the trajectory basis leaves of a choice; its mirror has its own, and ``margin`` is their ratio
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core import refinement
from pipeline.core.articulated_trajectory import hinges
from pipeline.core.articulated_trajectory.limb_choice import (
    MARGIN_OF_DOUBT,
    LimbChoice,
    Smoothness,
    SmoothnessByRule,
    choose_limb,
    taken,
)
from pipeline.core.articulated_trajectory.mirrors import better_mirrors
from pipeline.core.articulation import Adjustment
from pipeline.core.limb_chain import WALKER14, Chain
from pipeline.core.limb_chain.lengths import length_from_rays
from pipeline.core.pinhole import Pinhole
from pipeline.core.refinement import Refinement
from pipeline.core.trajectory_basis import cosine_basis
from pipeline.validation import InvalidInput

__all__ = [
    "MARGIN_OF_DOUBT",
    "Articulated",
    "LimbChoice",
    "Smoothness",
    "SmoothnessByRule",
    "choose_limb",
    "reconstruct",
    "taken",
]

COMPARING = 10
"""Steps of the refinement by which mirrors are compared: more seldom change which is better."""


@dataclass(frozen=True)
class Articulated:
    """A skeleton's motion from its images.

    Attributes
    ----------
    positions : (F, J, 3)
        mm, in the order of the chain's joints.
    chosen : (F, J, 3)
        Before the refinement of all limbs together: each limb on its own.
    imputed : (F, J) bool
        Where the joint was not seen, or no candidate was in front of the camera.
    limbs : dict
        A `LimbChoice` by the name of each limb.
    lengths : (L,)
        mm, in the order of ``chain.limbs``.
    refined : Refinement or None
        With the root first and the limbs after it; None if it was not asked for.
    """

    positions: np.ndarray
    chosen: np.ndarray
    imputed: np.ndarray
    limbs: dict[str, LimbChoice]
    lengths: np.ndarray
    refined: Refinement | None


def reconstruct(
    images: np.ndarray,
    camera: Pinhole,
    root: np.ndarray,
    lengths: np.ndarray,
    *,
    chain: Chain = WALKER14,
    smoothness: Smoothness | SmoothnessByRule | None = None,
    adjust: Adjustment = "per_frame",
    noise_px: float = 0.0,
    use_hinges: bool = False,
    try_mirrors: bool = False,
    refine: bool = True,
    max_iterations: int = 500,
    free_lengths: bool = False,
    loss: str = "squared",
    scale_px: float = 1.0,
    time_limit_s: float = 0.5,
) -> Articulated:
    """3D motion of a whole skeleton from its images, the root's trajectory and the cameras [park2011 5, 6].

    Parameters
    ----------
    images : (F, J, 2)
        px, in the order of the chain's joints; NaN where a joint was not seen.
    camera : Pinhole
        One, or one for each frame.
    root : (F, 3)
        X_R, mm.
    lengths : (L,)
        Of the limbs in the order of ``chain.limbs``, mm; NaN: as `limb_lengths.length_from_rays` says.
    chain : Chain
    smoothness : Smoothness or SmoothnessByRule, optional
        Of the trajectories; 20 cosines by default.  Each limb keeps its own K.
    adjust : {"per_frame", "global", "robust"}
        As for `articulation.ray_sphere`.
    noise_px : float
        As for `choose_limb`.
    use_hinges : bool
        Where the data cannot tell a limb from its mirror, take the one with which knees and elbows flex as they do.
    try_mirrors : bool
        Take the mirror of a limb in doubt where all limbs refined together then fit their images better
        (`mirror_search`): a refinement for each limb, and beyond the paper.
    refine : bool
        Whether reprojection errors are refined in the end.
    max_iterations : int
        Steps of the refinement to try.
    free_lengths : bool
        Whether lengths are refined too.
    loss : {"squared", "huber", "cauchy"}
        Of the reprojection error, with `scale_px`.
    scale_px : float
        As for `refinement.refine`.
    time_limit_s : float
        For the certificate of each limb.

    Raises
    ------
    InvalidInput
        If shapes disagree, or a limb cannot be reconstructed, naming it.
    """
    smoothness = smoothness or Smoothness()
    images, root, lengths = (np.asarray(value, dtype=float) for value in (images, root, lengths))
    _check_shapes(images, camera, root, lengths, chain)
    cameras = camera.matrix
    chosen = np.full((*images.shape[:2], 3), np.nan)
    hung = chosen.copy()  # what children hang on: smoother than the candidates themselves
    chosen[:, chain.joints.index(chain.root)] = hung[:, chain.joints.index(chain.root)] = root
    limbs: dict[str, LimbChoice] = {}

    def place(limb: str, choice: LimbChoice) -> None:
        parent, child = chain.joints.index(chain.held_by(limb)), chain.joints.index(limb)
        limbs[limb] = choice
        chosen[:, child] = hung[:, parent] + choice.relative
        hung[:, child] = hung[:, parent] + choice.hits.radius * choice.directions

    # Parents are looked up when a length is asked for: those on the way to the leaves are known by then.
    unknown = [limb for limb in chain.limbs if np.isnan(lengths[chain.limbs.index(limb)])]
    seen = {limb: images[:, chain.joints.index(limb)] for limb in unknown}
    settled: dict[str, Smoothness] = {}
    holders = {limb: hung[:, chain.joints.index(chain.held_by(limb))] for limb in unknown}

    def choose(limb: str, parents: np.ndarray) -> LimbChoice:
        try:
            return choose_limb(
                cameras,
                images[:, chain.joints.index(limb)],
                parents,
                length_from_rays(cameras, seen, {**holders, limb: parents}, limb)
                if limb in seen
                else float(lengths[chain.limbs.index(limb)]),
                smoothness=settled.get(limb, smoothness),
                adjust=adjust,
                noise_px=noise_px,
                time_limit_s=time_limit_s,
            )
        except InvalidInput as refusal:
            raise InvalidInput(
                refusal.what,
                where=f"limb {limb}" + (f", {refusal.where}" if refusal.where else ""),
                expected=refusal.expected,
                received=refusal.received,
            ) from None

    for limb in chain.limbs:
        parent = chain.joints.index(chain.held_by(limb))
        place(limb, choose(limb, hung[:, parent]))
        if use_hinges:
            for hinge in hinges.HINGES:
                if hinge.lower == limb and hinge.fits(chain):
                    hinges.settle(hinge, limbs, hung, chain, choose, place)
    order = [chain.joints.index(name) for name in (chain.root, *chain.limbs)]

    def refined_tree(limbs: dict[str, LimbChoice], steps: int) -> Refinement:
        bases = [limbs[limb].smoothness for limb in chain.limbs]
        return refinement.refine(
            images[:, order],
            camera,
            root,
            [-1, *(order.index(chain.joints.index(chain.held_by(limb))) for limb in chain.limbs)],
            np.stack([limbs[limb].directions for limb in chain.limbs], axis=1),
            np.array([limbs[limb].hits.radius for limb in chain.limbs]),
            basis=cosine_basis(len(images), max(basis.components for basis in bases)),
            cutoff=bases[0].cutoff,
            components=[basis.components for basis in bases],
            max_iterations=steps,
            free_lengths=free_lengths,
            loss=loss,
            scale_px=scale_px,
            names=(chain.root, *chain.limbs),
        )

    if try_mirrors:
        # What was read off the rays stays as it is, or trees would be compared that have not the same unknowns.
        lengths = np.where(np.isnan(lengths), [limbs[limb].hits.radius for limb in chain.limbs], lengths)
        seen.clear()
        settled |= {limb: choice.smoothness for limb, choice in limbs.items()}
        better = better_mirrors(chain, root, dict(limbs), choose, lambda tree: refined_tree(tree, COMPARING))
        for limb in chain.limbs:
            place(limb, better[limb])
    imputed = np.zeros(images.shape[:2], dtype=bool)
    for limb, choice in limbs.items():
        imputed[:, chain.joints.index(limb)] = ~choice.used
    if not refine:
        radii = np.array([limbs[limb].hits.radius for limb in chain.limbs])
        return Articulated(chosen, chosen, imputed, limbs, radii, None)
    refined = refined_tree(limbs, max_iterations)
    positions = np.empty_like(chosen)
    positions[:, order] = refined.positions
    return Articulated(positions, chosen, imputed, limbs, refined.lengths, refined)


def _check_shapes(
    images: np.ndarray, camera: Pinhole, root: np.ndarray, lengths: np.ndarray, chain: Chain
) -> None:
    joints = len(chain.joints)
    if images.ndim != 3 or images.shape[1:] != (joints, 2):
        raise InvalidInput(
            "the images are not of the chain's joints",
            expected=f"(F, {joints}, 2)",
            received=str(images.shape),
        )
    frames = len(images)
    if frames < 3:
        raise InvalidInput("too few frames for a trajectory", expected="3 or more", received=str(frames))
    if camera.frames not in (None, frames):
        raise InvalidInput(
            "images and camera differ in frames",
            expected=f"a camera of {frames}",
            received=str(camera.frames),
        )
    if root.shape != (frames, 3):
        raise InvalidInput(
            "the trajectory of the root has the wrong shape",
            expected=f"({frames}, 3)",
            received=str(root.shape),
        )
    if lengths.shape != (len(chain.limbs),):
        raise InvalidInput(
            "there is not one length to each limb",
            expected=f"({len(chain.limbs)},)",
            received=str(lengths.shape),
        )
