"""Cost function of the refinement, with its gradient and Gauss-Newton matrix.

Symbols
-------
``x``      417 unknowns: W' (405), then q = (X0, Y0, Z0, Vx, Vz, theta, phi, phase, log f, Ax, Az, turn rate);
           for a wandering path, then the coefficients of cosines in its coordinates; for an unknown focal length,
                  then the logarithm of its ratio to the assumed one
``P``      ``A(theta + turn t) w(t) + (X0 + Vx t + Ax t~²/2, Y0, Z0 + Vz t + Az t~²/2)``, level camera axes, mm;
           t~² = t² minus its mean; ``w(t) = W' b(omega t + phase)``
``Q``      ``R_x(phi) P``; image ``f Q_xy / Q_z``
``sigma``  robust scale of the residual, px;  ``kappa``  number of residuals that count as one: slow errors repeat
``I``      information of a keypoint on its point P (3 x 3): every unknown enters through the motion of P with it
``d f(t)`` motion of P with an unknown of q: a direction d (one of the three axes, a turn, a later phase, a pitch,
       or nearer, as with a longer lens) times a function of time f (1, t, the bend of an acceleration, cosines)
``J(x)``   ``1/kappa sum (nu + 2) log(1 + r² / (nu sigma²)) + (W' - m)^T P0 (W' - m) + lengths + path + priors``:
           twice a negative log probability

The perspective is complete: 0.4 m of depth at 3 to 6 m distinguish front from back.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import blas

from pipeline.core.fourier import cycle_basis, equal_phases, waves
from walk3d.anatomy.prior import BONES, JOINTS, PAIRS, PHASES
from walk3d.anatomy.prior.lengths import ENDS, SIDES
from walk3d.film.walk.prior import Prior, belt_speed
from walk3d.film.walk.training import BLOCKS, HARMONICS, SIZE
from walk3d.film.walk.view import pitched, to_level, to_walker

X0, Y0, Z0, VX, VZ, HEADING, PITCH, PHASE, LOG_F, AX, AZ, TURN = range(SIZE, SIZE + 12)
UNKNOWNS = SIZE + 12
"""Number of unknowns of the fit, for a straight path and a known focal length.

Each cosine of the path adds three coefficients; an unknown focal length adds one unknown.
"""

CYCLE = cycle_basis(equal_phases(PHASES), BLOCKS)
"""Fourier basis (20, 9) at the phases at which bone lengths are evaluated."""
_MEAN = np.full(PHASES, 1.0 / PHASES)
_AXES = np.triu_indices(3)
_SYMMETRIC = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
"""Matrix (3, 3) with the index of each pair of axes in the list `_AXES`."""
RIGHT, DOWN, AWAY, TURNED, LATER, PITCHED, NEARER = range(7)
"""Directions in which the unknowns of the fit move the points P of the walker.

Each direction is multiplied by a function of time: 1, t, the bend, or a cosine.
"""
_ALONG = np.zeros((BLOCKS, BLOCKS))
"""Matrix that maps a walker's Fourier coefficients to those of the derivative with respect to the phase."""
for _h in range(1, HARMONICS + 1):
    _ALONG[2 * _h - 1, 2 * _h], _ALONG[2 * _h, 2 * _h - 1] = _h, -_h
_PAIRED = np.swapaxes(SIDES[..., None] * ENDS, 1, 2)
"""Contribution (P, 15, 16) of each joint, through each bone, to the left-right difference of each pair of bones."""
NU = 4.0
"""Degrees of freedom of the Student's t distribution of the residuals."""
PITCH_SD = np.radians(6.0)
LOG_F_SD = 0.1
ACCELERATION_SD = 150.0
TURN_SD = np.radians(6.0)
TREADMILL_SD = 100.0
"""Standard deviation, per horizontal axis, of the velocity of the path on a treadmill, mm/s."""
TIE_SD = (0.08, 40.0)
"""Tolerance of the difference between the speed along the path and the speed of the ground under the feet.

It is a share of the average walker's speed, plus a constant in mm/s.
"""
TIE_TIMES = (-0.35, 0.0, 0.35)
"""Times at which path speed and belt speed are compared, relative to the duration of the clip."""
FOCAL_SD = 0.35
"""Standard deviation of the logarithm of an unknown focal length around 0.75 of the image's longer side.

Most cameras have 0.38 (wide) to 1.5 (long)."""
WANDER_MM = 400.0
"""Standard deviation, mm, of the coefficient of the slowest cosine in a path that is not straight.

The standard deviation for the k-th cosine is 1 / k of it.
"""
MIN_DEPTH_MM = 200.0
"""Minimum depth, mm; points nearer to the camera are clamped."""


@dataclass(frozen=True)
class Keypoints:
    """Keypoints of one person, in which left and right may be exchanged in some frames.

    Attributes
    ----------
    pixels : (T, 15, 2)
        px from the principal point; any finite number where the weight is 0.
    weights : (T, 15)
        0 where missing.
    """

    pixels: np.ndarray
    weights: np.ndarray

    @cached_property
    def by_axis(self) -> np.ndarray:
        """Pixels of the keypoints, as an array (2, 15, T)."""
        return np.ascontiguousarray(self.pixels.T)

    @cached_property
    def by_joint(self) -> np.ndarray:
        """Weights of the keypoints, as an array (15, T)."""
        return np.ascontiguousarray(self.weights.T)

    @cached_property
    def seen(self) -> np.ndarray:
        """Mask (15, T) of the keypoints that are visible."""
        return self.by_joint > 0


@dataclass(frozen=True)
class Setting:
    """Fixed quantities of a fit: times of the frames, camera, and kind of path.

    Attributes
    ----------
    times : (T,)
        Times of the frames, s, 0 in the middle.
    focal_px : float
    overground : bool
    cosines : int
        Number of cosines in each coordinate of the path, for a following camera or a path that is not straight.
    nu : float
        Degrees of freedom of the residuals' Student's t; infinity gives a normal distribution.
    focal_sd : float
        Standard deviation of the logarithm of the focal length; 0 if it is known.
    """

    times: np.ndarray
    focal_px: float
    overground: bool
    cosines: int = 0
    nu: float = NU
    focal_sd: float = 0.0


@dataclass(frozen=True)
class Noise:
    """Scale of the residuals, px, and number of correlated residuals that count as one independent residual.

    Attributes
    ----------
    sigma_px, kappa : float
    """

    sigma_px: float
    kappa: float


@dataclass(frozen=True)
class Quadratic:
    """Cost J at given values of the unknowns, half its gradient, and half its Gauss-Newton matrix.

    Attributes
    ----------
    cost : float
    gradient : (417,)
    matrix : (417, 417)
        Lower triangle, in Fortran order.
    """

    cost: float
    gradient: np.ndarray
    matrix: np.ndarray


def point_costs(residual: np.ndarray, sigma_px: float, nu: float = NU) -> np.ndarray:
    """Return the costs (…) of residuals (2, …), px: twice the negative log probability of Student's t distribution."""
    return (nu + 2.0) * np.log1p((residual[0] ** 2 + residual[1] ** 2) / (nu * sigma_px**2))


def wander_basis(times: np.ndarray, cosines: int) -> np.ndarray:
    """Return cosines (T, n) with 1, 2, … half periods over the clip; each cosine has mean zero."""
    share = (times - times[0]) / (times[-1] - times[0])
    waves_of_path = np.cos(np.pi * share[:, None] * np.arange(1, cosines + 1))
    return waves_of_path - waves_of_path.mean(axis=0)


class Iterate:
    """Values of the unknowns of the cost J, with intermediate results that are computed once.

    Attributes
    ----------
    x : (417,)
    heading : (T,)
    basis : (9, T)
    body, level : (3, 15, T)
        P without the path, and P.
    depth : (15, T)
    tangent : (2, 15, T)
        Q_xy / Q_z.
    image : (2, 15, T)
        px.
    """

    def __init__(self, objective: Objective, x: np.ndarray) -> None:
        self.objective, self.x = objective, x
        t = objective.setting.times
        self.heading = x[HEADING] + x[TURN] * t
        self.basis = waves(2.0 * np.pi * np.exp(x[LOG_F]) * t + x[PHASE], HARMONICS)
        self.body = self.along(self.basis)
        self.level = self.body + objective.path(x)[:, None]
        points = (pitched(x[PITCH]) @ self.level.reshape(3, -1)).reshape(self.level.shape)
        self.depth = np.maximum(points[2], MIN_DEPTH_MM)
        self.tangent = points[:2] / self.depth
        self.image = objective.focal_px(x) * self.tangent

    def along(self, basis: np.ndarray) -> np.ndarray:
        """Return the walker (3, 15, T), mm, in level camera axes, given a Fourier basis (9, T) at the frames."""
        in_walker_axes = (self.x[:SIZE].reshape(-1, BLOCKS) @ basis).reshape(JOINTS, 3, -1)
        return to_level(in_walker_axes.swapaxes(0, 1), self.heading)

    @cached_property
    def away(self) -> np.ndarray:
        """Deviation W' - m (405,) of the walker from the mean of the prior, mm."""
        return self.x[:SIZE] - self.objective.prior.mean.ravel()

    @cached_property
    def pull(self) -> np.ndarray:
        """Half the gradient (405,) of the walker's prior cost, P0 (W' - m)."""
        return self.objective.prior.precision @ self.away

    @cached_property
    def lengths(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Bone vectors (16, 3, K) at K phases, mm, with their lengths, changes of lengths and left-right differences.

        In order: bones, lengths (16, K), deviations from the mean lengths (16, K), left minus right mean
        lengths (P,).
        """
        bones = (ENDS @ self.x[:SIZE].reshape(JOINTS, -1)).reshape(-1, BLOCKS)
        along = (bones @ CYCLE.T).reshape(len(BONES), 3, PHASES)
        length = np.sqrt(along[:, 0] ** 2 + along[:, 1] ** 2 + along[:, 2] ** 2)
        mean = length @ _MEAN
        return along, length, length - mean[:, None], mean[PAIRS[:, 0]] - mean[PAIRS[:, 1]]

    @cached_property
    def ties(self) -> tuple[np.ndarray, np.ndarray]:
        """Path velocity minus belt velocity, mm/s, along two axes at three times (6,), with derivatives (6, 417)."""
        x, belt = self.x, self.objective.prior.belt
        omega = 2.0 * np.pi * np.exp(x[LOG_F])
        speed = omega * (belt @ x[:SIZE])
        t = self.objective.tie_times
        heading = x[HEADING] + x[TURN] * t
        s, c = np.sin(heading), np.cos(heading)
        off = np.concatenate([x[VX] + x[AX] * t - speed * s, x[VZ] + x[AZ] * t + speed * c])
        slope = np.zeros((6, len(x)))
        slope[:3, VX], slope[3:, VZ] = 1.0, 1.0
        slope[:3, AX], slope[3:, AZ] = t, t
        direction = np.concatenate([-s, c])
        turned = np.concatenate([-speed * c, -speed * s])
        slope[:, :SIZE] = omega * direction[:, None] * belt
        slope[:, LOG_F] = speed * direction
        slope[:, HEADING] = turned
        slope[:, TURN] = turned * np.concatenate([t, t])
        return off, slope

    @cached_property
    def prior_cost(self) -> float:
        """Part of the cost J that depends on the prior but not on the keypoints."""
        objective = self.objective
        _, _, off, asymmetry = self.lengths
        cost = self.away @ self.pull + objective.frequency_cost
        cost += (off**2).sum(axis=-1) @ objective.length_weight + asymmetry**2 @ objective.pair_weight
        cost += (self.x[SIZE:] - objective.q_mean) ** 2 @ objective.q_precision
        if objective.setting.overground:
            cost += (self.ties[0] ** 2).sum() / objective.tie_variance
        return float(cost)


class Objective:
    """Cost function J of one clip, near one initial stride frequency.

    Parameters
    ----------
    prior : Prior
    setting : Setting
    start_hz : float
        Initial frequency, to which the search stays close.
    """

    def __init__(self, prior: Prior, setting: Setting, start_hz: float) -> None:
        self.prior, self.setting = prior, setting
        t = setting.times
        self.bend = 0.5 * (t**2 - np.mean(t**2))
        population = prior.model.log_frequency
        self.wander = wander_basis(t, setting.cosines)
        wandering = 3 * setting.cosines
        self.unknowns = UNKNOWNS + wandering + (setting.focal_sd > 0)
        mean, variance = np.zeros(self.unknowns - SIZE), np.full(self.unknowns - SIZE, np.inf)
        variance[12 : 12 + wandering] = np.tile((WANDER_MM / np.arange(1, setting.cosines + 1)) ** 2, 3)
        variance[12 + wandering :] = setting.focal_sd**2
        for index, middle, sd in (
            (PITCH, 0.0, PITCH_SD),
            (LOG_F, np.log(start_hz), LOG_F_SD),
            (AX, 0.0, ACCELERATION_SD),
            (AZ, 0.0, ACCELERATION_SD),
            (TURN, 0.0, TURN_SD),
        ):
            mean[index - SIZE], variance[index - SIZE] = middle, sd**2
        if not setting.overground:
            variance[[VX - SIZE, VZ - SIZE]] = TREADMILL_SD**2
        # The product of two normal priors on the logarithm of the frequency is normal.
        both = 1.0 / LOG_F_SD**2, 1.0 / (2.0 * population[1]) ** 2
        self.frequency_cost = (np.log(start_hz) - population[0]) ** 2 * both[0] * both[1] / sum(both)
        mean[LOG_F - SIZE] = (both[0] * np.log(start_hz) + both[1] * population[0]) / sum(both)
        variance[LOG_F - SIZE] = 1.0 / sum(both)
        self.q_mean, self.q_precision = mean, 1.0 / variance
        self._times = np.concatenate([[np.ones_like(t), t, self.bend], self.wander.T])
        cosines = np.arange(3, 3 + setting.cosines)
        axes = np.repeat([RIGHT, DOWN, AWAY], setting.cosines)
        self._direction = np.array(
            [RIGHT, DOWN, AWAY, RIGHT, AWAY, TURNED, PITCHED, LATER, LATER, RIGHT, AWAY, TURNED, *axes]
            + [NEARER] * (setting.focal_sd > 0)
        )
        self._time = np.array(
            [0, 0, 0, 1, 1, 0, 0, 0, 1, 2, 2, 1, *np.tile(cosines, 3)] + [0] * (setting.focal_sd > 0)
        )
        self._on_path = self._direction <= AWAY
        typical = 2.0 * np.pi * np.exp(population[0]) * belt_speed(prior)
        self.tie_variance = 3.0 * (TIE_SD[0] * typical + TIE_SD[1]) ** 2
        self.tie_times = np.array(TIE_TIMES) * (t[-1] - t[0])
        self.length_weight = 2.0 * HARMONICS / PHASES / prior.bone_sd**2
        self.pair_weight = 1.0 / prior.pair_sd**2

    def at(self, x: np.ndarray) -> Iterate:
        """Return the given unknowns with the intermediate results of the cost J."""
        return Iterate(self, x)

    def camera_points(self, x: np.ndarray) -> np.ndarray:
        """Return the positions Q (T, 15, 3) of the joints in camera axes, mm."""
        at = self.at(x)
        return np.concatenate([at.tangent * at.depth, at.depth[None]]).T

    def path(self, x: np.ndarray) -> np.ndarray:
        """Return the walker's path (3, T) in level camera axes, mm."""
        along = np.zeros((3, len(self._times)))
        along[self._direction[self._on_path], self._time[self._on_path]] = x[SIZE:][self._on_path]
        return along @ self._times

    def focal_px(self, x: np.ndarray) -> float:
        """Return the focal length for the unknowns x, px."""
        return self.setting.focal_px * np.exp(x[-1]) if self.setting.focal_sd else self.setting.focal_px

    def moved(self, x: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Return the values of the unknowns after one step of the refinement.

        With an unknown focal length, the depths change with it, which keeps the size in the image beyond first order.
        """
        unknowns = x + step
        if self.setting.focal_sd:
            depths = [Z0, VZ, AZ]
            unknowns[depths] = np.exp(step[-1]) * (unknowns[depths] - step[-1] * x[depths])
        return unknowns

    def image(self, x: np.ndarray) -> np.ndarray:
        """Return the projection of the walker into the image (T, 15, 2), px."""
        return self.at(x).image.T

    def residual(self, x: np.ndarray, keypoints: Keypoints) -> np.ndarray:
        """Return the projection of the walker minus the keypoints (T, 15, 2), px."""
        return self.image(x) - keypoints.pixels

    def cost(self, at: Iterate, keypoints: Keypoints, noise: Noise) -> float:
        """Return the cost J of the unknowns, given the keypoints and the noise."""
        costs = point_costs(at.image - keypoints.by_axis, noise.sigma_px, self.setting.nu)
        return np.vdot(costs, keypoints.by_joint) / noise.kappa + at.prior_cost

    def quadratic(self, at: Iterate, keypoints: Keypoints, noise: Noise) -> Quadratic:
        """Return the cost J, half its gradient and half its Gauss-Newton matrix."""
        blocks, border, corner = self._data_terms(at, keypoints, noise)
        matrix = np.empty((self.unknowns, self.unknowns), order="F")
        matrix[:SIZE, :SIZE], matrix[:SIZE, SIZE:] = self.prior.precision.T, 0.0
        matrix[SIZE:, :SIZE] = border[:-1]
        matrix[SIZE:, SIZE:] = corner[:-1, :-1]
        matrix[range(SIZE, self.unknowns), range(SIZE, self.unknowns)] += self.q_precision
        gradient = np.concatenate(
            [at.pull + border[-1], corner[-1, :-1] + (at.x[SIZE:] - self.q_mean) * self.q_precision]
        )
        slopes = self._add_lengths(at, blocks, gradient, matrix)
        weight, deviations = self.pair_weight, at.lengths[-1]
        if self.setting.overground:
            off, slope = at.ties
            deviations, slopes = np.concatenate([deviations, off]), np.concatenate([slopes, slope])
            weight = np.concatenate([weight, np.full(len(off), 1.0 / self.tie_variance)])
        gradient += slopes.T @ (weight * deviations)
        # A low-rank update in place, because the matrix is large.
        blas.dsyrk(1.0, slopes.T * np.sqrt(weight), 1.0, matrix, lower=1, overwrite_c=1)
        return Quadratic(self.cost(at, keypoints, noise), gradient, matrix)

    def _data_terms(
        self, at: Iterate, keypoints: Keypoints, noise: Noise
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the contributions of the keypoints to the Gauss-Newton matrix of the cost J.

        In order: walker by joint (15, 27, 27), rows of q and columns of the walker, rows and columns of q.

        The last rows are those of the gradient.
        """
        x, focal, nu = at.x, self.focal_px(at.x), self.setting.nu
        T, R = len(at.heading), pitched(x[PITCH])
        residual = at.image - keypoints.by_axis
        r2 = (residual[0] ** 2 + residual[1] ** 2) / noise.sigma_px**2
        w = np.sqrt(keypoints.by_joint * (nu + 2.0) / (nu + r2) / noise.kappa) / noise.sigma_px

        # Derivative of the weighted image by P: f / Z times (first rows of R minus the tangent times its last row).
        along = np.empty((NEARER + 2, 2, JOINTS, T))
        by_axis, moved = along[:TURNED], at.along(_ALONG @ at.basis)
        np.multiply(
            R[:2].T[..., None, None] - at.tangent * R[2][:, None, None, None],
            w * focal / at.depth,
            out=by_axis,
        )
        along[TURNED] = by_axis[2] * at.body[0] - by_axis[0] * at.body[2]
        along[LATER] = by_axis[0] * moved[0] + by_axis[1] * moved[1] + by_axis[2] * moved[2]
        along[PITCHED] = by_axis[2] * at.level[1] - by_axis[1] * at.level[2]
        along[NEARER] = w * focal * at.tangent
        along[-1] = w * residual

        # In the walker's axes: products of each point with itself, with every direction, and with the residual.
        by_walker_axis = to_walker(by_axis, at.heading)
        first, second = by_walker_axis[_AXES[0]], by_walker_axis[_AXES[1]]
        itself = (first[:, 0] * second[:, 0] + first[:, 1] * second[:, 1]).reshape(-1, T)
        blocks = (itself @ (at.basis[:, None] * at.basis).reshape(-1, T).T).reshape(
            -1, JOINTS, BLOCKS, BLOCKS
        )
        blocks = blocks[_SYMMETRIC].transpose(2, 0, 3, 1, 4).reshape(JOINTS, 3 * BLOCKS, 3 * BLOCKS)
        of_all = by_walker_axis[:, None, 0] * along[:, 0] + by_walker_axis[:, None, 1] * along[:, 1]
        timed = (self._times[:, None] * at.basis).reshape(-1, T)
        border = (of_all.reshape(-1, T) @ timed.T).reshape(3, NEARER + 2, JOINTS, -1, BLOCKS)
        direction, time = np.append(self._direction, -1), np.append(self._time, 0)
        border = border[:, direction, :, time].swapaxes(1, 2).reshape(-1, SIZE)

        of_q = (along[direction] * self._times[time][:, None, None]).reshape(len(time), -1)
        corner = of_q @ of_q.copy().T
        later = 2.0 * np.pi * np.exp(x[LOG_F])
        border[LOG_F - SIZE] *= later
        corner[LOG_F - SIZE] *= later
        corner[:, LOG_F - SIZE] *= later
        return blocks, border, corner

    def _add_lengths(
        self, at: Iterate, blocks: np.ndarray, gradient: np.ndarray, matrix: np.ndarray
    ) -> np.ndarray:
        """Add the bone-length terms of the cost J to its gradient and its Gauss-Newton matrix, in place.

        The per-joint blocks are added to the matrix as well.

        Return the derivatives (P, 417) of the left-right differences.
        """
        along, length, off, _ = at.lengths
        slope = ((along / length[:, None])[:, :, None] * CYCLE.T).reshape(len(BONES), 27, PHASES)
        mean = slope @ _MEAN
        pull = slope @ (self.length_weight[:, None] * off)[..., None]
        gradient[:SIZE] += (ENDS.T @ pull[..., 0]).ravel()
        slope -= mean[..., None]
        slope *= np.sqrt(self.length_weight)[:, None, None]
        of_bones = slope @ slope.swapaxes(1, 2)
        of_joints = matrix[:SIZE, :SIZE].reshape(JOINTS, 27, JOINTS, 27)
        of_joints[BONES.max(axis=1), :, BONES.min(axis=1)] -= of_bones
        on_diagonal = np.einsum("jajb->jab", of_joints)  # a view
        on_diagonal += blocks + (np.abs(ENDS).T @ of_bones.reshape(len(BONES), -1)).reshape(JOINTS, 27, 27)
        slopes = np.zeros((len(PAIRS), self.unknowns))
        slopes[:, :SIZE] = (_PAIRED @ mean).reshape(len(PAIRS), SIZE)
        return slopes
