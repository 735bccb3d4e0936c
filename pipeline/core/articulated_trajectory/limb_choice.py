"""Reconstruction of one limb from one camera: the smoothest trajectory that fits the images and the limb length.

park2011 section 3.2 for one limb whose parent's trajectory is known: rays meet the sphere about the parent
(`articulation`), the programme chooses among the candidates (`binary_quadratic`), and the choice becomes angles in
the trajectory basis (`spherical`), which say where the limb was when it was not seen.

Symbols
-------
``K``    number of cosines of the trajectory basis
``chi``  relative directions that were chosen; missing frames are imputed on the sphere
``J``    what the trajectory basis leaves of them; a mirror has its own, and ``margin`` is their ratio
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from pipeline.core.articulation import Adjustment, RayHits, ray_sphere
from pipeline.core.binary_quadratic.solve import BinarySolution, minimise
from pipeline.core.limb_chain.lengths import FORGIVING
from pipeline.core.reconstructibility import MARGIN_GREEN_ABOVE
from pipeline.core.refinement import spherical
from pipeline.core.trajectory_basis import TrajectoryBasis, cosine_basis
from pipeline.shortened import shortened
from pipeline.validation import require_range

MARGIN_OF_DOUBT = MARGIN_GREEN_ABOVE
"""A limb counts as ambiguous if the cost of its mirror image is less than this multiple of the best cost."""


@shortened
class LimbChoice:
    """Reconstruction of one limb, with measures of its reliability.

    Attributes
    ----------
    hits : RayHits
        Candidates, forced frames resolved.
    solution : BinarySolution
        Of the frames that were used.
    used : (F,) bool
    signs : (F,) int
        That were selected, 0 in frames that were not used.
    mirrored : bool
        Whether they are the mirror's.
    chosen : (F, 3)
        The candidates of these signs, mm; any point of the ray in frames that were not used.
    basis : TrajectoryBasis
    """

    hits: RayHits
    solution: BinarySolution
    used: np.ndarray
    signs: np.ndarray
    mirrored: bool
    chosen: np.ndarray
    basis: TrajectoryBasis

    @cached_property
    def relative(self) -> np.ndarray:
        """Trajectory (F, 3), mm, of the joint relative to its parent.

        It is the chosen candidate in frames that were used, and a point imputed on the sphere in other
        frames.
        """
        if self.used.all() and self._turning.any():
            return self.chosen
        return np.where(
            (self.used & self._turning.any())[:, None], self.chosen, self.hits.radius * self.directions
        )

    @cached_property
    def directions(self) -> np.ndarray:
        """Unit vectors (F, 3) from the parent to the joint, smoothed by the trajectory basis.

        Child limbs are attached at their ends.  Zero for a limb of length zero.
        """
        frames = len(self.used)
        if not self._turning.any():
            return np.zeros((frames, 3))
        angles = spherical.continuous_angles(np.where(self._turning[:, None], self.chosen, np.nan))
        # As many unknowns as frames would swing between them: the angles of few frames ask for few cosines.
        most = min(self.basis.components, max(1, int(self.used.sum()) // 2))
        rows = cosine_basis(frames, self.basis.components)[:, :most]
        return spherical.fit(angles, rows, penalty=self.basis.ridge[:most]).directions(rows)

    @cached_property
    def _turning(self) -> np.ndarray:
        """Mask (F,) of the used frames in which joint and parent do not coincide, so that the limb has a direction."""
        sizes = np.linalg.norm(self.chosen, axis=1)
        return self.used & (sizes > 1e-9 * max(self.hits.radius, 1.0))

    @cached_property
    def mirror(self) -> LimbChoice:
        """Reconstruction of this limb mirrored in depth, with the opposite depth sign in each frame."""
        return select_signs(self.hits, self.solution, self.used, self.basis, mirrored=not self.mirrored)

    @property
    def crossing(self) -> float:
        """Ratio of the length that the image rays require to the assumed length of the limb.

        The ratio is about 1, or less for a limb that is too long.

        NaN of a limb without length.
        """
        reached = np.quantile(self.hits.rays.distance[self.used], FORGIVING)
        return float(reached / self.hits.radius) if self.hits.radius > 0 else np.nan

    @property
    def undecided(self) -> bool:
        """True if the mirror solution is nearly as plausible as the best solution; always true for parallel rays."""
        return bool(self.solution.margin < MARGIN_OF_DOUBT)


def choose_limb(
    cameras: np.ndarray,
    pixels: np.ndarray,
    parents: np.ndarray,
    length: float,
    *,
    basis: TrajectoryBasis,
    adjust: Adjustment = Adjustment.per_frame,
    noise_px: float = 0.0,
    time_limit_s: float = 1.0,
) -> LimbChoice:
    """Return the smoothest trajectory of one limb that its images and its length allow.

    The parameters are those of `solved`.
    """
    hits, solution = solved(
        cameras, pixels, parents, length,
        basis=basis, adjust=adjust, noise_px=noise_px, time_limit_s=time_limit_s,
    )  # fmt: skip
    return select_signs(hits, solution, hits.usable, basis, mirrored=False)


def solved(
    cameras: np.ndarray,
    pixels: np.ndarray,
    parents: np.ndarray,
    length: float,
    *,
    basis: TrajectoryBasis,
    adjust: Adjustment = Adjustment.per_frame,
    noise_px: float = 0.0,
    time_limit_s: float = 1.0,
) -> tuple[RayHits, BinarySolution]:
    """Return the two candidate positions of a joint in each frame, and the smoothest choice among them [park2011 12].

    Parameters
    ----------
    cameras : (F, 3, 4) or (3, 4)
        P of each frame.
    pixels : (F, 2)
        NaN where the joint was not seen.
    parents : (F, 3)
        Trajectory of its parent, mm.
    length : float
        mm.
    basis : TrajectoryBasis
    adjust : Adjustment
        As for `articulation.ray_sphere`.
    noise_px : float
        Of the images: where a ray touches the sphere within so much, the sign is left open.
    time_limit_s : float
        Nominal, for the certificate.

    Raises
    ------
    InvalidInput
        If the noise is no number of pixels, and as `ray_sphere`, `restricted` and `minimise`.
    """
    hits = ray_sphere(cameras, pixels, parents, length, adjust=adjust).resolved()
    used = hits.usable
    solution = minimise(
        basis.rows(len(pixels), used),
        hits.middle[used],
        hits.half_chord[used],
        time_limit_s=time_limit_s,
        relax_below=_tangent_within(cameras, parents, hits, noise_px),
    )
    return hits, solution


def select_signs(
    hits: RayHits, solution: BinarySolution, used: np.ndarray, basis: TrajectoryBasis, *, mirrored: bool
) -> LimbChoice:
    """Return the reconstruction of a limb with the depth signs of the best solution, or of its mirror image.

    Parameters
    ----------
    hits : RayHits
    solution : BinarySolution
    used : (F,) bool
    basis : TrajectoryBasis
    mirrored : bool
    """
    frames = len(used)
    signs = np.zeros(frames, int)
    signs[used] = solution.mirror_signs if mirrored else solution.signs
    values = signs.astype(float)
    if not mirrored:
        values[used] = solution.values
    chosen = hits.middle + values[:, None] * hits.half_chord
    return LimbChoice(hits, solution, used, signs, mirrored, chosen, basis)


def _tangent_within(cameras: np.ndarray, parents: np.ndarray, hits: RayHits, noise_px: float) -> float:
    """Return half the distance between two candidates, mm, below which image noise hides the depth sign: sqrt(2 r
    sigma).
    """
    if require_range("noise_px", noise_px, at_least=0.0, unit="px") == 0.0:
        return 0.0
    matrices = np.broadcast_to(cameras, (len(parents), 3, 4))
    depth = np.abs((matrices[:, 2, :3] * parents).sum(axis=1) + matrices[:, 2, 3])
    # Pixels to a millimetre at the parent: the first row of P moves by so much of a step across.
    scale = np.linalg.norm(matrices[:, 0, :3], axis=1) / np.maximum(depth, 1e-12)
    sigma = noise_px / np.nanmedian(scale)
    return np.sqrt(2.0 * hits.radius * sigma)
