"""What a 2D input gives: its frequency from one view alone, its phase as one more unknown of the fit.

The papers take frequency and phase from the 3D motion before it is projected [zhang2007 3.1, 3.4].  Here nothing
but the view is used (`sweep.phase_source: observed2d`).

Symbols
-------
``o``      2D Fourier representation of the clip in its own phase: time zero is the first frame
``phi``    phase of the walker at the first frame; ``f = (1, cos phi, sin phi, cos 2 phi, sin 2 phi)``
``U``      ``shift(o, phi) = f U``; ``D``: U with the projected average walker taken from row 0
``A``      ``B_hat^T B_hat``; ``H = D B_hat``; ``G = D D^T``
``M``      ``G - H (A + sigma2 I)^-1 H^T``: with the coefficients eliminated the cost is ``J = f^T M f``

Why this is exact: with k eliminated J is a trigonometric polynomial in phi of degree four, so a grid sees every
minimum and Newton's method finishes it.  With the view unknown too, the lowest J over phi is a function of one
angle beta; as the lower envelope of smooth curves it has no local minimum at a kink, so a bracket suffices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from pipeline.core import camera, errors, view_search
from pipeline.core.fourier import SEARCH_HZ, design, shift
from pipeline.core.linear_model import LinearModel, WhitenedModel, whiten
from pipeline.core.reconstruction import check_noise_variance
from pipeline.core.viewpoint import FULL_CIRCLE, ViewEstimate
from pipeline.refusal import Refusal
from pipeline.skeleton import WALKER15

_UNSEEN = 1e-13  # eigenvalue of A, relative to the largest, at which a view does not show its direction
_NEAR = 0.15  # how far the series of all joints may move the guess
_NODES = 13  # of the Chebyshev series of explained power over two cells of the grid: exact to rounding
_BLOCK = 200_000  # numbers of a design that are worked on at a time: they stay in cache


@dataclass(frozen=True)
class ViewedClip:
    """One clip as A views show it, and what they do not show, for judging a reconstruction.

    Attributes
    ----------
    view_angle_rad, frequency_hz : (A,)
    coefficients : (A, 1 + 2H, J, 3)
        Regression of the clip at each view's own frequency, time zero at the first frame, mm.
    residual_covariance : (A, J, 3, 3)
        Mean over the clip of what the regression leaves, times itself, mm².
    """

    view_angle_rad: np.ndarray
    frequency_hz: np.ndarray
    coefficients: np.ndarray
    residual_covariance: np.ndarray

    @property
    def image(self) -> np.ndarray:
        """The observation (A, 1 + 2H, J, 2): all that an estimate may use, with the frequency."""
        across = camera.horizontal(self.coefficients, self.view_angle_rad[:, None, None])
        return np.stack([across, camera.vertical(self.coefficients)], axis=-1)

    @property
    def missing(self) -> np.ndarray:
        """The truth in the missing dimension (A, 1 + 2H, J), in the clip's own phase."""
        return camera.missing_dimension(self.coefficients, self.view_angle_rad[:, None, None])

    @property
    def residual_power(self) -> np.ndarray:
        """Mean square (A, J) in the missing dimension of what the regression leaves, mm²."""
        away = camera.missing_dimension(np.eye(3), self.view_angle_rad[:, None])
        return np.einsum("ac,ajcd,ad->aj", away, self.residual_covariance, away)


def _regression(
    frequencies_hz: np.ndarray, times_s: np.ndarray, values: np.ndarray, harmonics: int
) -> tuple[np.ndarray, np.ndarray]:
    """Q^T values (C, 1 + 2H, D) and R (C, 1 + 2H, 1 + 2H) of the design Q R at C frequencies; values (T, D)."""
    size = max(1, _BLOCK // (len(times_s) * (1 + 2 * harmonics)))
    projected, triangles = [], []
    for first in range(0, len(frequencies_hz), size):
        cycles = frequencies_hz[first : first + size, None] * times_s
        basis, triangle = np.linalg.qr(design(1.0, cycles, harmonics))
        projected.append(np.swapaxes(basis, 1, 2) @ values)
        triangles.append(triangle)
    return np.concatenate(projected), np.concatenate(triangles)


def observe(
    positions: np.ndarray,
    frame_rate_hz: float,
    view_angles_rad: np.ndarray,
    *,
    harmonics: int = 2,
    mirror: tuple[int, ...] = WALKER15.mirror,
) -> ViewedClip:
    """One clip as each of A views shows it, at the frequency that the view alone gives [zhang2007 3.1].

    Parameters
    ----------
    positions : (T, J, 3) mm
    frame_rate_hz : float
    view_angles_rad : (A,)
    harmonics : int
    mirror : J indices
        Which joint is whose mirror image.

    Raises
    ------
    Refusal
        If positions are not finite or left and right do not move apart, or the clip is too short or too slowly
        sampled.

    Notes
    -----
    The regression at f explains cos² |Q'X|² + 2 sin cos Q'X·Q'Y + sin² |Q'Y|² + |Q'Z|² of a view, Q the
    orthonormal design: four numbers serve all views.  Left and right do the same half a cycle apart, so their
    difference has hardly a second harmonic: the frequency between 0.4 and 1.6 Hz, with a whole cycle in the
    clip, that explains most of it is the guess, and the series of all joints moves that by at most 15 %.
    Without the guess, a slow drift and the fundamental pass for two harmonics of half the frequency in 3 % of
    the views of recorded overground walks, mostly frontal ones.
    """
    view, values, times = _clip(positions, frame_rate_hz, view_angles_rad, harmonics, mirror)
    frames, joints = len(values), values.shape[1]
    centre = values.mean(axis=0)
    values = values - centre
    flat = values.reshape(frames, -1)
    frequency = _frequency(view, values, times, harmonics, mirror)
    projected, triangle = _regression(frequency, times, flat, harmonics)
    coefficients = np.linalg.solve(triangle, projected).reshape(len(view), -1, joints, 3)
    coefficients[:, 0] += centre
    projected = projected.reshape(coefficients.shape)
    explained = np.einsum("abjc,abjd->ajcd", projected, projected)
    residual = (np.einsum("tjc,tjd->jcd", values, values) - explained) / frames
    return ViewedClip(view, frequency, coefficients, residual)


def _clip(
    positions: np.ndarray,
    frame_rate_hz: float,
    view_angles_rad: np.ndarray,
    harmonics: int,
    mirror: tuple[int, ...],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """View angles (A,), positions (T, J, 3) and times (T,), or why they cannot be used."""
    view = np.atleast_1d(np.asarray(view_angles_rad, dtype=float))
    values = np.asarray(positions, dtype=float)
    if view.ndim != 1 or not len(view) or not np.isfinite(view).all():
        raise Refusal("no list of finite view angles", expected="(A,) rad, A > 0", received=str(view))
    if values.ndim != 3 or values.shape[-1] != 3:
        raise Refusal("positions have the wrong shape", expected="(T, J, 3)", received=str(values.shape))
    if harmonics < 1:
        raise Refusal("no harmonics", expected="1 or more", received=str(harmonics))
    if not 2 * harmonics * SEARCH_HZ[1] < frame_rate_hz < np.inf:
        raise Refusal(
            f"the frame rate is too low for {harmonics} harmonics of a walk",
            expected=f"more than {2 * harmonics * SEARCH_HZ[1]:g} Hz",
            received=f"{frame_rate_hz:g}",
        )
    if len(values) <= max(1 + 2 * harmonics, frame_rate_hz / SEARCH_HZ[1]):
        raise Refusal(
            "the clip is too short for a walking cycle",
            expected=f"more than {1 / SEARCH_HZ[1]:.2f} s and {1 + 2 * harmonics} frames",
            received=f"{len(values)} frames at {frame_rate_hz:g} Hz",
        )
    if not np.isfinite(values).all():
        frame, joint = np.argwhere(~np.isfinite(values))[0][:2]
        raise Refusal(f"a position is not finite at frame {frame}, joint {joint}")
    joints = range(values.shape[1])
    if sorted(mirror) != list(joints) or any(mirror[mirror[joint]] != joint for joint in joints):
        raise Refusal(
            "the mirror pairs are not those of the joints",
            expected=f"{len(joints)} joints, each the mirror image of its own",
            received=str(mirror),
        )
    if not np.ptp(values - values[:, list(mirror)], axis=0).any():
        raise Refusal("left and right do not move apart in the clip: it shows no cycle")
    return view, values, np.arange(len(values)) / frame_rate_hz


def _frequency(
    view: np.ndarray, values: np.ndarray, times: np.ndarray, harmonics: int, mirror: tuple[int, ...]
) -> np.ndarray:
    """Frequency (A,) of what each view shows of centred values (T, J, 3)."""
    c, s = np.cos(view), np.sin(view)
    weights = np.stack([c**2, 2 * s * c, s**2, np.ones_like(c)], axis=-1)

    def explained(frequencies: np.ndarray, motion: np.ndarray, harmonics: int) -> np.ndarray:
        """Four numbers (C, 4), whose weighted sum is what a regression explains of the view."""
        axes = motion.transpose(0, 2, 1).reshape(len(motion), -1)
        x, y, z = np.split(_regression(frequencies, times, axes, harmonics)[0], 3, axis=-1)
        return np.stack([(a * b).sum(axis=(1, 2)) for a, b in ((x, x), (x, y), (y, y), (z, z))], axis=-1)

    duration = len(times) * times[1]
    lowest = max(SEARCH_HZ[0], 1.0 / duration)
    grid = np.linspace(lowest, SEARCH_HZ[1], int(np.ceil((SEARCH_HZ[1] - lowest) * duration / 0.05)) + 2)
    left = [joint for joint, other in enumerate(mirror) if joint < other]
    apart = values[:, left] - values[:, [mirror[joint] for joint in left]]
    guess = grid[(weights @ explained(grid, apart, 1).T).argmax(axis=1), None]
    power = weights @ explained(grid, values, harmonics).T
    near = np.abs(grid - guess) <= _NEAR * guess
    best = np.where(near, power, -np.inf).argmax(axis=1)
    every = np.arange(len(view))
    low = np.where(near[every, np.maximum(best - 1, 0)] & (best > 0), -1.0, 0.0)
    high = np.where(near[every, np.minimum(best + 1, len(grid) - 1)] & (best < len(grid) - 1), 1.0, 0.0)
    cells, which = np.unique(best, return_inverse=True)
    step, nodes = grid[1] - grid[0], chebyshev.chebpts2(_NODES)
    sampled = explained((grid[cells, None] + step * nodes).ravel(), values, harmonics)
    series = np.linalg.solve(chebyshev.chebvander(nodes, _NODES - 1), sampled.reshape(len(cells), _NODES, 4))
    curve = np.einsum("anw,aw->na", series[which], weights)
    slope, bend = chebyshev.chebder(curve), chebyshev.chebder(curve, 2)
    place = np.zeros(len(view))
    for _ in range(20):
        falls = chebyshev.chebval(place, bend, tensor=False)
        newton = chebyshev.chebval(place, slope, tensor=False) / np.where(falls < 0, falls, -np.inf)
        moved = np.clip(place - newton, low, high)
        settled, place = np.abs(moved - place).max() < 1e-12, moved
        if settled:
            break
    return grid[best] + step * place


def turning(phase_rad: np.ndarray, harmonics: int) -> np.ndarray:
    """f (…, 1 + 2H) = (1, cos phi, sin phi, cos 2 phi, …): weights of a shift by phi.

    Examples
    --------
    >>> np.round(turning(np.pi / 2, 2), 12) + 0.0
    array([ 1.,  0.,  1., -1.,  0.])
    """
    angle = np.asarray(phase_rad, dtype=float)[..., None] * np.arange(1, harmonics + 1)
    waves = np.stack([np.cos(angle), np.sin(angle)], axis=-1).reshape(*angle.shape[:-1], -1)
    return np.concatenate([np.ones((*angle.shape[:-1], 1)), waves], axis=-1)


def turned(coefficients: np.ndarray) -> np.ndarray:
    """U (A, 1 + 2H, (1 + 2H) J): ``turning(phi) @ U`` is `shift` of (A, 1 + 2H, J) by phi, flat."""
    blocks = coefficients.shape[1]
    rows = np.zeros((len(coefficients), blocks, *coefficients.shape[1:]))
    rows[:, 0, 0] = coefficients[:, 0]
    for p in range(1, blocks, 2):
        q = p + 1
        rows[:, p, p], rows[:, p, q] = coefficients[:, p], coefficients[:, q]
        rows[:, q, p], rows[:, q, q] = coefficients[:, q], -coefficients[:, p]
    return rows.reshape(len(coefficients), blocks, -1)


def lowest_phase(forms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The phase (n,) in (-pi, pi] at which f^T M f is lowest, and that cost (n,), for n forms M (n, 1+2H, 1+2H)."""
    size = forms.shape[-1]
    order = np.arange(1, size)  # f f^T holds harmonics up to twice those of the walk
    samples = turning(np.arange(2 * size - 1) * (2 * np.pi / (2 * size - 1)), (size - 1) // 2)
    outer = (samples[:, :, None] * samples[:, None, :]).reshape(len(samples), -1)
    series = np.fft.rfft(outer, axis=0) * (2.0 / len(samples))
    expansion = np.concatenate([series[:1].real / 2, series[1:].real, -series[1:].imag]).T
    waves = forms.reshape(len(forms), -1) @ expansion  # constant, cosines, sines
    constant, cosines, sines = waves[:, 0], waves[:, 1:size], waves[:, size:]
    step = 2 * np.pi / (16 * (size - 1))
    angles = step * np.arange(16 * (size - 1))[:, None] * order
    cost = waves @ np.concatenate([np.ones((len(angles), 1)), np.cos(angles), np.sin(angles)], axis=1).T
    before, after = np.roll(cost, 1, axis=1), np.roll(cost, -1, axis=1)
    # The cell nearest to the minimum lies above it by no more than this; only such cells need refining.
    slack = step**2 / 8 * (np.hypot(cosines, sines) @ order**2)
    candidate = (cost <= before) & (cost <= after) & (cost <= (cost.min(axis=1) + slack)[:, None])
    row, cell = np.nonzero(candidate)
    phase = step * cell
    lower, upper = phase - step, phase + step
    a, b = cosines[row], sines[row]
    for _ in range(50):
        c, s = np.cos(phase[:, None] * order), np.sin(phase[:, None] * order)
        slope = ((b * c - a * s) * order).sum(axis=1)
        bend = -((a * c + b * s) * order**2).sum(axis=1)
        lower, upper = np.where(slope > 0, lower, phase), np.where(slope > 0, phase, upper)
        moved = phase - slope / np.where(bend > 0, bend, np.inf)
        moved = np.where((bend > 0) & (moved >= lower) & (moved <= upper), moved, 0.5 * (lower + upper))
        settled, phase = np.abs(moved - phase).max() < 1e-12, moved
        if settled:
            break
    c, s = np.cos(phase[:, None] * order), np.sin(phase[:, None] * order)
    cost = constant[row] + (a * c + b * s).sum(axis=1)
    ranked = np.lexsort((cost, row))
    first = ranked[np.unique(row[ranked], return_index=True)[1]]
    return np.pi - np.mod(np.pi - phase[first], 2 * np.pi), cost[first]


class _Turned:
    """Observations under every phase, and what M is made of when one model is held against them."""

    def __init__(
        self, model: LinearModel, white: WhitenedModel, image: np.ndarray, frequency_hz: np.ndarray | None
    ) -> None:
        image = np.asarray(image, dtype=float)
        points, trailing = len(white.mean_x), len(white.mean_z) - len(white.mean_x)
        if image.ndim != 4 or image.shape[-1] != 2 or image.shape[1] * image.shape[2] != points:
            raise Refusal(
                "the observation has another size than the model",
                expected=f"(A, 1 + 2H, J, 2) with {points} points",
                received=str(image.shape),
            )
        frequency = np.empty(0) if frequency_hz is None else np.asarray(frequency_hz, dtype=float)
        if trailing and frequency.shape != (len(image),):
            raise Refusal(
                "the model knows the frequency, the observation does not give it",
                expected=f"({len(image)},) hertz",
                received="none" if frequency_hz is None else str(frequency.shape),
            )
        self.white = white
        self.across, self.up = turned(image[..., 0]), turned(image[..., 1])
        if trailing:
            last = np.zeros((*self.up.shape[:2], 1))
            last[:, 0, 0] = model.last_scale * 2 * np.pi * frequency
            self.up = np.concatenate([self.up, last], axis=-1)
        if not (np.isfinite(self.across).all() and np.isfinite(self.up).all()):
            raise Refusal("an observed value is not finite")
        self._products = [self.across @ white.bx, self.across @ white.by, self.up @ white.bz]
        self._overlaps = [self.across @ white.mean_x, self.across @ white.mean_y, self.up @ white.mean_z]
        self._gram = self.across @ np.swapaxes(self.across, 1, 2) + self.up @ np.swapaxes(self.up, 1, 2)

    def against(
        self, c: np.ndarray, s: np.ndarray, rows: np.ndarray | slice = slice(None)
    ) -> tuple[np.ndarray, np.ndarray]:
        """G (n, 1 + 2H, 1 + 2H) and H (n, 1 + 2H, N) at cosine and sine of one angle, or of one for each row."""
        white = self.white
        x, y, z = (part[rows] for part in self._products)
        H = c[:, None, None] * x + s[:, None, None] * y + z
        c, s = c[:, None], s[:, None]
        mean = c * white.mean_x + s * white.mean_y
        H[:, 0] -= c * (mean @ white.bx) + s * (mean @ white.by) + white.mean_z @ white.bz
        x, y, z = (part[rows] for part in self._overlaps)
        overlap = c * x + s * y + z
        G = self._gram[rows] - 0.0
        G[:, 0] -= overlap
        G[:, :, 0] -= overlap
        G[:, 0, 0] += (mean**2).sum(axis=1) + white.mean_z @ white.mean_z
        return G, H

    def at(
        self, phase_rad: np.ndarray, rows: np.ndarray | slice = slice(None)
    ) -> tuple[np.ndarray, np.ndarray]:
        """Horizontal and vertical of the observations, flat, shifted by a phase each."""
        f = turning(phase_rad, self.across.shape[1] // 2)[:, None]
        return (f @ self.across[rows])[:, 0], (f @ self.up[rows])[:, 0]


def _inverse(values: np.ndarray, noise_variance: float | None) -> np.ndarray:
    """1 / (s + sigma²) of the eigenvalues s (…, N) of A; for least squares zero where the view shows nothing."""
    if noise_variance is not None:
        return 1.0 / (values + noise_variance)
    seen = values > _UNSEEN * values.max(axis=-1, keepdims=True)
    return np.where(seen, 1.0, 0.0) / np.where(seen, values, 1.0)


@dataclass(frozen=True)
class PhasedViews:
    """One walker reconstructed from A known views, its phase found too.

    Attributes
    ----------
    phase_rad : (A,)
        Phase at the first frame, in (-pi, pi].
    cost : (A,)
        The minimum over coefficients and phase, mm².
    coefficients : (A, N)
        k in mm.
    missing : (A, 1 + 2H, J)
        Reconstructed Fourier coefficients of the missing dimension, in the clip's own phase as the image is.
    """

    phase_rad: np.ndarray
    cost: np.ndarray
    coefficients: np.ndarray
    missing: np.ndarray


def from_known_views(
    model: LinearModel,
    image: np.ndarray,
    view_angles_rad: np.ndarray,
    *,
    noise_variance: float | None,
    frequency_hz: np.ndarray | None = None,
) -> PhasedViews:
    """Missing dimension and phase from each of A known views [zhang2007 3.9, 3.15] with the phase unknown.

    Parameters
    ----------
    model : LinearModel
        Learnt without this walker, of walkers at phase zero.
    image : (A, 1 + 2H, J, 2) mm
        `ViewedClip.image`.
    view_angles_rad : (A,)
    noise_variance : float or None
        None for least squares (approach I), sigma² in mm² for MAP (approach II).
    frequency_hz : (A,), optional
        `ViewedClip.frequency_hz`; needed by a model of 226 numbers.

    Raises
    ------
    Refusal
        If the observation does not fit the model or is not finite, or the noise variance is not positive.
    """
    if noise_variance is not None:
        check_noise_variance(noise_variance)
    white = whiten(model, prior=noise_variance is not None)
    rows = _Turned(model, white, image, frequency_hz)
    c, s = np.cos(view_angles_rad), np.sin(view_angles_rad)
    G, H = rows.against(c, s)
    values, vectors = np.linalg.eigh(white.gram(c, s))
    inverse = _inverse(values, noise_variance)[:, None]
    K = H @ vectors
    phase, cost = lowest_phase(G - (K * inverse) @ np.swapaxes(K, 1, 2))
    f = turning(phase, image.shape[1] // 2)[:, None]
    z = ((f @ K * inverse) @ np.swapaxes(vectors, 1, 2))[:, 0]
    x, y = white.mean_x + z @ white.bx.T, white.mean_y + z @ white.by.T
    missing = (-s[:, None] * x + c[:, None] * y).reshape(image.shape[:3])
    return PhasedViews(phase, cost, z * white.spread, shift(missing[..., None], -phase)[..., 0])


def error_path(model: LinearModel, clip: ViewedClip, noise_variances: np.ndarray) -> np.ndarray:
    """E_a of one walker for every view and every sigma², (A, S) mm², each sigma² with the phase that it finds.

    The work of `reconstruction.error_path` with M formed for each sigma²; a shift moves no error, so errors are
    taken at the model's phase.  Add the residual power of the clip for errors against the motion itself.
    """
    noise_variances = np.asarray(noise_variances, dtype=float)
    for value in noise_variances:
        check_noise_variance(value)
    white = whiten(model)
    rows = _Turned(model, white, clip.image, clip.frequency_hz)
    c, s = np.cos(clip.view_angle_rad), np.sin(clip.view_angle_rad)
    G, H = rows.against(c, s)
    values, vectors = np.linalg.eigh(white.gram(c, s))
    K = H @ vectors
    blocks, joints = clip.coefficients.shape[1:3]
    truth = turned(clip.missing)
    truth[:, 0] -= -s[:, None] * white.mean_x + c[:, None] * white.mean_y
    varying = (-s[:, None, None] * white.bx + c[:, None, None] * white.by) @ vectors
    weights = np.repeat(errors.parseval_weights(blocks), joints) / joints
    constant = (truth * weights) @ np.swapaxes(truth, 1, 2)
    linear = (truth * weights) @ varying
    quadratic = np.swapaxes(varying * weights[:, None], 1, 2) @ varying
    path = np.empty((len(c), len(noise_variances)))
    for a in range(len(c)):
        inverse = 1.0 / (values[a] + noise_variances[:, None])
        outer = (K[a][:, None] * K[a]).reshape(-1, K.shape[-1])
        phase, _ = lowest_phase((G[a].ravel() - inverse @ outer.T).reshape(-1, blocks, blocks))
        f = turning(phase, blocks // 2)
        y = (f @ K[a]) * inverse
        path[a] = ((f @ constant[a]) * f).sum(axis=1)
        path[a] += ((y @ quadratic[a] - 2.0 * (f @ linear[a])) * y).sum(axis=1)
    return path


@dataclass(frozen=True)
class PhasedEstimate(ViewEstimate):
    """View angles, coefficients and phases of A observations.

    Attributes
    ----------
    phase_rad : (A,)
        Phase at the first frame, in (-pi, pi]; the others are those of `ViewEstimate`.
    """

    phase_rad: np.ndarray


def estimate(
    model: LinearModel,
    image: np.ndarray,
    *,
    noise_variance: float | None,
    frequency_hz: np.ndarray | None = None,
    angle_range_rad: tuple[float, float] = FULL_CIRCLE,
    grid_step_rad: float = np.pi / 90,
) -> PhasedEstimate:
    """View angle, phase and coefficients together [zhang2007 4.5, 4.6] [zhang2004 14], the phase unknown too.

    Parameters and refusals are those of `from_known_views`; `angle_range_rad` bounds the candidates, and the two
    lowest minima of their grid are refined, so that `runner_up_cost` is the exact cost of the second.
    """
    if noise_variance is not None:
        check_noise_variance(noise_variance)
    low, high = angle_range_rad
    if not high > low or not grid_step_rad > 0:
        raise Refusal(
            "the range of view angles is empty",
            expected="low < high and step > 0",
            received=f"{np.degrees(low):g}..{np.degrees(high):g} deg by {np.degrees(grid_step_rad):g}",
        )
    white = whiten(model, prior=noise_variance is not None)
    rows = _Turned(model, white, image, frequency_hz)
    grid, closed = view_search.candidates(low, high, grid_step_rad)
    c, s = np.cos(grid), np.sin(grid)
    values, vectors = np.linalg.eigh(white.gram(c, s))
    roots = vectors * np.sqrt(_inverse(values, noise_variance))[:, None]
    cost = np.empty((len(rows.across), len(grid)))
    for g in range(len(grid)):
        G, H = rows.against(c[g : g + 1], s[g : g + 1])
        K = H @ roots[g]
        cost[:, g] = lowest_phase(G - K @ np.swapaxes(K, 1, 2))[1]
    height, start = view_search.local_minima(cost, grid, closed=closed)
    first, every = height.argmin(axis=1), np.arange(len(cost))
    second, other = view_search.lowest_but(height, first, closed=closed)
    contenders = np.flatnonzero(np.isfinite(other))
    which, cell = np.concatenate([every, contenders]), np.concatenate([first, second[contenders]])
    step = grid[1] - grid[0]
    lower, upper = grid[cell] - step, grid[cell] + step
    if not closed:
        lower, upper = np.maximum(lower, low), np.minimum(upper, high)
    found = _descend(rows, which, start[which, cell], lower, upper, noise_variance or 0.0)
    best, rival = every.copy(), np.full(len(every), -1)
    rival[contenders] = len(every) + np.arange(len(contenders))
    swapped = contenders[found[2][rival[contenders]] < found[2][contenders]]
    best[swapped], rival[swapped] = rival[swapped], swapped
    runner_up = np.where(rival >= 0, found[2][rival], np.inf)
    angle, z, lowest, phase, converged, iterations = (part[best] for part in found)
    angle = np.pi - np.mod(np.pi - angle, 2 * np.pi)  # in (-pi, pi]
    return PhasedEstimate(angle, z * white.spread, lowest, runner_up, converged, iterations, phase)


def _profile(
    rows: _Turned, which: np.ndarray, angle: np.ndarray, ridge: float, *, bend: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """J lowest over phase and coefficients at one angle per row: J, z, J', phase and J'' at a fixed phase.

    Phase and coefficients are at their minimum, so J' is the partial derivative there.
    """
    c, s = np.cos(angle), np.sin(angle)
    G, H = rows.against(c, s, which)
    gram = rows.white.gram(c, s)
    floor = ridge or np.finfo(float).eps * float(np.trace(gram, axis1=1, axis2=2).max())
    forms = G - H @ np.linalg.solve(gram + floor * np.eye(gram.shape[-1]), np.swapaxes(H, 1, 2))
    phase, _ = lowest_phase(forms)
    across, up = rows.at(phase, which)
    cost, z, slope, curvature = view_search.reduced_cost(rows.white, across, up, angle, ridge, bend=bend)
    return cost, z, slope, phase, curvature


def _descend(
    rows: _Turned, which: np.ndarray, start: np.ndarray, lower: np.ndarray, upper: np.ndarray, ridge: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The zero of J' inside a shrinking bracket: angle, z, J, phase, converged, steps.

    The first step takes the curvature at a fixed phase, which is never too small; later ones that of the last
    two slopes; a step out of the bracket, or uphill, becomes a bisection.
    """
    angle, lower, upper = start.copy(), lower.copy(), upper.copy()
    steps, converged = np.zeros(len(angle), dtype=int), np.zeros(len(angle), dtype=bool)
    last_angle, last_slope, curvature = angle.copy(), np.zeros(len(angle)), np.zeros(len(angle))
    for step in range(60):
        active = np.flatnonzero(~converged)
        if not len(active):
            break
        here = angle[active]
        _, _, slope, _, bend = _profile(rows, which[active], here, ridge, bend=step == 0)
        if step:
            travelled = here - last_angle[active]
            far = np.abs(travelled) > 1e-9
            secant = (slope - last_slope[active]) / np.where(far, travelled, 1.0)
            bend = np.where(far, secant, curvature[active])
        last_angle[active], last_slope[active], curvature[active] = here, slope, bend
        rising = slope > 0
        upper[active[rising]] = here[rising]
        lower[active[~rising]] = here[~rising]
        moved = here - slope / np.where(bend > 0, bend, np.inf)
        inside = (bend > 0) & (moved >= lower[active]) & (moved <= upper[active])
        moved = np.where(inside, moved, 0.5 * (lower[active] + upper[active]))
        angle[active] = moved
        steps[active] += 1
        converged[active] = np.abs(moved - here) < 1e-10
    cost, z, _, phase, _ = _profile(rows, which, angle, ridge, bend=False)
    return angle, z, cost, phase, converged, steps
