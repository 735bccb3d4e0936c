"""One limb from one camera: the smoothest of the trajectories that its images and its length allow.

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

from dataclasses import dataclass

import numpy as np

from pipeline.core.articulation import Adjustment, RayHits, ray_sphere
from pipeline.core.binary_quadratic import BinarySolution, minimise
from pipeline.core.reconstructibility import MARGIN_GREEN_ABOVE, light_of_mirror_margin
from pipeline.core.refinement import spherical
from pipeline.core.trajectory_basis import choose_components, cosine_basis, restricted
from pipeline.validation import InvalidInput

MARGIN_OF_DOUBT = MARGIN_GREEN_ABOVE
"""Mirrors whose cost is up to so many times the best one's may be the truth; above, the data have decided."""


@dataclass(frozen=True)
class Smoothness:
    """The trajectory basis of a reconstruction.

    Attributes
    ----------
    components : int
        K.
    cutoff : float or None
        Of a soft basis: coefficient k is drawn to zero with weight (k / cutoff)^6; None for a hard one, as printed.

    Raises
    ------
    InvalidInput
        If there is no component, or the cutoff is not a number above zero.
    """

    components: int = 20
    cutoff: float | None = None

    def __post_init__(self) -> None:
        if self.components < 1:
            raise InvalidInput(
                "a trajectory basis has no component", expected="1 or more", received=str(self.components)
            )
        _check_cutoff(self.cutoff)

    def rows(self, frames: int, observed: np.ndarray) -> np.ndarray:
        """The basis of the n frames that were observed, as `binary_quadratic.minimise` takes it, (n, K) or (n, n)."""
        rows = restricted(cosine_basis(frames, self.components), observed, ridge=self.ridge)
        if len(rows) >= self.components:
            return rows
        # A soft basis may have more components than frames; as many columns have the same product B B^T.
        left, size, _ = np.linalg.svd(rows, full_matrices=False)
        return left * np.minimum(size, 1.0)

    @property
    def ridge(self) -> np.ndarray:
        """Weight (K,) with which each coefficient is drawn to zero; zeros for a hard basis."""
        k = np.arange(self.components, dtype=float)
        return np.zeros_like(k) if self.cutoff is None else (k / self.cutoff) ** 6

    def of(self, middle: np.ndarray, observed: np.ndarray) -> Smoothness:
        """The same for every limb.

        Parameters
        ----------
        middle : (F, 3)
        observed : (F,) bool
        """
        del middle, observed
        return self


@dataclass(frozen=True)
class SmoothnessByRule:
    """A trajectory basis whose K each limb's own images choose, by `trajectory_basis.choose_components`.

    Attributes
    ----------
    cutoff : float or None
        As of `Smoothness`.

    Raises
    ------
    InvalidInput
        If the cutoff is not a number above zero.
    """

    cutoff: float | None = None

    def __post_init__(self) -> None:
        _check_cutoff(self.cutoff)

    def of(self, middle: np.ndarray, observed: np.ndarray) -> Smoothness:
        """The basis of one limb.

        Parameters
        ----------
        middle : (F, 3)
            What is known of the limb before any sign is: the points of its rays nearest to its parent, mm.
        observed : (F,) bool
            Frames in which it was seen.

        Raises
        ------
        InvalidInput
            As `choose_components`.
        """
        return Smoothness(choose_components(middle, observed=observed).components, self.cutoff)


@dataclass(frozen=True)
class LimbChoice:
    """What was chosen for one limb, and how well the data decide it.

    Attributes
    ----------
    hits : RayHits
        Candidates, forced frames settled.
    solution : BinarySolution
        Of the frames that were used.
    used : (F,) bool
    signs : (F,) int
        That were taken, 0 in frames that were not used.
    mirrored : bool
        Whether the mirror was taken, because of a hinge.
    relative : (F, 3)
        Relative trajectory, mm: the chosen candidates where used, imputed on the sphere elsewhere.
    directions : (F, 3)
        Unit vectors in the trajectory basis: what children hang on.
    smoothness : Smoothness
        The basis, its K chosen if the limb was to choose it.
    """

    hits: RayHits
    solution: BinarySolution
    used: np.ndarray
    signs: np.ndarray
    mirrored: bool
    relative: np.ndarray
    directions: np.ndarray
    smoothness: Smoothness

    def mirror(self) -> LimbChoice:
        """The same limb with the mirror of these signs."""
        return taken(self.hits, self.solution, self.used, self.smoothness, mirrored=not self.mirrored)

    @property
    def light(self) -> str:
        """Green, amber or red by the margin of the mirror, which needs no truth."""
        return light_of_mirror_margin(self.solution.margin)

    @property
    def undecided(self) -> bool:
        """Whether the mirror may be the truth as well, as always with parallel rays, where the margin is 1."""
        return bool(self.solution.margin < MARGIN_OF_DOUBT)


def choose_limb(
    cameras: np.ndarray,
    pixels: np.ndarray,
    parents: np.ndarray,
    length: float,
    *,
    smoothness: Smoothness | SmoothnessByRule,
    adjust: Adjustment = "per_frame",
    noise_px: float = 0.0,
    time_limit_s: float = 1.0,
) -> LimbChoice:
    """The smoothest of the trajectories that images and length allow one limb [park2011 12].

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
    smoothness : Smoothness or SmoothnessByRule
    adjust : {"per_frame", "global", "robust"}
        As for `articulation.ray_sphere`.
    noise_px : float
        Of the images: where a ray touches the sphere within so much, the sign is left open.
    time_limit_s : float
        For the certificate.

    Raises
    ------
    InvalidInput
        If the noise is no number of pixels, and as `ray_sphere`, `choose_components`, `restricted` and `minimise`.
    """
    hits = ray_sphere(cameras, pixels, parents, length, adjust=adjust).settled()
    used = hits.usable
    basis = smoothness.of(hits.middle, used)
    solution = minimise(
        basis.rows(len(pixels), used),
        hits.middle[used],
        hits.half_chord[used],
        time_limit_s=time_limit_s,
        relax_below=_tangent_within(cameras, parents, hits, noise_px),
    )
    return taken(hits, solution, used, basis, mirrored=False)


def taken(
    hits: RayHits, solution: BinarySolution, used: np.ndarray, smoothness: Smoothness, *, mirrored: bool
) -> LimbChoice:
    """A limb's choice with the signs of a solution, or with those of its mirror.

    Parameters
    ----------
    hits : RayHits
    solution : BinarySolution
    used : (F,) bool
    smoothness : Smoothness
    mirrored : bool
    """
    frames = len(used)
    signs = np.zeros(frames, dtype=int)
    signs[used] = solution.mirror_signs if mirrored else solution.signs
    values = signs.astype(float)
    if not mirrored:
        values[used] = solution.values
    chosen = hits.middle + values[:, None] * hits.half_chord
    sizes = np.linalg.norm(chosen, axis=1)
    turning = sizes > 1e-9 * max(hits.radius, 1.0)
    if not turning[used].any():
        relative = np.zeros((frames, 3))
        return LimbChoice(hits, solution, used, signs, mirrored, relative, relative, smoothness)
    seen = np.where((used & turning)[:, None], chosen, np.nan)
    angles = spherical.continuous_angles(seen)
    rows = cosine_basis(frames, smoothness.components)
    penalty = smoothness.ridge
    # As many unknowns as frames would swing between them: the angles of few frames ask for few cosines.
    most = min(smoothness.components, max(1, int(used.sum()) // 2))
    path = spherical.fit(angles, rows[:, :most], penalty=penalty[:most])
    directions = path.directions(rows[:, :most])
    relative = np.where(used[:, None], chosen, hits.radius * directions)
    return LimbChoice(hits, solution, used, signs, mirrored, relative, directions, smoothness)


def _check_cutoff(cutoff: float | None) -> None:
    if cutoff is not None and not 0.0 < cutoff < np.inf:
        raise InvalidInput(
            "the cutoff of a soft basis cannot be so", expected="a number above 0", received=f"{cutoff:g}"
        )


def _tangent_within(cameras: np.ndarray, parents: np.ndarray, hits: RayHits, noise_px: float) -> float:
    """Half chord, mm, below which noise of the image decides the sign: sqrt(2 r sigma)."""
    if not 0.0 <= noise_px < np.inf:
        raise InvalidInput(
            "the noise of the images cannot be so", expected="px >= 0", received=f"{noise_px:g}"
        )
    if noise_px == 0.0:
        return 0.0
    matrices = np.broadcast_to(cameras, (len(parents), 3, 4))
    depth = np.abs((matrices[:, 2, :3] * parents).sum(axis=1) + matrices[:, 2, 3])
    # Pixels to a millimetre at the parent: the first row of P moves by so much of a step across.
    scale = np.linalg.norm(matrices[:, 0, :3], axis=1) / np.maximum(depth, 1e-12)
    sigma = noise_px / float(np.nanmedian(scale))
    return float(np.sqrt(2.0 * hits.radius * sigma))
