"""Synthetic limbs and bodies with ground truth, for park2011 section 5.

Exact properties
----------------
`angular_limb`    has constant length, to rounding.  Its two angles, in its chart, lie in the span of the first K
                  cosines (DCT-II): the limbs of [park2011 4].  Its x, y, z do **not** lie in the span of few cosines.
                  The remainder falls faster than geometrically with their number: with K = 3 and swings of 0.8 rad,
                  28 of 100 cosines leave less than 1e-13 of it.

A moving limb cannot have both constant length and x, y, z in the span of K cosines, if 2 K - 2 < F.  Its coordinates
are polynomials of degree K - 1 in u = cos(pi (i + 1/2) / F).  Their squares sum to r^2 at F values of u, more than the
degree of that sum, hence for all real u.  But only a constant polynomial is bounded.  Therefore [park2011 12] has a
residual even for perfect data.

`synthetic_body`  is a tree of angular limbs on a moving root; all lengths are constant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import idct
from scipy.spatial.transform import Rotation

from pipeline.core.anthropometry import SEGMENTS
from pipeline.core.limb_chain import WALKER14, forward
from pipeline.core.limb_chain.lengths import anthropometric_lengths
from pipeline.shortened import shortened
from pipeline.validation import InvalidInput, require_range

HIP_HEIGHT = SEGMENTS["thigh"] + SEGMENTS["shank"] + SEGMENTS["ankle_height"]
"""Height of the pelvis above the floor, as a fraction of stature."""

MAX_SWING_RAD = 1.5
"""Largest swing of a direction angle, radians; a larger swing would reach the pole of spherical coordinates."""

REST_DIRECTIONS = {
    "sternum": (0.0, 0.0, 1.0),
    "head": (0.0, 0.1, 1.0),
    "shoulder": (1.0, 0.0, -0.15),
    "elbow": (0.2, 0.0, -1.0),
    "wrist": (0.1, 0.5, -1.0),
    "hip": (1.0, 0.0, 0.0),
    "knee": (0.0, 0.15, -1.0),
    "ankle": (0.0, -0.15, -1.0),
}
"""Mean direction of the limb that ends at each joint, for the right side of a body that faces +y."""

SWINGS_RAD = {"sternum": 0.2, "head": 0.2, "shoulder": 0.25, "hip": 0.2}
"""Largest swing, radians, of the direction angles of the trunk's limbs."""

SWING_RAD = 0.6
"""Largest swing, radians, of the direction angles of the limbs of arms and legs."""

WANDER_MM = 400.0
"""Largest displacement of the pelvis in x and in y, mm; the vertical displacement is a tenth of this value."""


@dataclass(frozen=True)
class AngularLimb:
    """Synthetic limb of constant length whose direction angles change smoothly.

    Attributes
    ----------
    relative : (F, 3) float64
        Relative trajectory, mm.
    length_mm : float
    angles_rad : (F, 2) float64
        Inclination from the chart's z axis and azimuth from its x axis, inside the basis.
    chart : (3, 3) float64
        Axes of the chart in world coordinates, as rows; x is the mean direction.
    """

    relative: np.ndarray
    length_mm: float
    angles_rad: np.ndarray
    chart: np.ndarray


@shortened
class SyntheticBody:
    """Synthetic body of 14 limbs of constant length, which move smoothly.

    Attributes
    ----------
    positions_mm : (F, 15, 3) float64
        Joint positions in WALKER15 order, world frame.
    root_mm : (F, 3) float64
        Trajectory of the pelvis.
    relative_mm : (F, 14, 3) float64
        Relative trajectories of the limbs of WALKER14, from the root to the leaves.
    lengths_mm : (14,) float64
    """

    positions_mm: np.ndarray
    root_mm: np.ndarray
    relative_mm: np.ndarray
    lengths_mm: np.ndarray


def smooth_series(generator: np.random.Generator, frames: int, count: int, *, bandwidth: int) -> np.ndarray:
    """Draw random smooth series (F, count), which are combinations of the first K cosines.

    Each series has mean zero and largest magnitude one.

    Parameters
    ----------
    generator : numpy.random.Generator
    frames, count : int
    bandwidth : int
        K, including the constant.

    Raises
    ------
    InvalidInput
        If K is below 2 or above the number of frames.
    """
    require_range("bandwidth", bandwidth, at_least=2, at_most=frames)
    coefficients = np.zeros((frames, count))
    decay = 1.0 / np.arange(1, bandwidth)
    coefficients[1:bandwidth] = decay[:, None] * generator.standard_normal((bandwidth - 1, count))
    series = idct(coefficients, axis=0, norm="ortho")
    return series / np.abs(series).max(axis=0)


def angular_limb(
    generator: np.random.Generator,
    frames: int,
    *,
    length_mm: float = 300.0,
    swing_rad: float = 0.8,
    bandwidth: int = 3,
    middle: np.ndarray | None = None,
) -> AngularLimb:
    """Draw a limb of constant length whose direction angles are combinations of cosines [park2011 3].

    Parameters
    ----------
    generator : numpy.random.Generator
    frames : int
    length_mm : float
        r; with 0 the joint coincides with its parent.
    swing_rad : float
        Largest deviation of each angle from its mean direction; with 0 the limb keeps its direction.
    bandwidth : int
        K, including the constant.
    middle : (3,) or None
        Mean direction, of any length; drawn if None.

    Raises
    ------
    InvalidInput
        If an argument is out of range, or `middle` is not a direction.

    Examples
    --------
    >>> limb = angular_limb(np.random.default_rng(0), 50, length_mm=200.0)
    >>> np.linalg.norm(limb.relative, axis=1).round(9).tolist() == [200.0] * 50
    True
    """
    require_range("length_mm", length_mm, at_least=0)
    require_range("swing_rad", swing_rad, at_least=0, at_most=MAX_SWING_RAD)
    towards = generator.standard_normal(3) if middle is None else np.asarray(middle, float)
    twist = generator.uniform(-np.pi, np.pi)
    angles = np.array([np.pi / 2.0, 0.0]) + swing_rad * smooth_series(
        generator, frames, 2, bandwidth=bandwidth
    )
    chart = _chart(towards, twist)
    inclination, azimuth = angles.T
    across = np.sin(inclination)
    unit = np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), np.cos(inclination)])
    return AngularLimb(float(length_mm) * unit @ chart, float(length_mm), angles, chart)


def synthetic_body(
    generator: np.random.Generator,
    frames: int,
    *,
    stature_mm: float = 1700.0,
    bandwidth: int = 5,
) -> SyntheticBody:
    """Draw a body with mean proportions, smoothly moving limbs and a moving pelvis [park2011 3].

    Parameters
    ----------
    generator : numpy.random.Generator
    frames : int
    stature_mm : float
    bandwidth : int
        K of all angles and of the pelvis, including the constant.

    Raises
    ------
    InvalidInput
        If an argument is out of range.
    """
    lengths = anthropometric_lengths(WALKER14, of="stature", size_mm=stature_mm)
    root = smooth_series(generator, frames, 3, bandwidth=bandwidth) * WANDER_MM * [1.0, 1.0, 0.1]
    root[:, 2] += HIP_HEIGHT * stature_mm
    relative = np.empty((frames, len(lengths), 3))
    for i, limb in enumerate(WALKER14.limbs):
        part = limb.removeprefix("left_").removeprefix("right_")
        side = -1.0 if limb.startswith("left_") else 1.0
        relative[:, i] = angular_limb(
            generator,
            frames,
            length_mm=lengths[i],
            swing_rad=SWINGS_RAD.get(part, SWING_RAD),
            bandwidth=bandwidth,
            middle=np.array(REST_DIRECTIONS[part]) * [side, 1.0, 1.0],
        ).relative
    return SyntheticBody(forward(WALKER14, root, relative), root, relative, lengths)


def _chart(towards: np.ndarray, twist_rad: float) -> np.ndarray:
    """Return three orthonormal axes as rows: the first along `towards`, the others rotated about it by an angle."""
    size = np.linalg.norm(towards) if towards.shape == (3,) else np.nan
    if not 0.0 < size < np.inf:
        raise InvalidInput(
            "must be a non-zero vector (3,)", "middle", received=towards, code="not_a_direction"
        )
    x = towards / size
    y = np.eye(3)[np.abs(x).argmin()]
    y = np.cross(x, y)
    y /= np.linalg.norm(y)
    turned = Rotation.from_rotvec(twist_rad * x).as_matrix()
    return np.stack([x, y, np.cross(x, y)]) @ turned.T
