"""Direction of a limb as two smooth angles, inclination and azimuth (park2011 section 2, equation 4).

Symbols
-------
``theta``    inclination from the pole of the chart, rad; of either sign and beyond a half turn, so that it is smooth
``phi``      azimuth around that pole, rad, unwrapped
``Q``        chart, a rotation from the world to axes whose third is the pole
``Theta``    trajectory basis, F x K; ``a_theta``, ``a_phi`` its coefficients

Why computed differently from how it is printed: a direction has many pairs of angles, (theta, phi) and
(-theta, phi + pi) and either with whole turns added, and near the printed pole, the world's vertical, about which legs
and arms swing, no choice among them is smooth.  So the pole is turned to where it is farthest from the path, and
among the pairs of every frame those are chosen that make the path of angles shortest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core.refinement import kernels
from pipeline.shortened import shortened
from pipeline.validation import InvalidInput, require_finite, require_range, require_shape

_FLAT = 1e-9
"""Tolerance for geometric ties: unit vectors within this distance of a plane count as lying in it."""

_DETERMINED = 1e-10
"""Smallest ratio of triangular pivots, smallest to largest, at which a least squares problem counts as well determined.
"""

_AT_POLE = 1e-9
"""Sine of the inclination below which the azimuth of a direction is undefined."""


@dataclass(frozen=True)
class SphericalAngles:
    """Continuous inclination and azimuth of a direction over time; NaN in frames without a direction.

    Attributes
    ----------
    theta, phi : (F,)
        Inclination and azimuth, rad.
    chart : (3, 3)
        Rotation from the world to the axes in which they are measured.
    """

    theta: np.ndarray
    phi: np.ndarray
    chart: np.ndarray


@shortened
class SphericalTrajectory:
    """Direction over time as a curve on the unit sphere: coefficients of its two angles in a trajectory basis.

    Attributes
    ----------
    coefficients_theta, coefficients_phi : (K,)
        Of inclination and azimuth, rad.
    chart : (3, 3)
        Rotation from the world to the axes in which they are measured.
    """

    coefficients_theta: np.ndarray
    coefficients_phi: np.ndarray
    chart: np.ndarray

    def directions(self, basis: np.ndarray) -> np.ndarray:
        """Return the unit vectors (T, 3) of the direction at the times of the basis rows (T, K) [park2011 4].

        The rows may belong to times between frames.
        """
        theta, phi = basis @ self.coefficients_theta, basis @ self.coefficients_phi
        return to_directions(theta, phi, self.chart)


def to_directions(theta: np.ndarray, phi: np.ndarray, chart: np.ndarray) -> np.ndarray:
    """Return the unit vectors (…, 3), in world coordinates, of inclinations and azimuths of any size [park2011 4].

    Parameters
    ----------
    theta, phi : (…)
        rad.
    chart : (3, 3) or (L, 3, 3)
        Rotation from the world to the chart, or one for each limb of angles (L, F).

    Examples
    --------
    >>> to_directions(np.array([0.0, np.pi / 2]), np.array([7.0, 0.0]), np.eye(3)).round(12)
    array([[0., 0., 1.],
           [1., 0., 0.]])
    """
    across = np.sin(theta)
    local = np.stack([across * np.cos(phi), across * np.sin(phi), np.cos(theta)], axis=-1)
    return local @ chart


def tangents(theta: np.ndarray, phi: np.ndarray, chart: np.ndarray) -> np.ndarray:
    """Return the derivatives (…, 2, 3) of the unit vectors of `to_directions` by inclination and azimuth."""
    across, along, c, s = np.sin(theta), np.cos(theta), np.cos(phi), np.sin(phi)
    by_theta = np.stack([along * c, along * s, -across], axis=-1)
    by_phi = np.stack([-across * s, across * c, np.zeros_like(across)], axis=-1)
    return np.stack([by_theta, by_phi], axis=-2) @ chart


def unit_vectors(directions: np.ndarray) -> np.ndarray:
    """Return the directions (F, 3) scaled to unit length; NaN in frames with a coordinate that is not finite.

    Raises
    ------
    InvalidInput
        If the shape is another, no frame is known, or a vector has no length.
    """
    directions = require_shape("directions", np.asarray(directions, float), ("F", 3))
    finite = np.isfinite(directions).all(axis=1)
    if not finite.any():
        raise InvalidInput(
            "no frame has a known direction",
            expected="one or more",
            received=f"{len(finite)} frames of NaN",
            code="no_direction",
        )
    # Brought to unit size before squaring: the squares of 1e-200 are zero, those of 1e200 infinite.
    size = np.abs(np.where(finite[:, None], directions, 1.0)).max(axis=1)
    if not size.all():
        raise InvalidInput(
            f"the direction vector of frame {size.argmin()} is zero",
            expected="a vector that is not zero",
            code="zero_length",
            frame=size.argmin(),
        )
    scaled = np.where(finite[:, None], directions, np.nan) / size[:, None]
    return scaled / np.linalg.norm(scaled, axis=1, keepdims=True)


def farthest_chart(units: np.ndarray) -> np.ndarray:
    """Return a rotation (3, 3) whose third axis and its opposite are as far as possible from all unit vectors (n, 3).

    Notes
    -----
    The pole p has the least ``max |p . d|``: with the opposite of each direction added, the normal of the face of
    their convex hull that is nearest to the origin.  It turns with the world, and so does the zero of azimuth, which
    looks to the mean direction; only a limb that never turns has a perpendicular that is nearest to an axis of the
    world.  Ties go by fixed rules, so that rounding does not choose the axes.
    """
    # Two rows of zeros: three axes even of a single direction.
    _, spread, axes = np.linalg.svd(np.concatenate([units, np.zeros((2, 3))]), full_matrices=False)
    if spread[1] <= _FLAT * spread[0]:
        # Of a single direction, the perpendicular nearest to an axis of the world.
        pole = _perpendicular(np.eye(3)[np.abs(axes[0]).round(6).argmin()], axes[0])
    elif spread[2] <= _FLAT * spread[0]:
        pole = axes[2]
    else:
        pole = _nearest_face(units, axes / spread[:, None])
    mean = units.mean(axis=0)
    pole = _pointing(pole, mean)
    ahead = mean - (mean @ pole) * pole
    if np.linalg.norm(ahead) < 1e-6:
        # The mean vanishes or is the pole itself: the direction of greatest spread that is left.
        first, second = (axis - (axis @ pole) * pole for axis in axes[:2])
        left = first if np.linalg.norm(first) > 0.5 else second
        ahead = _pointing(left, mean)
    ahead = ahead / np.linalg.norm(ahead)
    aside = pole[[1, 2, 0]] * ahead[[2, 0, 1]] - pole[[2, 0, 1]] * ahead[[1, 2, 0]]
    return np.stack([ahead, aside, pole])


def _nearest_face(units: np.ndarray, whitening: np.ndarray) -> np.ndarray:
    """Return the normal (3,) of that face of the vectors' convex hull which is nearest to the origin.

    The hull is that of unit vectors (n, 3) and their opposites.

    The hull is found of `whitening` (3, 3) times the vectors, equally wide in all directions.  Of faces that are as
    near up to rounding, the normal of smallest digits.
    """
    white = np.ascontiguousarray(units @ whitening.T)
    normals = np.empty((8 * len(units), 3))
    normals = normals[: kernels.nearest_faces(white, whitening, _FLAT, normals)]
    size = np.linalg.norm(normals, axis=1)
    away = 1.0 / size
    normals = (normals / size[:, None])[away <= away.min() + _FLAT]
    digits = np.rint(1e6 * np.concatenate([normals, -normals]))
    first = int(np.lexsort(digits.T[::-1])[0])
    return np.concatenate([normals, -normals])[first]


def _perpendicular(wanted: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the unit vector (3,) perpendicular to an axis that is nearest to another direction."""
    across = wanted - (wanted @ axis) * axis
    return across / np.linalg.norm(across)


def _pointing(axis: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """Return an axis (3,) with the sign for which it points towards the mean direction.

    If the mean is perpendicular to the axis, the first non-zero coordinate is made positive.
    """
    side = axis @ mean
    if abs(side) <= _FLAT:
        side = axis[np.argmax(np.abs(axis) > 1e-6)]
    return axis if side > 0 else -axis


def continuous_angles(directions: np.ndarray, *, chart: np.ndarray | None = None) -> SphericalAngles:
    """Return inclination and azimuth of a direction over time, without jumps.

    Parameters
    ----------
    directions : (F, 3)
        Of any length; frames of NaN stay NaN, and the path goes on behind them by the shortest way.
    chart : (3, 3), optional
        By default the one whose pole is farthest from the path.

    Raises
    ------
    InvalidInput
        If a shape is another, no frame is known, a vector has no length, or the chart is not a rotation.

    Notes
    -----
    The sum of squared changes of both angles is least over all their pairs: a shortest path through two sheets.  A
    step costs the same from either, so the cheapest path is the one that is cheapest in every step, and no table
    of costs is needed.  A direction at the pole itself has no azimuth and takes it from its neighbours.
    """
    units = unit_vectors(directions)
    frames = np.flatnonzero(np.isfinite(units[:, 0]))
    chart = farthest_chart(units[frames]) if chart is None else np.asarray(chart, float)
    if chart.shape != (3, 3) or not np.abs(chart @ chart.T - np.eye(3)).max() < 1e-9:
        raise InvalidInput(
            "the matrix of the angle axes is not a rotation",
            expected="Q Q^T = I",
            received=chart.tolist(),
            code="not_rotation",
        )
    x, y, z = (units[frames] @ chart.T).T
    across = np.hypot(x, y)
    inclination, azimuth = np.arctan2(across, z), np.arctan2(y, x)
    placed = across > _AT_POLE
    if not placed.any():
        placed = np.ones_like(placed)
    theta, phi = np.full((2, len(units)), np.nan)
    theta[frames[placed]], phi[frames[placed]] = _shortest(inclination[placed], azimuth[placed])
    lost, defined = frames[~placed], frames[placed]
    phi[lost] = np.interp(lost, defined, phi[defined])
    near, raw = np.interp(lost, defined, theta[defined]), inclination[~placed]
    theta[lost] = raw + 2 * np.pi * np.round((near - raw) / (2 * np.pi))
    return SphericalAngles(theta, phi, chart)


def _shortest(inclination: np.ndarray, azimuth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return continuous angles theta and phi (n,), rad, from inclinations in [0, pi] and azimuths in (-pi, pi]."""
    step, turn = np.diff(inclination), _wrapped(np.diff(azimuth))
    mirrored_step, mirrored_turn = _wrapped(-inclination[1:] - inclination[:-1]), _wrapped(turn + np.pi)
    # Of two sheets that are equally near to rounding, the same one.
    changes = mirrored_step**2 + mirrored_turn**2 < (step**2 + turn**2) * (1.0 - _FLAT) - _FLAT**2
    # Whether a frame is on the other sheet, where inclination counts downwards.
    other = np.concatenate([[False], np.logical_xor.accumulate(changes)])
    step = np.where(changes, mirrored_step, step) * np.where(other[:-1], -1.0, 1.0)
    turn = np.where(changes, mirrored_turn, turn)
    theta = inclination[0] + np.concatenate([[0.0], np.cumsum(step)])
    phi = azimuth[0] + np.concatenate([[0.0], np.cumsum(turn)])
    return theta, phi


def _wrapped(angle: np.ndarray) -> np.ndarray:
    """Return the angles wrapped to the range from -pi to pi."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def fit(
    angles: SphericalAngles,
    basis: np.ndarray,
    *,
    penalty: np.ndarray | None = None,
) -> SphericalTrajectory:
    """Return the curve in the span of a trajectory basis that is nearest to given angles, by least squares.

    Parameters
    ----------
    angles : SphericalAngles
        Of F frames; frames of NaN are missing.
    basis : (F, K)
        Trajectory basis.
    penalty : (K,), optional
        Penalty on the square of each coefficient, for a soft basis; none by default.

    Raises
    ------
    InvalidInput
        If shapes disagree, a penalty is negative or not finite, or no frame is left.

    Notes
    -----
    An error of azimuth moves the direction by the sine of the inclination, and counts accordingly.  Where the
    frames do not determine all coefficients, the smallest ones are taken.
    """
    basis = np.asarray(basis, float)
    require_shape("basis", basis, (len(angles.theta), "K"))
    require_range("components", basis.shape[1], at_least=1)
    extra = np.zeros(basis.shape[1]) if penalty is None else np.asarray(penalty, float)
    require_finite("penalty", require_shape("penalty", extra, (basis.shape[1],)))
    require_range("penalty", extra.min(), at_least=0.0)
    used = np.isfinite(angles.theta)
    # For theta and phi: rows of the basis, then rows of the penalty, with the right-hand side of both.
    rows, count = basis[used], basis.shape[1]
    problems = np.zeros((2, len(rows) + count, count + 1))
    problems[:, : len(rows), :count] = rows
    problems[:, : len(rows), count] = angles.theta[used], angles.phi[used]
    problems[1, : len(rows)] *= np.abs(np.sin(angles.theta[used]))[:, None]
    problems[:, len(rows) + np.arange(count), np.arange(count)] = np.sqrt(extra)
    factors = np.asarray(np.linalg.qr(problems, mode="r"))
    determined = np.abs(np.diagonal(factors, axis1=1, axis2=2)[:, :count])
    if (determined.min(axis=1) > _DETERMINED * determined.max(axis=1)).all():
        theta, phi = np.linalg.solve(factors[:, :count, :count], factors[:, :count, count:])[..., 0]
    else:
        theta, phi = (np.linalg.lstsq(each[:, :count], each[:, count])[0] for each in problems)
    return SphericalTrajectory(theta, phi, np.array(angles.chart, float))
