"""Reconstruction of a skeleton's motion from one camera, limb by limb from the root (park2011 sections 2 to 5).

Each limb in turn is chosen among its candidates and becomes angles in the trajectory basis (`limb_choice`); its end,
in the basis, is then the parent of the next limb (`limb_tree`).  In the end all limbs are refined together
(`refinement`).

Symbols
-------
``X_R``  trajectory of the root, given
``J``    what the trajectory basis leaves of a choice; its mirror has its own, and ``margin`` is their ratio
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from pipeline.core import refinement
from pipeline.core.articulated_trajectory.articulated import Articulated
from pipeline.core.articulated_trajectory.hinges import HINGES, resolve_mirrors
from pipeline.core.articulated_trajectory.limb_choice import LimbChoice, choose_limb
from pipeline.core.articulated_trajectory.limb_tree import LimbTree
from pipeline.core.articulated_trajectory.mirrors import better_mirrors
from pipeline.core.articulation import Adjustment
from pipeline.core.limb_chain import WALKER14, Chain
from pipeline.core.limb_chain.lengths import length_from_rays
from pipeline.core.pinhole import Pinhole, project_by_matrix
from pipeline.core.refinement import Refinement, RefinementOptions
from pipeline.core.refinement.inputs import starting_path
from pipeline.core.refinement.spherical import SphericalTrajectory
from pipeline.core.trajectory_basis import TrajectoryBasis, cosine_basis
from pipeline.shortened import shortened
from pipeline.validation import InvalidInput, require_range, require_shape

Place = tuple[str, tuple[bool, ...]]
"""Key of a cached limb reconstruction: the limb, and which limbs between the root and this limb are mirrored."""

COMPARING = 10
"""Number of refinement steps in a comparison of mirror images; more steps rarely change the outcome."""

MOST_STEPS = 500
"""Largest number of steps of the final refinement; most refinements need only 20 to 50 steps."""


@dataclass(frozen=True)
class Options:
    """Options for the reconstruction of a skeleton's motion.

    Attributes
    ----------
    basis : TrajectoryBasis or None
        Of the trajectories; None: `TrajectoryBasis.of_clip`, for which the frame rate must be known.
    adjust : Adjustment
        As for `articulation.ray_sphere`.
    noise_px : float
        As for `choose_limb`.
    use_hinges : bool
        Where the data cannot tell a limb from its mirror, take the one with which knees and elbows flex as they do.
    try_mirrors : bool
        Take the mirror of a limb in doubt where all limbs refined together then fit their images better
        (`mirrors`): a refinement for each limb, and beyond the paper.
    refine : bool
        Whether reprojection errors are refined in the end.
    time_limit_s : float
        Nominal seconds for the certificate of each limb, as for `binary_quadratic.minimise`.
    """

    basis: TrajectoryBasis | None = None
    adjust: Adjustment = Adjustment.per_frame
    noise_px: float = 0.0
    use_hinges: bool = False
    try_mirrors: bool = False
    refine: bool = True
    time_limit_s: float = 0.5

    def of_each_limb(self) -> Options:
        """Return a copy of the options for independent limbs: no hinges, no mirror images, no refinement."""
        return replace(self, use_hinges=False, try_mirrors=False, refine=False)


def reconstruct(
    images: np.ndarray,
    camera: Pinhole,
    root: np.ndarray,
    lengths: np.ndarray,
    options: Options | None = None,
    *,
    chain: Chain = WALKER14,
    frame_rate_hz: float | None = None,
) -> Articulated:
    """Reconstruct the 3D motion of a skeleton from images, the root's trajectory and the cameras [park2011 5, 6].

    Parameters
    ----------
    images : (F, J, 2)
        px, in the order of the chain's joints; NaN where a joint was not seen.
    camera : Pinhole
        One, or one for each frame.
    root : (F, 3)
        X_R, mm.
    lengths : (L,)
        Of the limbs in the order of ``chain.limbs``, mm; NaN: as `limb_chain.lengths.length_from_rays` says.
    options : Options, optional
    chain : Chain
    frame_rate_hz : float, optional
        Of the clip, for the number of cosines; not used if the options have a basis.

    Raises
    ------
    InvalidInput
        If shapes disagree, neither a basis nor the frame rate is known, or a limb, which is named, cannot be
        reconstructed or is missed by all rays twofold.

    Notes
    -----
    It warns, with the number, if the residual of a joint is above `MAX_RESIDUAL_PX`, or if the images would fit better
    upside down, for which they are reconstructed once more, without certificates.
    """
    inputs = prepared(images, camera, root, lengths, options, chain=chain, frame_rate_hz=frame_rate_hz)
    skeleton = inputs.whole()
    for doubt in skeleton.doubts(inputs.upside_down()):
        warnings.warn(doubt, stacklevel=2)
    return skeleton


def prepared(
    images: np.ndarray,
    camera: Pinhole,
    root: np.ndarray,
    lengths: np.ndarray,
    options: Options | None = None,
    *,
    chain: Chain = WALKER14,
    frame_rate_hz: float | None = None,
) -> Reconstruction:
    """Check the inputs for the reconstruction of a skeleton, and return them as a `Reconstruction`.

    `Reconstruction.under` changes the options and keeps the choices that still apply.

    Parameters and exceptions are those of `reconstruct`.
    """
    images, root, lengths = (np.asarray(value, float) for value in (images, root, lengths))
    require_shape("images", images, ("F", len(chain.joints), 2))
    require_range("frames", len(images), at_least=3)
    if not isinstance(camera, Pinhole):
        raise InvalidInput(
            "must be a Pinhole camera",
            "camera",
            "intrinsics, rotation, centre",
            type(camera).__name__,
            code="wrong_type",
        )
    if camera.frames not in (None, len(images)):
        raise InvalidInput(
            "must be one camera for the whole clip, or one for each frame",
            "camera",
            received=camera.frames,
            code="frames_disagree",
            frames=camera.frames,
        )
    require_shape("root", root, (len(images), 3))
    require_shape("lengths", lengths, (len(chain.limbs),))
    options = options or Options()
    if options.basis is None:
        if frame_rate_hz is None:
            raise InvalidInput(
                "cannot choose the number of cosines without a frame rate or a basis",
                "frame_rate_hz",
                "the clip's frame rate, or Options(basis=TrajectoryBasis(n))",
                "neither",
                code="no_frame_rate",
            )
        options = replace(options, basis=TrajectoryBasis.of_clip(len(images), frame_rate_hz))
    return Reconstruction(images, camera, root, lengths, chain, options)


@shortened
class Reconstruction:
    """Inputs and options for the reconstruction of a skeleton, with cached solutions of its limbs.

    Attributes
    ----------
    images : (F, J, 2)
    camera : Pinhole
    root : (F, 3)
    lengths : (L,)
    chain : Chain
    options : Options
    known : dict
        Choices that have been made, by the limb and by whether each limb on the way to it is mirrored, where all
        lengths were given and nothing else enters.
    starts : dict
        Of the refinement, by the choice (its id, with itself, so that it stays).
    """

    images: np.ndarray
    camera: Pinhole
    root: np.ndarray
    lengths: np.ndarray
    chain: Chain
    options: Options
    choices: dict[Place, LimbChoice] = field(default_factory=dict)
    starts: dict[int, tuple[LimbChoice, SphericalTrajectory]] = field(default_factory=dict)

    def under(self, options: Options) -> Reconstruction:
        """Return the reconstruction with other options; cached limb solutions that remain valid are reused."""
        if options.of_each_limb() == self.options.of_each_limb():
            return replace(self, options=options)
        return replace(self, options=options, choices={}, starts={})

    def with_lengths(self, lengths: np.ndarray) -> Reconstruction:
        """Return the reconstruction with other limb lengths (L,), mm."""
        if np.array_equal(lengths, self.lengths):
            return self
        return replace(self, lengths=lengths, choices={}, starts={})

    @property
    def _basis(self) -> TrajectoryBasis:
        assert self.options.basis is not None, "chosen by `prepared`"
        return self.options.basis

    @cached_property
    def _cameras(self) -> np.ndarray:
        return self.camera.matrix

    def whole(self) -> Articulated:
        """Reconstruct all limbs of the skeleton, and refine them together if the options request it."""
        tree = self.chosen()
        if self.options.try_mirrors:
            # What was read off the rays stays as it is, or trees would be compared that have not the same unknowns.
            fixed = self.with_lengths(np.where(np.isnan(self.lengths), tree.lengths, self.lengths))
            tree = better_mirrors(tree, fixed.choose, lambda other: fixed.refined(other, COMPARING).cost)
        limbs = {limb: tree.choices[limb] for limb in self.chain.limbs}
        chosen, imputed = tree.positions, tree.imputed
        if not self.options.refine:
            ends = np.stack([tree.end(joint) for joint in self.chain.joints], axis=1)
            return Articulated(
                chosen, chosen, imputed, limbs, tree.lengths, None, self._reprojection_px(ends)
            )
        refined = self.refined(tree, MOST_STEPS)
        positions = np.empty_like(chosen)
        positions[:, self._order] = refined.positions
        distances = self._reprojection_px(positions)
        return Articulated(positions, chosen, imputed, limbs, refined.lengths, refined, distances)

    def _reprojection_px(self, positions: np.ndarray) -> dict[str, np.ndarray]:
        distances = np.linalg.norm(project_by_matrix(self._cameras, positions) - self.images, axis=-1)
        return dict(zip(self.chain.joints, distances.T, strict=True))

    def upside_down(self) -> dict[str, np.ndarray]:
        """Return the reprojection errors, px, of a skeleton that is reconstructed from the vertically flipped images.

        They are infinite if there is no solution.

        The images are turned over about the row at which the root's images agree best with the root.
        """
        images, middle = (
            self.images.copy(),
            np.broadcast_to(self.camera.intrinsics[..., 1, 2], len(self.images)),
        )
        root = self.images[:, self.chain.joints.index(self.chain.root), 1]
        off = 0.5 * (project_by_matrix(self._cameras, self.root)[:, 1] + root) - middle
        off = off[np.isfinite(off)]
        images[..., 1] = 2.0 * (middle + (off.mean() if off.size else 0.0))[:, None] - images[..., 1]
        options = replace(self.options, try_mirrors=False, time_limit_s=0.0)
        try:
            return (
                replace(self, images=images, options=options, choices={}, starts={}).whole().reprojection_px
            )
        except InvalidInput:
            return {self.chain.root: np.array([np.inf])}

    def chosen(self) -> LimbTree:
        """Return the reconstructions of all limbs, computed one by one from the root to the leaves."""
        tree = LimbTree(self.chain, self.root)
        for limb in self.chain.limbs:
            tree = tree.placed(limb, self.choose(tree, limb))
            if self.options.use_hinges:
                for hinge in HINGES:
                    if hinge.lower == limb and hinge.fits(self.chain):
                        tree = resolve_mirrors(hinge, tree, self.choose)
        return tree

    def choose(self, tree: LimbTree, limb: str) -> LimbChoice:
        """Return the reconstruction of a limb whose parent limb is already reconstructed."""
        way = self.chain.ways[limb][1:]
        branch = (limb, tuple(tree.choices[joint].mirrored for joint in way))
        if np.isnan(self.lengths).any():
            return self._choose(tree, limb)
        if branch not in self.choices:
            self.choices[branch] = self._choose(tree, limb)
        return self.choices[branch]

    def _choose(self, tree: LimbTree, limb: str) -> LimbChoice:
        options = self.options
        try:
            length = self._length(tree, limb)
            choice = choose_limb(
                self._cameras,
                self._seen(limb),
                tree.end(self.chain.held_by(limb)),
                length,
                basis=self._basis,
                adjust=options.adjust,
                noise_px=options.noise_px,
                time_limit_s=options.time_limit_s,
            )
            nearest = np.linalg.norm(choice.hits.middle[choice.used], axis=1).min()
            if nearest > 2.0 * length > 0.0:
                raise InvalidInput(
                    "all image rays pass the limb's parent joint at more than twice the limb length",
                    expected="length, root and camera centres in one unit",
                    received=f"a length of {length:g}, a smallest distance of {nearest:g}",
                    code="rays_miss_limb",
                )
            return choice
        except InvalidInput as refusal:
            raise InvalidInput(
                refusal.what,
                f"limb {limb}" + (f", {refusal.where}" if refusal.where else ""),
                refusal.expected,
                refusal.received,
                code=refusal.code,
                **refusal.values,
            ) from None

    def refined(self, tree: LimbTree, max_iterations: int) -> Refinement:
        """Refine all limbs of a skeleton together by their reprojection error."""
        names = (self.chain.root, *self.chain.limbs)
        basis = self._basis
        rows = cosine_basis(len(self.images), basis.components)
        paths = []
        for limb in self.chain.limbs:
            choice = tree.choices[limb]
            if id(choice) not in self.starts:
                path = starting_path(choice.directions, rows, cutoff=basis.cutoff, called=limb)
                self.starts[id(choice)] = choice, path
            paths.append(self.starts[id(choice)][1])
        return refinement.refine(
            self.images[:, self._order],
            self.camera,
            self.root,
            [-1, *(names.index(self.chain.held_by(limb)) for limb in self.chain.limbs)],
            paths,
            tree.lengths,
            basis=rows,
            options=RefinementOptions(cutoff=basis.cutoff, max_iterations=max_iterations),
            names=names,
        )

    @property
    def _order(self) -> list[int]:
        """Indices, in the chain's list of joints, of the root and of the end of each limb."""
        return [self.chain.joints.index(name) for name in (self.chain.root, *self.chain.limbs)]

    def _seen(self, limb: str) -> np.ndarray:
        return self.images[:, self.chain.joints.index(limb)]

    def _length(self, tree: LimbTree, limb: str) -> float:
        """Return the length of a limb, mm: the given length, or an estimate from the image rays if it is NaN."""
        lengths = dict(zip(self.chain.limbs, self.lengths, strict=True))
        if not np.isnan(lengths[limb]):
            return lengths[limb]
        unknown = [name for name, length in lengths.items() if np.isnan(length)]
        parents = {name: tree.end(self.chain.held_by(name)) for name in unknown}
        return length_from_rays(self._cameras, {name: self._seen(name) for name in unknown}, parents, limb)
