"""Reprojection error of a tree of limbs, and its derivatives (park2011 section 3.1, equations 4 to 7).

Symbols
-------
``X_R``    root trajectory; ``X_j`` trajectory of joint j; ``r`` length of a limb, mm
``x``      seen image of a joint, ``x_hat`` its reprojection, px
``Theta``  trajectory basis, F x K; ``a`` coefficients of a limb's two angles
``L``      limbs, one to each joint but the root, each after its parent; ``N`` unknowns of a limb, 2 K or 2 K + 1

Unknowns are (L, N): the coefficients of theta, those of phi and, where lengths are free, the logarithm of the length
over the given one.  Inside, limbs come before frames, so that everything about one limb lies together.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pipeline.core.pinhole import Pinhole
from pipeline.core.refinement import kernels
from pipeline.core.refinement.spherical import tangents, to_directions
from pipeline.core.trajectory_basis import BasisProducts, products
from pipeline.validation import InvalidInput


@dataclass(frozen=True)
class Observations:
    """Observed images of the joints, with the known quantities: cameras, root, limb lengths and trajectory basis.

    Attributes
    ----------
    images : (L, F, 2)
        Image of each limb's far end, px; zero where it was not seen.
    visible : (L, F) bool
        False also where camera or root are not known.
    projection : (F, 3, 3)
        K R.
    centre : (F, 3)
        C, mm.
    root : (F, 3)
        X_R, mm; zero where it is not known.
    parents : (L,) tuple of int
        Limb at whose far end each limb begins; -1 for the root joint.
    lengths : (L,)
        r, mm.
    charts : (L, 3, 3)
        Rotations from the world to the axes of each limb's angles.
    basis : (F, K)
        Theta.
    penalty : (L, N)
        Weight of the square of each unknown, px².
    products : BasisProducts
        Of the basis.
    """

    images: np.ndarray
    visible: np.ndarray
    projection: np.ndarray
    centre: np.ndarray
    root: np.ndarray
    parents: tuple[int, ...]
    lengths: np.ndarray
    charts: np.ndarray
    basis: np.ndarray
    penalty: np.ndarray
    products: BasisProducts

    @cached_property
    def seen_by(self) -> tuple[np.ndarray, ...]:
        """Arrays of images and cameras, in the form that the compiled loops need."""
        return self.images, self.visible, self.projection, self.centre, self.root

    @cached_property
    def carriers(self) -> np.ndarray:
        """Index of each limb's parent limb (L,), as an array for the compiled loops."""
        return np.array(self.parents)

    @cached_property
    def sums(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Weights of the sums over frames that give the gradient, the diagonal and the blocks of the second
        derivatives.

        The last column of each array is one.

        The basis (F, K + 1), its squares, and products of its columns, then the basis (F, n + K + 1).
        """
        ones = np.ones((len(self.basis), 1))
        return (
            np.hstack([self.basis, ones]),
            np.hstack([self.basis**2, ones]),
            np.hstack([self.products.columns, self.basis, ones]),
        )

    @cached_property
    def lines(self) -> np.ndarray:
        """Indices (L, M) of each limb and its ancestors, from the limb to the root, padded with -1."""
        lines: list[list[int]] = []
        for limb, parent in enumerate(self.parents):
            lines.append([limb, *(lines[parent] if parent >= 0 else [])])
        longest = max(map(len, lines))
        return np.array([line + [-1] * (longest - len(line)) for line in lines])


def observe(
    images: np.ndarray,
    camera: Pinhole,
    root: np.ndarray,
    *,
    parents: tuple[int, ...],
    lengths: np.ndarray,
    charts: np.ndarray,
    basis: np.ndarray,
    penalty: np.ndarray,
) -> Observations:
    """Prepare the images for the refinement; joints without image, camera or root count as not observed.

    Parameters
    ----------
    images : (F, L, 2)
        px; NaN where a joint was not seen.
    camera : Pinhole
        One, or one for each frame; NaN where it is not known.
    root : (F, 3)
        mm; NaN where it is not known.
    parents, lengths, charts, basis, penalty
        As in `Observations`.

    Raises
    ------
    InvalidInput
        If the camera has another number of frames.
    """
    frames = len(images)
    if camera.frames not in (None, frames):
        raise InvalidInput(
            "images and cameras have different numbers of frames",
            expected=frames,
            received=camera.frames,
            code="frames_disagree",
            frames=camera.frames,
        )
    at = np.broadcast_to(camera.known, frames)[:, None]
    rooted = np.isfinite(root).all(axis=1, keepdims=True)
    visible = np.isfinite(images).all(axis=2) & at & rooted
    return Observations(
        images=np.ascontiguousarray(np.where(visible[..., None], images, 0.0).swapaxes(0, 1)),
        visible=np.ascontiguousarray(visible.T),
        projection=np.where(at[..., None], camera.intrinsics @ camera.rotation, np.eye(3)),
        centre=np.where(at, camera.centre, 0.0),
        root=np.where(rooted, root, 0.0),
        parents=parents,
        lengths=lengths,
        charts=charts,
        basis=basis,
        penalty=penalty,
        products=products(basis),
    )


def angles(given: Observations, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the angles theta and phi (L, F), rad, of all limbs at the refinement's unknowns (L, N)."""
    components = given.basis.shape[1]
    return unknowns[:, :components] @ given.basis.T, unknowns[:, components : 2 * components] @ given.basis.T


def lengths_mm(given: Observations, unknowns: np.ndarray) -> np.ndarray:
    """Return the limb lengths (L,), mm, at the refinement's unknowns (L, N)."""
    free = unknowns[:, 2 * given.basis.shape[1] :]
    return given.lengths * np.exp(free[:, 0]) if free.size else given.lengths


def relative(given: Observations, unknowns: np.ndarray) -> np.ndarray:
    """Return the relative trajectories (L, F, 3), mm, of all limbs at the refinement's unknowns [park2011 4].

    They lie on spheres about the parent joints for any unknowns.
    """
    theta, phi = angles(given, unknowns)
    return lengths_mm(given, unknowns)[:, None, None] * to_directions(theta, phi, given.charts)


def forward(given: Observations, limbs: np.ndarray) -> np.ndarray:
    """Return joint positions (L, F, 3), mm, from the root and the relative trajectories of the limbs [park2011 6]."""
    positions = np.empty_like(limbs)
    for limb, parent in enumerate(given.parents):
        np.add(given.root if parent < 0 else positions[parent], limbs[limb], out=positions[limb])
    return positions


def behind(given: Observations, positions: np.ndarray) -> np.ndarray:
    """Return a mask (L, F) of the observed joints whose estimate is not in front of the camera."""
    depth = (given.projection[:, 2] * (positions - given.centre)).sum(axis=-1)
    return given.visible & ~(depth > 0)


def residuals(given: Observations, positions: np.ndarray) -> np.ndarray:
    """Return the reprojection errors (L, F, 2), px: reprojected minus observed image, zero without observation
    [park2011 7].

    As printed, a point behind the camera projects like one before it: `behind` tells, and is to be asked first.
    """
    image, _ = _reprojection(given, positions)
    return np.where(given.visible[..., None], image - given.images, 0.0)


def _reprojection(given: Observations, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the reprojected images (L, F, 2), px, and the depths (L, F, 1), with depth 1 for unobserved joints."""
    homogeneous = (given.projection @ (positions - given.centre)[..., None])[..., 0]
    depth = np.where(given.visible, homogeneous[..., 2], 1.0)[..., None]
    return homogeneous[..., :2] / depth, depth


def cost(given: Observations, unknowns: np.ndarray) -> float:
    """Return the refinement's cost, px²: half the sum of squared reprojection errors and penalties [park2011 5].

    Infinite if any joint that was seen stands behind its camera.
    """
    theta, phi = angles(given, unknowns)
    tree = (given.carriers, lengths_mm(given, unknowns), given.charts)
    squares = kernels.squared_distances(given.seen_by, tree, theta, phi)
    return 0.5 * (squares + (given.penalty * unknowns**2).sum())


def linearise(given: Observations, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivatives of the reprojections by joint positions, and of limb vectors by their two angles.

    Each step of `refine` has them from `kernels.frame_by_frame`, with second derivatives.

    Returns
    -------
    by_position : (L, F, 2, 3)
        By the joint's position, px per mm; zero where it was not seen.
    movement : (L, F, 2, 3)
        Of the limb by its theta and its phi, mm.
    """
    image, depth = _reprojection(given, forward(given, relative(given, unknowns)))
    by_position = given.projection[:, :2] - image[..., None] * given.projection[:, 2:]
    by_position = np.where(given.visible[..., None, None], by_position / depth[..., None], 0.0)
    lengths = lengths_mm(given, unknowns)[:, None, None, None]
    return by_position, lengths * tangents(*angles(given, unknowns), given.charts[:, None])
