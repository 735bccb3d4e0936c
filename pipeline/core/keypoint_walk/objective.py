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

import numpy as np
from scipy.linalg import blas

from pipeline.core.anatomical import BONES, JOINTS, PAIRS, PHASES
from pipeline.core.fourier import cycle_basis, equal_phases
from pipeline.core.keypoint_walk.prior import Prior
from pipeline.core.keypoint_walk.training import BLOCKS, HARMONICS, SIZE
from pipeline.core.keypoint_walk.view import pitched, to_level, to_walker

X0, Y0, Z0, VX, VZ, HEADING, PITCH, PHASE, LOG_F, AX, AZ, TURN = range(SIZE, SIZE + 12)
UNKNOWNS = SIZE + 12
"""Without the coefficients of a wandering path, of which there are three for each cosine."""

CYCLE = cycle_basis(equal_phases(PHASES), BLOCKS)
"""(20, 9): basis at the phases at which lengths are looked at."""
RIGHT, DOWN, AWAY, TURNED, LATER, PITCHED, NEARER = range(7)
"""Directions d; the functions of time are 1, t, the bend, and cosines."""
_ALONG = np.zeros((BLOCKS, BLOCKS))
"""Takes a walker's coefficients to those of his velocity along the phase."""
for _h in range(1, HARMONICS + 1):
    _ALONG[2 * _h - 1, 2 * _h], _ALONG[2 * _h, 2 * _h - 1] = _h, -_h
_ENDS = np.eye(JOINTS)[BONES[:, 1]] - np.eye(JOINTS)[BONES[:, 0]]
"""(16, 15): what a bone is of the joints."""
_PAIRED = np.swapaxes(
    (np.eye(len(BONES))[PAIRS[:, 0]] - np.eye(len(BONES))[PAIRS[:, 1]])[..., None] * _ENDS, 1, 2
)
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
    """Student's t of residuals (…, 2): twice a negative logarithm of a probability, (…)."""
    return (nu + 2.0) * np.log1p((residual**2).sum(axis=-1) / (nu * sigma_px**2))


def wander_basis(times: np.ndarray, cosines: int) -> np.ndarray:
    """Cosines (T, n) of 1, 2, … half periods over the clip, of mean zero."""
    share = (times - times[0]) / (times[-1] - times[0])
    waves = np.cos(np.pi * share[:, None] * np.arange(1, cosines + 1))
    return np.asarray(waves - waves.mean(axis=0))


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
        self._apart = (np.log(start_hz) - population[0]) ** 2 * both[0] * both[1] / sum(both)
        mean[LOG_F - SIZE] = (both[0] * np.log(start_hz) + both[1] * population[0]) / sum(both)
        variance[LOG_F - SIZE] = 1.0 / sum(both)
        self.q_mean, self.q_precision = mean, 1.0 / variance
        self._times = np.concatenate([[np.ones_like(t), t, self.bend], self.wander.T])
        waves = np.arange(3, 3 + setting.cosines)
        axes = np.repeat([RIGHT, DOWN, AWAY], setting.cosines)
        self._direction = np.array(
            [RIGHT, DOWN, AWAY, RIGHT, AWAY, TURNED, PITCHED, LATER, LATER, RIGHT, AWAY, TURNED, *axes]
            + [NEARER] * (setting.focal_sd > 0)
        )
        self._time = np.array(
            [0, 0, 0, 1, 1, 0, 0, 0, 1, 2, 2, 1, *np.tile(waves, 3)] + [0] * (setting.focal_sd > 0)
        )
        self._on_path = self._direction <= AWAY
        self._constant = np.diag(np.concatenate([np.zeros(SIZE), self.q_precision])).T
        self._constant[:SIZE, :SIZE] = prior.precision
        typical = 2.0 * np.pi * np.exp(population[0]) * float(prior.belt @ prior.model.mean.ravel())
        self.tie_variance = 3.0 * (TIE_SD[0] * typical + TIE_SD[1]) ** 2
        self.tie_times = np.array(TIE_TIMES) * float(t[-1] - t[0])
        self.length_weight = 2.0 * HARMONICS / PHASES / prior.bone_sd**2
        self.pair_weight = 1.0 / prior.pair_sd**2

    # --- the image ------------------------------------------------------------------------------------------

    def camera_points(self, x: np.ndarray) -> np.ndarray:
        """Points Q (T, 15, 3) in camera axes, mm."""
        return self._camera_points(self._level_points(x)[0], x).T

    def level_points(self, x: np.ndarray) -> np.ndarray:
        """Points P (T, 15, 3) in level camera axes, mm."""
        return self._level_points(x)[0].T

    def _level_points(
        self, x: np.ndarray, *, moving: bool = False
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """P (3, 15, T), the part of it that is the body, with its derivative by the phase, and the basis (9, T)."""
        walker = x[:SIZE].reshape(JOINTS, 3, BLOCKS).swapaxes(0, 1)
        walker = np.concatenate([walker, walker @ _ALONG], axis=1) if moving else walker
        t = self.setting.times
        basis = cycle_basis(2.0 * np.pi * np.exp(x[LOG_F]) * t + x[PHASE], BLOCKS).T
        own = (walker.reshape(-1, BLOCKS) @ basis).reshape(3, -1, len(t))
        body = to_level(own, x[HEADING] + x[TURN] * t)
        along = np.zeros((3, len(self._times)))
        along[self._direction[self._on_path], self._time[self._on_path]] = x[SIZE:][self._on_path]
        return body[:, :JOINTS] + (along @ self._times)[:, None], body, basis

    @staticmethod
    def _camera_points(level: np.ndarray, x: np.ndarray) -> np.ndarray:
        points = np.tensordot(pitched(x[PITCH]), level, axes=1)
        np.maximum(points[2], NEAREST_MM, out=points[2])
        return points

    def focal_px(self, x: np.ndarray) -> float:
        """Focal length, px."""
        return float(
            self.setting.focal_px * np.exp(x[-1]) if self.setting.focal_sd else self.setting.focal_px
        )

    def moved(self, x: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Unknowns after a step.

        With an unknown focal length depths follow it, so that the image keeps its size to more than first order.
        """
        found = x + step
        if self.setting.focal_sd:
            depths = [Z0, VZ, AZ]
            found[depths] = np.exp(step[-1]) * (found[depths] - step[-1] * x[depths])
        return np.asarray(found)

    def image(self, x: np.ndarray) -> np.ndarray:
        """Image of the walker (T, 15, 2), px."""
        points = self._camera_points(self._level_points(x)[0], x)
        return np.asarray(self.focal_px(x) * points[:2] / points[2]).T

    def residual(self, x: np.ndarray, keypoints: Keypoints) -> np.ndarray:
        """Image of the walker minus keypoints (T, 15, 2), px."""
        return self.image(x) - keypoints.pixels

    # --- everything else ------------------------------------------------------------------------------------

    def _ties(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Path minus belt velocity at three instants, (6,), and its derivatives (6, 417)."""
        omega = 2.0 * np.pi * np.exp(x[LOG_F])
        speed = omega * float(self.prior.belt @ x[:SIZE])
        t = self.tie_times
        heading = x[HEADING] + x[TURN] * t
        s, c = np.sin(heading), np.cos(heading)
        off = np.concatenate([x[VX] + x[AX] * t - speed * s, x[VZ] + x[AZ] * t + speed * c])
        slope = np.zeros((6, self.unknowns))
        slope[:3, VX], slope[3:, VZ] = 1.0, 1.0
        slope[:3, AX], slope[3:, AZ] = t, t
        direction = np.concatenate([-s, c])
        turned = np.concatenate([-speed * c, -speed * s])
        slope[:, :SIZE] = omega * direction[:, None] * self.prior.belt
        slope[:, LOG_F] = speed * direction
        slope[:, HEADING] = turned
        slope[:, TURN] = turned * np.concatenate([t, t])
        return off, slope

    def _lengths(self, walker: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        along = (_ENDS @ walker.reshape(JOINTS, -1)).reshape(len(BONES), 3, BLOCKS) @ CYCLE.T  # (16, 3, K)
        length = np.sqrt((along**2).sum(axis=1))
        mean = length.mean(axis=-1)
        return along, length, length - mean[:, None], mean[PAIRS[:, 0]] - mean[PAIRS[:, 1]]

    def prior_cost(self, x: np.ndarray) -> float:
        """J without the data."""
        away = x[:SIZE] - self.prior.mean.ravel()
        _, _, off, apart = self._lengths(x[:SIZE].reshape(JOINTS, 3, BLOCKS))
        q = x[SIZE:] - self.q_mean
        cost = away @ self.prior.precision @ away + self._apart
        cost += (off**2).sum(axis=-1) @ self.length_weight + apart**2 @ self.pair_weight
        cost += (q**2 * self.q_precision).sum()
        if self.setting.overground:
            cost += (self._ties(x)[0] ** 2).sum() / self.tie_variance
        return float(cost)

    def cost(self, x: np.ndarray, keypoints: Keypoints, noise: Noise) -> float:
        """Return J."""
        return self.cost_of(x, self.residual(x, keypoints), keypoints.weights, noise)

    def cost_of(self, x: np.ndarray, residual: np.ndarray, weights: np.ndarray, noise: Noise) -> float:
        """Return J of x whose residuals are known."""
        costs = point_costs(residual, noise.sigma_px, self.setting.nu) * weights
        return float(costs.sum()) / noise.kappa + self.prior_cost(x)

    def quadratic(self, x: np.ndarray, keypoints: Keypoints, noise: Noise) -> Quadratic:
        """J, half its gradient and half its Gauss-Newton matrix at x."""
        gradient, matrix = np.zeros(self.unknowns), self._constant.copy("F")
        away = x[:SIZE] - self.prior.mean.ravel()
        gradient[:SIZE] = self.prior.precision @ away
        cost = float(away @ gradient[:SIZE]) + self._apart
        q = x[SIZE:] - self.q_mean
        gradient[SIZE:] += q * self.q_precision
        cost += float((q**2 * self.q_precision).sum())
        cost += self._add_image(x, keypoints, noise, gradient, matrix)
        more, apart, slopes = self._add_lengths(x[:SIZE].reshape(JOINTS, 3, BLOCKS), gradient, matrix)
        weight = self.pair_weight
        if self.setting.overground:
            off, slope = self._ties(x)
            apart, slopes = np.concatenate([apart, off]), np.concatenate([slopes, slope])
            weight = np.concatenate([weight, np.full(len(off), 1.0 / self.tie_variance)])
        cost += more + float(apart**2 @ weight)
        gradient += slopes.T @ (weight * apart)
        # In place: the matrix is large, and these are few.
        blas.dsyrk(1.0, slopes.T * np.sqrt(weight), 1.0, matrix, lower=1, overwrite_c=1)
        return Quadratic(cost, gradient, matrix)

    def _add_image(
        self, x: np.ndarray, keypoints: Keypoints, noise: Noise, gradient: np.ndarray, matrix: np.ndarray
    ) -> float:
        """Add the data's terms in place; return their cost."""
        t, focal, nu = self.setting.times, self.focal_px(x), self.setting.nu
        T, heading, R = len(t), x[HEADING] + x[TURN] * t, pitched(x[PITCH])
        level, body, basis = self._level_points(x, moving=True)
        points = self._camera_points(level, x)
        tangent = points[:2] / points[2]
        residual, weights = focal * tangent - keypoints.pixels.T, keypoints.weights.T
        r2 = (residual**2).sum(axis=0) / noise.sigma_px**2
        cost = (nu + 2.0) / noise.kappa * float((weights * np.log1p(r2 / nu)).sum())
        w = np.sqrt(weights * (nu + 2.0) / (nu + r2) / noise.kappa) / noise.sigma_px

        # The weighted image's derivative by P: f / Z of (R's first rows less the tangent times its last).
        seen = w * focal / points[2] * (R[:2, :, None, None] - tangent[:, None] * R[2][:, None, None])
        information = np.einsum("iajt,ibjt->abjt", seen, seen)
        pull = np.einsum("iajt,ijt->ajt", seen, w * residual)
        gradient[:SIZE] += (
            (to_walker(pull, heading).reshape(-1, T) @ basis.T).reshape(3, JOINTS, -1).swapaxes(0, 1).ravel()
        )

        own, zero = body[:, :JOINTS], np.zeros_like(w)
        directions = [(-own[2], zero, own[0]), body[:, JOINTS:], (zero, -level[2], level[1])]
        if self.setting.focal_sd:
            directions.append(-points[2] * R[2][:, None, None])
        moved = np.array(directions)  # (3 or 4, 3, 15, T)
        told = np.concatenate([information, np.einsum("dajt,abjt->dbjt", moved, information)])
        d, f = self._direction, self._time
        scale = np.ones(len(d))
        scale[LOG_F - SIZE] = 2.0 * np.pi * np.exp(x[LOG_F])
        pulled = np.concatenate([pull.sum(axis=1), np.einsum("dajt,ajt->dt", moved, pull)])
        gradient[SIZE:] += scale * (pulled @ self._times.T)[d, f]

        # Products of functions of time, summed over the frames.
        pairs = np.concatenate([told.sum(axis=2), np.einsum("dajt,bajt->dbt", told, moved)], axis=1)
        corner = pairs @ (self._times[:, None] * self._times).reshape(-1, T).T
        corner = corner.reshape(*pairs.shape[:2], len(self._times), -1)[d[:, None], d, f[:, None], f]
        matrix[SIZE:, SIZE:] += scale[:, None] * corner * scale
        told = to_walker(told.swapaxes(0, 1), heading)  # (3, 6 or 7, 15, T)
        border = told.reshape(-1, T) @ (self._times[:, None] * basis).reshape(-1, T).T
        border = border.reshape(3, -1, JOINTS, len(self._times), BLOCKS)[:, d, :, f]
        border = (scale[:, None, None, None] * border).swapaxes(1, 2).reshape(len(d), SIZE)
        matrix[SIZE:, :SIZE] += border
        information = to_walker(told[:, :3].swapaxes(0, 1), heading)
        blocks = information.reshape(-1, T) @ (basis[:, None] * basis).reshape(-1, T).T
        of_joints = matrix[:SIZE, :SIZE].reshape(JOINTS, 3, BLOCKS, JOINTS, 3, BLOCKS)
        of_joints = np.einsum("jakjbl->abjkl", of_joints)  # a view of the blocks on the diagonal
        of_joints += blocks.reshape(3, 3, JOINTS, BLOCKS, BLOCKS)
        return cost

    def _add_lengths(
        self, walker: np.ndarray, gradient: np.ndarray, matrix: np.ndarray
    ) -> tuple[float, np.ndarray, np.ndarray]:
        """Add the terms of constant lengths in place; return their cost, and of pairs differences (6,) and slopes."""
        along, length, off, apart = self._lengths(walker)
        slope = ((along / length[:, None])[:, :, None] * CYCLE.T).reshape(len(BONES), 27, PHASES)
        mean = slope.mean(axis=-1)
        pull = slope @ (self.length_weight[:, None] * off)[..., None]
        gradient[:SIZE] += (_ENDS.T @ pull[..., 0]).ravel()
        centred = slope - mean[..., None]
        blocks = (self.length_weight[:, None, None] * centred) @ np.swapaxes(centred, 1, 2)
        of_joints = matrix[:SIZE, :SIZE].reshape(JOINTS, 27, JOINTS, 27)
        of_joints[BONES.max(axis=1), :, BONES.min(axis=1)] -= blocks
        on_diagonal = np.einsum("jajb->jab", of_joints)  # a view
        on_diagonal += (np.abs(_ENDS).T @ blocks.reshape(len(BONES), -1)).reshape(JOINTS, 27, 27)
        slopes = np.zeros((len(PAIRS), self.unknowns))
        slopes[:, :SIZE] = (_PAIRED @ mean).reshape(len(PAIRS), SIZE)
        return float((off**2).sum(axis=-1) @ self.length_weight), apart, slopes
