"""Where to start: stride frequency, heading and phase on grids, after distance and path are taken out.

Symbols
-------
``y``     Fourier coefficients of the image, two harmonics, mm
``J``     ``|L^-1 (y - mu)|² + log |Sigma|``: how unlikely the image is at a heading and phase

Nothing is decided here: several frequencies, headings and phases go on to the refinement.
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
"""A path faster than this share of the average walker's belt is overground."""
MOST_STARTS = 4
NEAREST = (np.radians(25.0), np.radians(50.0), 0.06)
"""Two starts differ by so much in heading, phase or relative frequency."""
_FOURTH_START = 150.0
"""A fourth start is tried if its cost is within this of the best."""


@dataclass(frozen=True)
class Place:
    """A place of the search: what its minima differ by."""

    frequency_hz: float
    heading_rad: float
    phase_rad: float


@dataclass(frozen=True)
class Start(Place):
    """One place to start from.

    Attributes
    ----------
    cost : float
        J of the grid.
    """

    cost: float


@dataclass(frozen=True)
class Starts:
    """Places to start from, best first.

    Attributes
    ----------
    starts : tuple of Start
    path : Path
    overground : bool
    least_distance : float
        The squared distance in the smallest J, without the path's say, over the number of coefficients: about 1 for an
        average walker.
    ankles_together : float
        Correlation of the ankles' motion in the image, each about its hip, within ±1; 0 if a leg is not seen.
    headings_rad : (72,)
    heading_cost : (72,)
        Smallest J at each heading, with the path's say.
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
    """Stride frequencies worth trying, the best first, with their costs and the image's Fourier coefficients.

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
        Twice a negative logarithm of a probability, of what the frequency leaves of the image.
    coefficients : (n, 15, 5, 2)
        By joint, coefficient and image axis, mm.
    """
    duration = times[-1] - times[0]
    grid = np.exp(np.arange(np.log(lowest_hz(duration)), np.log(SEARCH_HZ[1]) + 0.01, 0.02))

    def columns(frequencies: np.ndarray) -> np.ndarray:
        drift = np.broadcast_to((times / duration)[:, None], (len(frequencies), len(times), 1))
        return np.concatenate([design(frequencies[:, None], times, 2), drift], axis=2)

    tried = columns(grid)
    count = 2.0 * (weights > 0).sum()

    def cost_of(frequencies: np.ndarray, squares: np.ndarray) -> np.ndarray:
        far = (np.log(frequencies) - log_frequency[0]) / (1.5 * log_frequency[1])
        return count / 16.0 * np.log(squares) + 0.5 * far**2

    found, squares = regress_tracks(tried, metric, weights)
    best = np.argmin(cost_of(grid, squares))
    off = np.linalg.norm(metric - np.einsum("tn,jnd->tjd", tried[best], found[best]), axis=-1)
    scale = max(np.median(off[weights > 0]) / 1.1774, 1e-9)
    w = weights / (1.0 + (off / (2.385 * scale)) ** 2)
    cost = cost_of(grid, regress_tracks(tried, metric, w)[1])
    padded = np.concatenate([[np.inf], cost, [np.inf]])
    minima = np.flatnonzero((cost <= padded[:-2]) & (cost < padded[2:]))
    minima = minima[np.argsort(cost[minima], kind="stable")][:3]
    wanted = [*grid[minima], 2.0 * grid[minima[0]], 0.5 * grid[minima[0]]]
    chosen: list[float] = []
    for frequency in wanted:
        inside = max(0.9 * SEARCH_HZ[0], 0.4 / duration) <= frequency <= 1.25 * SEARCH_HZ[1]
        if inside and all(abs(np.log(frequency / other)) > 0.05 for other in chosen):
            chosen.append(float(frequency))
    frequencies = np.array(chosen)
    found, squares = regress_tracks(columns(frequencies), metric, w)
    return frequencies, cost_of(frequencies, squares), found[:, :, :GRID_BLOCKS]


def _grid_cost(grid: Grid, images: np.ndarray, phases: np.ndarray) -> np.ndarray:
    """J (F, 72, P) of image coefficients (F, n joints, 5, 2) at all headings and phases."""
    y = np.swapaxes(images, 1, 2).copy()  # (F, 5, n, 2)
    y[:, 0] -= y[:, 0].mean(axis=1, keepdims=True)
    # From the opposite side the image's right is its left, and all else the same.
    y = np.concatenate([y, y * [-1.0, 1.0]]).reshape(2 * len(images), GRID_BLOCKS, -1)
    # A harmonic has none of the others' coefficients, and the factors, which are large, none above their diagonal.
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
    """Cells (n, 2) of a grid on a torus that no neighbour undercuts."""
    around = cost
    for axis in (0, 1):
        around = np.minimum(around, np.minimum(np.roll(around, 1, axis), np.roll(around, -1, axis)))
    return np.argwhere(cost == around)


def apart(angle: float) -> float:
    """How far an angle is from none, 0 to pi, rad."""
    return abs((angle + np.pi) % (2.0 * np.pi) - np.pi)


def alike(one: Place, other: Place, within: tuple[float, float, float]) -> bool:
    """Whether two differ by less than this in heading, phase and relative frequency."""
    return bool(
        apart(one.heading_rad - other.heading_rad) < within[0]
        and apart(one.phase_rad - other.phase_rad) < within[1]
        and abs(np.log(one.frequency_hz / other.frequency_hz)) < within[2]
    )


def find_starts(
    pixels: np.ndarray,
    weights: np.ndarray,
    times: np.ndarray,
    focal_px: float,
    prior: Prior,
    cosines: int = 0,
) -> Starts:
    """Find up to four places to start from.

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
        Of a path that wanders; such a path says nothing about the heading.

    Raises
    ------
    InvalidInput
        If nobody stands upright, fewer than four joints are seen or the clip is shorter than half a stride.
    """
    model = prior.model
    seen = prior.detector.seen & often_seen(weights)
    names = ", ".join(np.array(WALKER15.joints)[seen]) or "none"
    if seen.sum() < 4:
        raise InvalidInput(
            "fewer than four joints are seen in a fifth of the frames", received=names, code="too_few_joints"
        )
    shown, weights = weights > 0, weights * seen
    heights = prior.mean[:, 2, 0]
    typical = np.exp(model.log_frequency[0])
    path = straighten(pixels, weights, times, heights, focal_px, typical, cosines)
    together = _ankles_together(path.metric, shown, times)
    frequencies, worse, image = frequency_candidates(path.metric, weights, times, model.log_frequency)
    worse = worse - worse.min()
    whole = np.array_equal(seen, prior.detector.seen)
    grid = prior.grid if whole else projected_grid(prior.mean, prior.covariance, seen)
    z = heights[seen] - heights[seen].mean()
    down = image[0, seen, 0, 1] - image[0, seen, 0, 1].mean()
    size = -(down @ z) / (z @ z)
    if size <= 0.2:
        raise InvalidInput(
            "nobody stands upright in the image",
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
    found: list[Start] = []
    heading_cost = np.full(len(grid.headings_rad), np.inf)
    costs = _grid_cost(grid, image[:, seen] / size, phases)
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
        found += [
            Start(float(frequency), grid.headings_rad[i], phases[j], cost[i, j])
            for i, j in _local_minima(cost)
        ]
    found.sort(key=lambda start: start.cost)
    # The frequency that leaves least of the image has a start of its own: labels exchanged for long make the image
    # look like one of the double frequency.
    likeliest = frequencies[np.argmin(worse)]
    chosen = [start for start in found if start.frequency_hz == likeliest][:1]
    for start in found:
        near = len(chosen) < MOST_STARTS - 1 or start.cost < found[0].cost + _FOURTH_START
        if near and len(chosen) < MOST_STARTS and not any(alike(start, other, NEAREST) for other in chosen):
            chosen.append(start)
    scaled = Path(path.distance / size, path.place_mm / size, velocity, path.metric / size)
    return Starts(tuple(chosen), scaled, overground, distance, together, grid.headings_rad, heading_cost)


def _ankles_together(metric: np.ndarray, seen: np.ndarray, times: np.ndarray) -> float:
    """Correlation of the ankles about their hips in the image (T, 15, 2), 0 where too little is seen (T, 15)."""
    both = seen[:, np.ravel(_SIDES)].all(axis=1)
    if both.sum() < 5:
        return 0.0
    columns = times[both, None] ** np.arange(3)
    left, right = (metric[both, ankle] - metric[both, hip] for hip, ankle in _SIDES)
    left, right = (about - columns @ np.linalg.lstsq(columns, about)[0] for about in (left, right))
    return (left * right).sum() / max(np.sqrt((left**2).sum() * (right**2).sum()), 1e-9)
