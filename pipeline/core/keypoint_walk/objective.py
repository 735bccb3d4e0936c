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
``J(x)``   ``1/kappa sum (nu + 2) log(1 + r² / (nu sigma²)) + (W' - m)^T P0 (W' - m) + lengths + path + priors``:
           twice a negative logarithm of a probability

Full perspective: within 0.4 m of depth at 3 to 6 m it tells front from back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import blas

from pipeline.core.anatomical import BONES, JOINTS, PAIRS, PHASES
from pipeline.core.fourier import cycle_basis, cycle_slope, equal_phases
from pipeline.core.keypoint_walk.prior import Prior
from pipeline.core.keypoint_walk.training import BLOCKS, HARMONICS, SIZE
from pipeline.core.keypoint_walk.view import level_axes, level_axes_slope, pitched, pitched_slope

X0, Y0, Z0, VX, VZ, HEADING, PITCH, PHASE, LOG_F, AX, AZ, TURN = range(SIZE, SIZE + 12)
UNKNOWNS = SIZE + 12
"""Without the coefficients of a wandering path, of which there are three for each cosine."""

CYCLE = cycle_basis(equal_phases(PHASES), BLOCKS)
"""(20, 9): basis at the phases at which lengths are looked at."""
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
        self._constant = np.diag(np.concatenate([np.zeros(SIZE), self.q_precision]))
        self._constant[:SIZE, :SIZE] = prior.precision
        typical = 2.0 * np.pi * np.exp(population[0]) * float(prior.belt @ prior.model.mean.ravel())
        self.tie_variance = 3.0 * (TIE_SD[0] * typical + TIE_SD[1]) ** 2
        self.tie_times = np.array(TIE_TIMES) * float(t[-1] - t[0])
        self.length_weight = 2.0 * HARMONICS / PHASES / prior.bone_sd**2
        self.pair_weight = 1.0 / prior.pair_sd**2

    # --- the image ------------------------------------------------------------------------------------------

    def camera_points(self, x: np.ndarray) -> np.ndarray:
        """Points Q (T, 15, 3) in camera axes, mm."""
        points = self.level_points(x) @ pitched(x[PITCH]).T
        points[..., 2] = np.maximum(points[..., 2], NEAREST_MM)
        return np.asarray(points)

    def level_points(self, x: np.ndarray) -> np.ndarray:
        """Points P (T, 15, 3) in level camera axes, mm."""
        walker = x[:SIZE].reshape(JOINTS, 3, BLOCKS)
        t = self.setting.times
        basis = cycle_basis(2.0 * np.pi * np.exp(x[LOG_F]) * t + x[PHASE], BLOCKS)
        own = np.moveaxis(walker @ basis.T, -1, 0)  # (T, 15, 3)
        level = own @ np.swapaxes(level_axes(x[HEADING] + x[TURN] * t), 1, 2)
        return np.asarray(level + self._path(x)[:, None])

    def _path(self, x: np.ndarray) -> np.ndarray:
        t = self.setting.times
        path = np.empty((len(t), 3))
        path[:, 0] = x[X0] + x[VX] * t + x[AX] * self.bend
        path[:, 1] = x[Y0]
        path[:, 2] = x[Z0] + x[VZ] * t + x[AZ] * self.bend
        if self.setting.cosines:
            path += self.wander @ x[UNKNOWNS : UNKNOWNS + 3 * self.setting.cosines].reshape(3, -1).T
        return path

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
        points = self.camera_points(x)
        return np.asarray(self.focal_px(x) * points[..., :2] / points[..., 2:])

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
        along = (walker[BONES[:, 1]] - walker[BONES[:, 0]]) @ CYCLE.T  # (16, 3, K)
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
        gradient, matrix = np.zeros(self.unknowns), self._constant.copy()
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
        pulled = slopes.T * weight
        gradient += pulled @ apart
        # In place: the matrix is large, and these are few.
        blas.dgemm(1.0, pulled, slopes, 1.0, matrix.T, overwrite_c=1)
        return Quadratic(cost, gradient, matrix)

    def _add_image(
        self, x: np.ndarray, keypoints: Keypoints, noise: Noise, gradient: np.ndarray, matrix: np.ndarray
    ) -> float:
        """Add the data's terms in place; return their cost."""
        walker = x[:SIZE].reshape(JOINTS, 3, BLOCKS)
        t, focal, nu = self.setting.times, self.focal_px(x), self.setting.nu
        T = len(t)
        omega = 2.0 * np.pi * np.exp(x[LOG_F])
        psi = omega * t + x[PHASE]
        basis, slope = cycle_basis(psi, BLOCKS), cycle_slope(psi, BLOCKS)
        own = walker @ basis.T  # (15, 3, T)
        moving = walker @ slope.T
        heading = x[HEADING] + x[TURN] * t
        A, dA = np.moveaxis(level_axes(heading), 0, -1), np.moveaxis(level_axes_slope(heading), 0, -1)
        R, dR = pitched(x[PITCH]), pitched_slope(x[PITCH])
        RA = np.einsum("ij,jkt->ikt", R, A)
        level = np.einsum("ikt,jkt->jit", A, own) + self._path(x).T
        points = np.einsum("ik,jkt->jit", R, level)
        depth = np.maximum(points[:, 2], NEAREST_MM)
        image = focal * points[:, :2] / depth[:, None]
        residual = image - np.moveaxis(keypoints.pixels, 0, -1)  # (15, 2, T)
        weights = keypoints.weights.T
        r2 = (residual**2).sum(axis=1) / noise.sigma_px**2
        cost = (nu + 2.0) / noise.kappa * float((weights * np.log1p(r2 / nu)).sum())
        w = np.sqrt(weights * (nu + 2.0) / (nu + r2) / noise.kappa) / noise.sigma_px

        # Of the image with respect to camera axes, weighted: f / Z (e_x - u/f e_z), and so for y.
        scale = w * focal / depth

        def seen(vectors: np.ndarray) -> np.ndarray:
            """Weighted image (15, 2, T) of small displacements (15 or 1, 3, T) in camera axes."""
            return np.asarray(scale[:, None] * (vectors[:, :2] - image / focal * vectors[:, 2:]))

        count = 27 + self.unknowns - SIZE
        columns = np.empty((JOINTS, count, 2, T))
        for axis in range(3):
            toward = seen(RA[None, :, axis])
            columns[:, axis * BLOCKS : (axis + 1) * BLOCKS] = toward[:, None] * basis.T[None, :, None]
        shifted = [seen(np.broadcast_to(R[:, k, None], (1, 3, T))) for k in range(3)]
        turned = seen(np.einsum("ij,jkt,nkt->nit", R, dA, own, optimize=True))
        phased = seen(np.einsum("ikt,jkt->jit", RA, moving))
        pitch = seen(np.einsum("ik,jkt->jit", dR, level))
        border = (
            *shifted, shifted[0] * t, shifted[2] * t, turned, pitch, phased, phased * (omega * t),
            shifted[0] * self.bend, shifted[2] * self.bend, turned * t,
        )  # fmt: skip
        for k, column in enumerate(border):
            columns[:, 27 + k] = column
        for axis in range(3):
            for k, wave in enumerate(self.wander.T):
                columns[:, 39 + axis * self.setting.cosines + k] = shifted[axis] * wave
        if self.setting.focal_sd:
            columns[:, -1] = w[:, None] * image
        flat = columns.reshape(JOINTS, count, 2 * T)
        product = flat @ np.swapaxes(flat, 1, 2)
        pull = (flat @ (w[:, None] * residual).reshape(JOINTS, 2 * T, 1))[..., 0]
        for joint in range(JOINTS):
            at = slice(27 * joint, 27 * (joint + 1))
            matrix[at, at] += product[joint, :27, :27]
            matrix[at, SIZE:] += product[joint, :27, 27:]
            matrix[SIZE:, at] += product[joint, 27:, :27]
        matrix[SIZE:, SIZE:] += product[:, 27:, 27:].sum(axis=0)
        gradient[:SIZE] += pull[:, :27].ravel()
        gradient[SIZE:] += pull[:, 27:].sum(axis=0)
        return cost

    def _add_lengths(
        self, walker: np.ndarray, gradient: np.ndarray, matrix: np.ndarray
    ) -> tuple[float, np.ndarray, np.ndarray]:
        """Add the terms of constant lengths in place; return their cost, and of pairs differences (6,) and slopes."""
        along, length, off, apart = self._lengths(walker)
        direction = along / length[:, None]
        slope = (direction[:, :, None] * CYCLE.T).reshape(len(BONES), 27, PHASES)
        mean = slope.mean(axis=-1)
        centred = slope - mean[..., None]
        pull = np.einsum("b,bnk,bk->bn", self.length_weight, slope, off)
        block = (self.length_weight[:, None, None] * centred) @ np.swapaxes(centred, 1, 2)
        for bone, (i, j) in enumerate(BONES):
            first, second = slice(27 * i, 27 * (i + 1)), slice(27 * j, 27 * (j + 1))
            gradient[second] += pull[bone]
            gradient[first] -= pull[bone]
            matrix[first, first] += block[bone]
            matrix[second, second] += block[bone]
            matrix[first, second] -= block[bone]
            matrix[second, first] -= block[bone]
        lever = np.zeros((len(PAIRS), JOINTS, 27))
        for pair, (left, right) in enumerate(PAIRS):
            for bone, sign in ((left, 1.0), (right, -1.0)):
                lever[pair, BONES[bone, 1]] += sign * mean[bone]
                lever[pair, BONES[bone, 0]] -= sign * mean[bone]
        slopes = np.zeros((len(PAIRS), self.unknowns))
        slopes[:, :SIZE] = lever.reshape(len(PAIRS), SIZE)
        return float((off**2).sum(axis=-1) @ self.length_weight), apart, slopes
