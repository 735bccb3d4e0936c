"""What the refinement minimises, and its derivatives.

Symbols
-------
``x``      417 unknowns: W' (405), then q = (X0, Y0, Z0, Vx, Vz, theta, phi, phase, log f, Ax, Az, turn rate);
           for a path that wanders, then the coefficients of cosines in its coordinates; for a camera whose focal
           length is not known, then the logarithm of its ratio to the one that is assumed
``P``      ``A(theta + turn t) w(t) + (X0 + Vx t + Ax t~²/2, Y0, Z0 + Vz t + Az t~²/2)``, level camera axes, mm;
           t~² = t² minus its mean; ``w(t) = W' b(omega t + phase)``
``Q``      ``R_x(phi) P``; image ``f Q_xy / Q_z``
``sigma``  robust scale of the residual, px;  ``kappa``  residuals that say the same again: slow errors of a detector
``I``      information of a keypoint on its point P (3 x 3): of every unknown it asks only how P moves with it
``d f(t)`` how P moves with an unknown of q: a direction d (one of the three axes, a turn, a later phase, a pitch,
           or nearer, as a longer lens shows it) times a function of time f (1, t, the bend of an acceleration, cosines)
``J(x)``   ``1/kappa sum (nu + 2) log(1 + r² / (nu sigma²)) + (W' - m)^T P0 (W' - m) + lengths + path + priors``:
           twice a negative logarithm of a probability

Full perspective: within 0.4 m of depth at 3 to 6 m it tells front from back.
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
"""Without the coefficients of a wandering path, of which there are three for each cosine."""

CYCLE = cycle_basis(equal_phases(PHASES), BLOCKS)
"""(20, 9): basis at the phases at which lengths are looked at."""
_MEAN = np.full(PHASES, 1.0 / PHASES)
_AXES = np.triu_indices(3)
_SYMMETRIC = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
"""Number of the pair of axes, as `_AXES` has them, of any two."""
RIGHT, DOWN, AWAY, TURNED, LATER, PITCHED, NEARER = range(7)
"""Directions d; the functions of time are 1, t, the bend, and cosines."""
_ALONG = np.zeros((BLOCKS, BLOCKS))
"""Takes a walker's coefficients to those of his velocity along the phase."""
for _h in range(1, HARMONICS + 1):
    _ALONG[2 * _h - 1, 2 * _h], _ALONG[2 * _h, 2 * _h - 1] = _h, -_h
_PAIRED = np.swapaxes(SIDES[..., None] * ENDS, 1, 2)
"""(P, 15, 16): what each joint says of left less right, by bone."""
NU = 4.0
"""Degrees of freedom of Student's t."""
PITCH_SD = np.radians(6.0)
LOG_F_SD = 0.1
ACCELERATION_SD = 150.0
TURN_SD = np.radians(6.0)
TREADMILL_SD = 100.0
"""mm/s."""
TIE_SD = (0.08, 40.0)
"""Share of the average walker's speed, and mm/s: how closely path and belt speed agree."""
TIE_TIMES = (-0.35, 0.0, 0.35)
"""Instants at which they are compared, as shares of the clip."""
FOCAL_SD = 0.35
"""Of the logarithm of a focal length that is not known, about 0.75 of the image's longer side: most cameras have 0.38
(wide) to 1.5 (long)."""
WANDER_MM = 400.0
"""Standard deviation of the coefficient of the slowest cosine; that of the k-th is one k-th of it."""
NEAREST_MM = 200.0
"""Points nearer to the camera are taken to be so far."""


@dataclass(frozen=True)
class Keypoints:
    """Keypoints of one person, as labelled or with some frames' labels exchanged.

    Attributes
    ----------
    pixels : (T, 15, 2)
        Relative to the principal point; any finite number where the weight is 0.
    weights : (T, 15)
        0 where missing.
    """

    pixels: np.ndarray
    weights: np.ndarray

    @cached_property
    def by_axis(self) -> np.ndarray:
        """Pixels (2, 15, T)."""
        return np.ascontiguousarray(self.pixels.T)

    @cached_property
    def by_joint(self) -> np.ndarray:
        """Weights (15, T)."""
        return np.ascontiguousarray(self.weights.T)

    @cached_property
    def seen(self) -> np.ndarray:
        """Whether a joint is seen in a frame (15, T) bool."""
        return self.by_joint > 0


@dataclass(frozen=True)
class Setting:
    """When, with which camera and where a walk was filmed.

    Attributes
    ----------
    times : (T,)
        Seconds, 0 in the middle.
    focal_px : float
    overground : bool
    cosines : int
        Cosines of time in each coordinate of the path: for a camera that follows, or a path that is not straight.
    nu : float
        Degrees of freedom of Student's t, which the residuals have; infinitely many are a normal distribution.
    focal_sd : float
        Standard deviation of the logarithm of the focal length; 0: it is known.
    """

    times: np.ndarray
    focal_px: float
    overground: bool
    cosines: int = 0
    nu: float = NU
    focal_sd: float = 0.0


@dataclass(frozen=True)
class Noise:
    """Scale of the residuals and how often each is counted.

    Attributes
    ----------
    sigma_px, kappa : float
    """

    sigma_px: float
    kappa: float


@dataclass(frozen=True)
class Quadratic:
    """J at a point, half its gradient and half its Gauss-Newton matrix.

    Attributes
    ----------
    cost : float
    gradient : (417,)
    matrix : (417, 417)
        The lower triangle, in the order of Fortran.
    """

    cost: float
    gradient: np.ndarray
    matrix: np.ndarray


def point_costs(residual: np.ndarray, sigma_px: float, nu: float = NU) -> np.ndarray:
    """Student's t of residuals (2, …): twice a negative logarithm of a probability, (…)."""
    return (nu + 2.0) * np.log1p((residual[0] ** 2 + residual[1] ** 2) / (nu * sigma_px**2))


def wander_basis(times: np.ndarray, cosines: int) -> np.ndarray:
    """Cosines (T, n) of 1, 2, … half periods over the clip, of mean zero."""
    share = (times - times[0]) / (times[-1] - times[0])
    found = np.cos(np.pi * share[:, None] * np.arange(1, cosines + 1))
    return found - found.mean(axis=0)


class Iterate:
    """Unknowns, and what J has to know of them, worked out once.

    Attributes
    ----------
    x : (417,)
    heading : (T,)
    basis : (9, T)
    body, level : (3, 15, T)
        P about the path, and P.
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
        self.depth = np.maximum(points[2], NEAREST_MM)
        self.tangent = points[:2] / self.depth
        self.image = objective.focal_px(x) * self.tangent

    def along(self, basis: np.ndarray) -> np.ndarray:
        """The walker (3, 15, T) in level camera axes with this basis (9, T) of time."""
        own = (self.x[:SIZE].reshape(-1, BLOCKS) @ basis).reshape(JOINTS, 3, -1)
        return to_level(own.swapaxes(0, 1), self.heading)

    @cached_property
    def away(self) -> np.ndarray:
        """W' less its mean, (405,)."""
        return self.x[:SIZE] - self.objective.prior.mean.ravel()

    @cached_property
    def pull(self) -> np.ndarray:
        """P0 (W' - m), (405,)."""
        return self.objective.prior.precision @ self.away

    @cached_property
    def lengths(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Bones (16, 3, K), their lengths (16, K), what these are off their means, and left less right (P,)."""
        bones = (ENDS @ self.x[:SIZE].reshape(JOINTS, -1)).reshape(-1, BLOCKS)
        along = (bones @ CYCLE.T).reshape(len(BONES), 3, PHASES)
        length = np.sqrt(along[:, 0] ** 2 + along[:, 1] ** 2 + along[:, 2] ** 2)
        mean = length @ _MEAN
        return along, length, length - mean[:, None], mean[PAIRS[:, 0]] - mean[PAIRS[:, 1]]

    @cached_property
    def ties(self) -> tuple[np.ndarray, np.ndarray]:
        """Path minus belt velocity at three instants, (6,), and its derivatives (6, 417)."""
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
        """J without the data."""
        objective = self.objective
        _, _, off, apart = self.lengths
        cost = self.away @ self.pull + objective.apart
        cost += (off**2).sum(axis=-1) @ objective.length_weight + apart**2 @ objective.pair_weight
        cost += (self.x[SIZE:] - objective.q_mean) ** 2 @ objective.q_precision
        if objective.setting.overground:
            cost += (self.ties[0] ** 2).sum() / objective.tie_variance
        return float(cost)


class Objective:
    """J of one clip from one starting frequency.

    Parameters
    ----------
    prior : Prior
    setting : Setting
    start_hz : float
        Frequency about which the search stays.
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
        # Two priors on the logarithm of the frequency make one.
        both = 1.0 / LOG_F_SD**2, 1.0 / (2.0 * population[1]) ** 2
        self.apart = (np.log(start_hz) - population[0]) ** 2 * both[0] * both[1] / sum(both)
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
        """Unknowns with what follows from them."""
        return Iterate(self, x)

    def camera_points(self, x: np.ndarray) -> np.ndarray:
        """Points Q (T, 15, 3) in camera axes, mm."""
        at = self.at(x)
        return np.concatenate([at.tangent * at.depth, at.depth[None]]).T

    def path(self, x: np.ndarray) -> np.ndarray:
        """Path (3, T) in level camera axes, mm."""
        along = np.zeros((3, len(self._times)))
        along[self._direction[self._on_path], self._time[self._on_path]] = x[SIZE:][self._on_path]
        return along @ self._times

    def focal_px(self, x: np.ndarray) -> float:
        """Focal length, px."""
        return self.setting.focal_px * np.exp(x[-1]) if self.setting.focal_sd else self.setting.focal_px

    def moved(self, x: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Unknowns after a step.

        With an unknown focal length depths follow it, so that the image keeps its size to more than first order.
        """
        found = x + step
        if self.setting.focal_sd:
            depths = [Z0, VZ, AZ]
            found[depths] = np.exp(step[-1]) * (found[depths] - step[-1] * x[depths])
        return found

    def image(self, x: np.ndarray) -> np.ndarray:
        """Image of the walker (T, 15, 2), px."""
        return self.at(x).image.T

    def residual(self, x: np.ndarray, keypoints: Keypoints) -> np.ndarray:
        """Image of the walker minus keypoints (T, 15, 2), px."""
        return self.image(x) - keypoints.pixels

    def cost(self, at: Iterate, keypoints: Keypoints, noise: Noise) -> float:
        """Return J."""
        costs = point_costs(at.image - keypoints.by_axis, noise.sigma_px, self.setting.nu)
        return np.vdot(costs, keypoints.by_joint) / noise.kappa + at.prior_cost

    def quadratic(self, at: Iterate, keypoints: Keypoints, noise: Noise) -> Quadratic:
        """J, half its gradient and half its Gauss-Newton matrix."""
        blocks, border, corner = self._of_image(at, keypoints, noise)
        matrix = np.empty((self.unknowns, self.unknowns), order="F")
        matrix[:SIZE, :SIZE], matrix[:SIZE, SIZE:] = self.prior.precision.T, 0.0
        matrix[SIZE:, :SIZE] = border[:-1]
        matrix[SIZE:, SIZE:] = corner[:-1, :-1]
        matrix[range(SIZE, self.unknowns), range(SIZE, self.unknowns)] += self.q_precision
        gradient = np.concatenate(
            [at.pull + border[-1], corner[-1, :-1] + (at.x[SIZE:] - self.q_mean) * self.q_precision]
        )
        slopes = self._add_lengths(at, blocks, gradient, matrix)
        weight, apart = self.pair_weight, at.lengths[-1]
        if self.setting.overground:
            off, slope = at.ties
            apart, slopes = np.concatenate([apart, off]), np.concatenate([slopes, slope])
            weight = np.concatenate([weight, np.full(len(off), 1.0 / self.tie_variance)])
        gradient += slopes.T @ (weight * apart)
        # In place: the matrix is large, and these are few.
        blas.dsyrk(1.0, slopes.T * np.sqrt(weight), 1.0, matrix, lower=1, overwrite_c=1)
        return Quadratic(self.cost(at, keypoints, noise), gradient, matrix)

    def _of_image(
        self, at: Iterate, keypoints: Keypoints, noise: Noise
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The data's part of the matrix: of each joint (15, 27, 27), of q and walker, and of q; their last rows are
        that of the gradient.
        """
        x, focal, nu = at.x, self.focal_px(at.x), self.setting.nu
        T, R = len(at.heading), pitched(x[PITCH])
        residual = at.image - keypoints.by_axis
        r2 = (residual[0] ** 2 + residual[1] ** 2) / noise.sigma_px**2
        w = np.sqrt(keypoints.by_joint * (nu + 2.0) / (nu + r2) / noise.kappa) / noise.sigma_px

        # The weighted image's derivative by P: f / Z of (R's first rows less the tangent times its last).
        along = np.empty((NEARER + 2, 2, JOINTS, T))
        seen, moved = along[:TURNED], at.along(_ALONG @ at.basis)
        np.multiply(
            R[:2].T[..., None, None] - at.tangent * R[2][:, None, None, None], w * focal / at.depth, out=seen
        )
        along[TURNED] = seen[2] * at.body[0] - seen[0] * at.body[2]
        along[LATER] = seen[0] * moved[0] + seen[1] * moved[1] + seen[2] * moved[2]
        along[PITCHED] = seen[2] * at.level[1] - seen[1] * at.level[2]
        along[NEARER] = w * focal * at.tangent
        along[-1] = w * residual

        # By the walker's own axes: what a point's place says of itself, of every direction, and of the residual.
        own = to_walker(seen, at.heading)
        one, other = own[_AXES[0]], own[_AXES[1]]
        itself = (one[:, 0] * other[:, 0] + one[:, 1] * other[:, 1]).reshape(-1, T)
        blocks = (itself @ (at.basis[:, None] * at.basis).reshape(-1, T).T).reshape(
            -1, JOINTS, BLOCKS, BLOCKS
        )
        blocks = blocks[_SYMMETRIC].transpose(2, 0, 3, 1, 4).reshape(JOINTS, 3 * BLOCKS, 3 * BLOCKS)
        of_all = own[:, None, 0] * along[:, 0] + own[:, None, 1] * along[:, 1]
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
        """Add the terms of constant lengths and of the joints' blocks in place; return slopes of pairs (6, 417)."""
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
