"""Grid search for the initial stride frequency, heading and phase of a walk, after distance and path are removed.

Symbols
-------
``y``     Fourier coefficients of the image, two harmonics, mm
``J``     ``|L^-1 (y - mu)|² + log |Sigma|``: cost of the image at a heading and phase

Several frequencies, headings and phases go on to the refinement, which decides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core.fourier import SEARCH_HZ, design
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput
from walk3d.film.walk.path import Path, lowest_hz, often_seen, regress_tracks, straighten
from walk3d.film.walk.prior import GRID_BLOCKS, Grid, Prior, belt_speed, projected_grid

PHASES = 36
_SIDES = [[WALKER15.index(f"{side}_{joint}") for joint in ("hip", "ankle")] for side in ("left", "right")]
OVERGROUND_SHARE = 0.4
"""Speed of the path, as a share of the average walker's belt speed, above which the walk is overground."""
MAX_STARTS = 4
START_SEPARATION = (np.radians(25.0), np.radians(50.0), 0.06)
"""Minimum difference between two starts of the refinement, in heading, phase or relative frequency."""
_FOURTH_START_COST = 150.0
"""Difference from the smallest cost, up to which a fourth start of the refinement is tried."""


@dataclass(frozen=True)
class SearchPoint:
    """Point of the grid search: stride frequency, heading and phase."""

    frequency_hz: float
    heading_rad: float
    phase_rad: float


@dataclass(frozen=True)
class Start(SearchPoint):
    """Initial estimate from which a refinement starts.

    Attributes
    ----------
    cost : float
        Cost J on the grid.
    """

    cost: float


@dataclass(frozen=True)
class Starts:
    """Starts of the refinement, the best first, and further results of the grid search.

    Attributes
    ----------
    starts : tuple of Start
    path : Path
    overground : bool
    least_distance : float
        Squared distance in the smallest J, without the term of the path, over the number of coefficients: about 1 for
        an average walker.
    ankles_together : float
        Correlation of the ankles' motion in the image, each about its hip, within ±1; 0 if a leg is not seen.
    headings_rad : (72,)
    heading_cost : (72,)
        Smallest J at each heading, with the term of the path.
    """

    starts: tuple[Start, ...]
    path: Path
    overground: bool
    least_distance: float
    ankles_together: float
    headings_rad: np.ndarray
    heading_cost: np.ndarray


def frequency_candidates(
    metric: np.ndarray, weights: np.ndarray, times: np.ndarray, log_frequency: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return likely stride frequencies, the best first, with their costs and the Fourier coefficients of the image.

    Parameters
    ----------
    metric : (T, 15, 2)
        mm, path removed.
    weights : (T, 15)
    times : (T,)
    log_frequency : (2,)
        Mean and standard deviation of the population.

    Returns
    -------
    frequencies_hz : (n,)
    cost : (n,)
        Twice the negative log probability of the residual at each frequency.
    coefficients : (n, 15, 5, 2)
        By joint, coefficient and image axis, mm.
    """
    duration = times[-1] - times[0]
    grid = np.exp(np.arange(np.log(lowest_hz(duration)), np.log(SEARCH_HZ[1]) + 0.01, 0.02))

    def columns(frequencies: np.ndarray) -> np.ndarray:
        drift = np.broadcast_to((times / duration)[:, None], (len(frequencies), len(times), 1))
        return np.concatenate([design(frequencies[:, None], times, 2), drift], axis=2)

    designs = columns(grid)
    count = 2.0 * (weights > 0).sum()

    def cost_of(frequencies: np.ndarray, squares: np.ndarray) -> np.ndarray:
        far = (np.log(frequencies) - log_frequency[0]) / (1.5 * log_frequency[1])
        return count / 16.0 * np.log(squares) + 0.5 * far**2

    coefficients, squares = regress_tracks(designs, metric, weights)
    best = np.argmin(cost_of(grid, squares))
    off = np.linalg.norm(metric - np.einsum("tn,jnd->tjd", designs[best], coefficients[best]), axis=-1)
    scale = max(np.median(off[weights > 0]) / 1.1774, 1e-9)
    w = weights / (1.0 + (off / (2.385 * scale)) ** 2)
    cost = cost_of(grid, regress_tracks(designs, metric, w)[1])
    padded = np.concatenate([[np.inf], cost, [np.inf]])
    minima = np.flatnonzero((cost <= padded[:-2]) & (cost < padded[2:]))
    minima = minima[np.argsort(cost[minima], kind="stable")][:3]
    proposals = [*grid[minima], 2.0 * grid[minima[0]], 0.5 * grid[minima[0]]]
    accepted: list[float] = []
    for frequency in proposals:
        inside = max(0.9 * SEARCH_HZ[0], 0.4 / duration) <= frequency <= 1.25 * SEARCH_HZ[1]
        if inside and all(abs(np.log(frequency / other)) > 0.05 for other in accepted):
            accepted.append(float(frequency))
    frequencies = np.array(accepted)
    coefficients, squares = regress_tracks(columns(frequencies), metric, w)
    return frequencies, cost_of(frequencies, squares), coefficients[:, :, :GRID_BLOCKS]


def _grid_cost(grid: Grid, images: np.ndarray, phases: np.ndarray) -> np.ndarray:
    """Return the cost J (F, 72, P) of the image's Fourier coefficients (F, n, 5, 2) at all headings and phases."""
    y = np.swapaxes(images, 1, 2).copy()  # (F, 5, n, 2)
    y[:, 0] -= y[:, 0].mean(axis=1, keepdims=True)
    # From the opposite side the image is mirrored.
    y = np.concatenate([y, y * [-1.0, 1.0]]).reshape(2 * len(images), GRID_BLOCKS, -1)
    # Zeros are skipped: a harmonic has only its own coefficients, and the factors are lower triangular.
    whitened = np.zeros((len(grid.whitened_mean), *y.shape[:2], grid.whitened_mean.shape[1]))
    for first, last in ((0, 1), (1, 3), (3, 5)):
        rows, start = y[:, first:last].reshape(len(y), 1, -1), first * y.shape[-1]
        if first:
            p, q = np.split(rows, 2, axis=-1)
            rows = np.concatenate([rows, np.concatenate([q, -p], axis=-1)], axis=1)
        factor = grid.inverse_factor[:, start:, start : last * y.shape[-1]]
        part = rows.reshape(-1, rows.shape[-1]) @ np.swapaxes(factor, 1, 2)
        whitened[:, :, first:last, start:] = part.reshape(-1, *rows.shape[:2], part.shape[-1])
    whitened[:, :, 0] -= grid.whitened_mean[:, None]
    gram = np.swapaxes(whitened @ np.swapaxes(whitened, -1, -2), 0, 1)
    waves = np.stack(
        [np.ones_like(phases), *(f(h * phases) for h in (1, 2) for f in (np.cos, np.sin))], axis=-1
    )
    pairs = (waves[:, :, None] * waves[:, None]).reshape(len(phases), -1)
    cost = gram.reshape(*gram.shape[:2], -1) @ pairs.T
    return np.concatenate(np.split(cost, 2), axis=1) + grid.log_determinant[:, None]


def _local_minima(cost: np.ndarray) -> np.ndarray:
    """Return the indices (n, 2) of the local minima of a grid that is periodic in both dimensions."""
    around = cost
    for axis in (0, 1):
        around = np.minimum(around, np.minimum(np.roll(around, 1, axis), np.roll(around, -1, axis)))
    return np.argwhere(cost == around)


def absolute_angle(angle: float) -> float:
    """Return the absolute value of an angle, rad, after wrapping the angle to ±pi."""
    return abs((angle + np.pi) % (2.0 * np.pi) - np.pi)


def within_tolerance(point: SearchPoint, other: SearchPoint, within: tuple[float, float, float]) -> bool:
    """Return True if two points of the search agree in heading, phase and relative frequency, within tolerances."""
    return bool(
        absolute_angle(point.heading_rad - other.heading_rad) < within[0]
        and absolute_angle(point.phase_rad - other.phase_rad) < within[1]
        and abs(np.log(point.frequency_hz / other.frequency_hz)) < within[2]
    )


def find_starts(
    pixels: np.ndarray,
    weights: np.ndarray,
    times: np.ndarray,
    focal_px: float,
    prior: Prior,
    cosines: int = 0,
) -> Starts:
    """Find up to four starts of the refinement by grid searches.

    Parameters
    ----------
    pixels : (T, 15, 2)
        Relative to the principal point.
    weights : (T, 15)
        0 where a keypoint is missing.
    times : (T,)
        Seconds, 0 in the middle of the clip.
    focal_px : float
    prior : Prior
    cosines : int
        Number of cosines of a wandering path; such a path gives no evidence on the heading.

    Raises
    ------
    InvalidInput
        If no person is upright, fewer than four joints are seen, or the clip is shorter than half a stride.
    """
    model = prior.model
    visible = prior.detector.visible & often_seen(weights)
    names = ", ".join(np.array(WALKER15.joints)[visible]) or "none"
    if visible.sum() < 4:
        raise InvalidInput(
            "fewer than four joints are visible in a fifth of the frames or more",
            received=names,
            code="too_few_joints",
        )
    given_weights, weights = weights > 0, weights * visible
    heights = prior.mean[:, 2, 0]
    typical = np.exp(model.log_frequency[0])
    path = straighten(pixels, weights, times, heights, focal_px, typical, cosines)
    together = _ankles_together(path.metric, given_weights, times)
    frequencies, worse, image = frequency_candidates(path.metric, weights, times, model.log_frequency)
    worse = worse - worse.min()
    all_joints = np.array_equal(visible, prior.detector.visible)
    grid = prior.grid if all_joints else projected_grid(prior.mean, prior.covariance, visible)
    z = heights[visible] - heights[visible].mean()
    down = image[0, visible, 0, 1] - image[0, visible, 0, 1].mean()
    size = -(down @ z) / (z @ z)
    if size <= 0.2:
        raise InvalidInput(
            "no upright person is visible in the image",
            expected="heads above feet",
            received=names,
            code="not_upright",
        )
    phases = 2.0 * np.pi * np.arange(PHASES) / PHASES
    velocity = path.velocity_mm_s / size
    speed = 2.0 * np.pi * frequencies * belt_speed(prior)
    overground = bool(np.hypot(*velocity) > OVERGROUND_SHARE * speed[0]) and not cosines
    s, c = np.sin(grid.headings_rad), np.cos(grid.headings_rad)
    along, across = velocity[0] * s - velocity[1] * c, velocity[0] * c + velocity[1] * s
    least, distance = np.inf, np.inf
    minima: list[Start] = []
    heading_cost = np.full(len(grid.headings_rad), np.inf)
    costs = _grid_cost(grid, image[:, visible] / size, phases)
    for number, (frequency, cost) in enumerate(zip(frequencies, costs, strict=True)):
        lowest = np.argmin(cost.min(axis=1))
        if (lowest_cost := cost[lowest].min()) < least:
            least = lowest_cost
            distance = (least - grid.log_determinant[lowest]) / grid.whitened_mean.shape[1]
        if overground:
            v = speed[number]
            cost = cost + (((along - v) / (0.4 * v)) ** 2 + (across / (0.3 * v)) ** 2)[:, None]
        cost = cost + worse[number]
        heading_cost = np.minimum(heading_cost, cost.min(axis=1))
        minima += [
            Start(float(frequency), grid.headings_rad[i], phases[j], cost[i, j])
            for i, j in _local_minima(cost)
        ]
    minima.sort(key=lambda start: start.cost)
    # The frequency with the smallest residual always has a start: labels that are exchanged for long mimic the double
    # frequency.
    likeliest = frequencies[np.argmin(worse)]
    selected = [start for start in minima if start.frequency_hz == likeliest][:1]
    for start in minima:
        near = len(selected) < MAX_STARTS - 1 or start.cost < minima[0].cost + _FOURTH_START_COST
        if (
            near
            and len(selected) < MAX_STARTS
            and not any(within_tolerance(start, other, START_SEPARATION) for other in selected)
        ):
            selected.append(start)
    scaled = Path(path.distance / size, path.place_mm / size, velocity, path.metric / size)
    return Starts(tuple(selected), scaled, overground, distance, together, grid.headings_rad, heading_cost)


def _ankles_together(metric: np.ndarray, visible: np.ndarray, times: np.ndarray) -> float:
    """Return the correlation of the two ankles' motions in the image, each relative to its hip.

    The correlation is 0 if legs are visible in too few frames.
    """
    both = visible[:, np.ravel(_SIDES)].all(axis=1)
    if both.sum() < 5:
        return 0.0
    columns = times[both, None] ** np.arange(3)
    left, right = (metric[both, ankle] - metric[both, hip] for hip, ankle in _SIDES)
    left, right = (about - columns @ np.linalg.lstsq(columns, about)[0] for about in (left, right))
    return (left * right).sum() / max(np.sqrt((left**2).sum() * (right**2).sum()), 1e-9)
