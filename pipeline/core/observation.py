"""Fourier series of a clip in one view, at the frequency that the view alone gives.

The papers take frequency and phase from the 3D motion before it is projected [zhang2007 3.1, 3.4].  Here nothing
but the view is used: time zero is the first frame, and the phase is left to
the fit (`reconstruction.from_known_views_unknown_phase`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from pipeline.core import camera, newton
from pipeline.core.choice import first_lowest
from pipeline.core.fourier import SEARCH_HZ, design
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput, require_range, require_shape

_NEAR = 0.15
"""Largest change, as a fraction, of the guess of the frequency by the series of all joints."""

_NODES = 13
"""Nodes of the Chebyshev series of explained power over two cells of the grid: exact to rounding."""

_BLOCK = 200_000
"""Numbers of a design that are worked on at a time: they stay in cache."""


@dataclass(frozen=True)
class ViewedClip:
    """One clip as A views show it, and what they do not show, for judging a reconstruction.

    Attributes
    ----------
    view_angle_rad, frequency_hz : (A,)
    coefficients : (A, 1 + 2H, J, 3)
        Regression of the clip at each view's own frequency, time zero at the first frame, mm.
    """

    view_angle_rad: np.ndarray
    frequency_hz: np.ndarray
    coefficients: np.ndarray

    @property
    def image(self) -> np.ndarray:
        """The observation (A, 1 + 2H, J, 2): all that an estimate may use, with the frequency."""
        across = camera.horizontal(self.coefficients, self.view_angle_rad[:, None, None])
        return np.stack([across, camera.vertical(self.coefficients)], axis=-1)

    @property
    def missing(self) -> np.ndarray:
        """The truth in the missing dimension (A, 1 + 2H, J), in the clip's own phase."""
        return camera.missing_dimension(self.coefficients, self.view_angle_rad[:, None, None])


def observe(
    positions: np.ndarray,
    frame_rate_hz: float,
    view_angles_rad: np.ndarray,
    *,
    harmonics: int = 2,
) -> ViewedClip:
    """One clip as each of A views shows it, at the frequency that the view alone gives [zhang2007 3.1].

    Parameters
    ----------
    positions : (T, 15, 3)
        In WALKER15 order, mm.
    frame_rate_hz : float
    view_angles_rad : (A,)
    harmonics : int

    Raises
    ------
    InvalidInput
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
    view, values, times = _clip(positions, frame_rate_hz, view_angles_rad, harmonics)
    frames, joints = len(values), values.shape[1]
    centre = values.mean(axis=0)
    values = values - centre
    flat = values.reshape(frames, -1)
    frequency = _frequency(view, values, times, harmonics)
    projected, triangle = _regression(frequency, times, flat, harmonics)
    coefficients = np.linalg.solve(triangle, projected).reshape(len(view), -1, joints, 3)
    coefficients[:, 0] += centre
    return ViewedClip(view, frequency, coefficients)


def _clip(
    positions: np.ndarray,
    frame_rate_hz: float,
    view_angles_rad: np.ndarray,
    harmonics: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """View angles (A,), positions (T, J, 3) and times (T,), or why they cannot be used."""
    view = np.atleast_1d(np.asarray(view_angles_rad, dtype=float))
    values = require_shape("positions", np.asarray(positions, dtype=float), ("T", len(WALKER15.joints), 3))
    if view.ndim != 1 or not len(view) or not np.isfinite(view).all():
        raise InvalidInput("no list of finite view angles", expected="(A,) rad, A > 0", received=str(view))
    require_range("harmonics", harmonics, at_least=1, whole=True)
    if not 2 * harmonics * SEARCH_HZ[1] < frame_rate_hz < np.inf:
        raise InvalidInput(
            f"the frame rate is too low for {harmonics} harmonics of a walk",
            expected=f"more than {2 * harmonics * SEARCH_HZ[1]:g} Hz",
            received=f"{frame_rate_hz:g}",
        )
    if len(values) <= max(1 + 2 * harmonics, frame_rate_hz / SEARCH_HZ[1]):
        raise InvalidInput(
            "the clip is too short for a walking cycle",
            expected=f"more than {1 / SEARCH_HZ[1]:.2f} s and {1 + 2 * harmonics} frames",
            received=f"{len(values)} frames at {frame_rate_hz:g} Hz",
        )
    if not np.isfinite(values).all():
        frame, joint = np.argwhere(~np.isfinite(values))[0][:2]
        raise InvalidInput(f"a position is not finite at frame {frame}, joint {joint}")
    if not np.ptp(values - values[:, list(WALKER15.mirror)], axis=0).any():
        raise InvalidInput("left and right do not move apart in the clip: it shows no cycle")
    return view, values, np.arange(len(values)) / frame_rate_hz


def _frequency(view: np.ndarray, values: np.ndarray, times: np.ndarray, harmonics: int) -> np.ndarray:
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
    left = [joint for joint, other in enumerate(WALKER15.mirror) if joint < other]
    apart = values[:, left] - values[:, [WALKER15.mirror[joint] for joint in left]]
    guess = grid[first_lowest(-weights @ explained(grid, apart, 1).T), None]
    power = weights @ explained(grid, values, harmonics).T
    near = np.abs(grid - guess) <= _NEAR * guess
    best = first_lowest(np.where(near, -power, np.inf))
    every = np.arange(len(view))
    low = np.where(near[every, np.maximum(best - 1, 0)] & (best > 0), -1.0, 0.0)
    high = np.where(near[every, np.minimum(best + 1, len(grid) - 1)] & (best < len(grid) - 1), 1.0, 0.0)
    cells, which = np.unique(best, return_inverse=True)
    step, nodes = grid[1] - grid[0], chebyshev.chebpts2(_NODES)
    sampled = explained((grid[cells, None] + step * nodes).ravel(), values, harmonics)
    series = np.linalg.solve(chebyshev.chebvander(nodes, _NODES - 1), sampled.reshape(len(cells), _NODES, 4))
    curve = np.einsum("anw,aw->na", series[which], weights)
    slope, bend = (
        -chebyshev.chebder(curve),
        -chebyshev.chebder(curve, 2),
    )  # the explained power is to be largest

    def derivatives(rows: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return (
            chebyshev.chebval(place, slope[:, rows], tensor=False),
            chebyshev.chebval(place, bend[:, rows], tensor=False),
        )

    place = newton.minimise(
        derivatives, np.zeros(len(view)), low, high, tolerance=1e-12, most_iterations=50
    ).at
    return grid[best] + step * place


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
