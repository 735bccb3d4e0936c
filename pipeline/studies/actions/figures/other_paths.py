"""Alternative paths through a trellis, which are compared with the optimal path: mozerov2006 figure 2.

Symbols: ``p`` sample, ``d`` disparity, ``k`` step of the recurrence, from d + k at p - 1 to d at p.
"""

from __future__ import annotations

import numpy as np

from pipeline.core.synchronization import Trellis


def distances_so_far(nodes: Trellis, image: np.ndarray, paths: np.ndarray) -> np.ndarray:
    """Cumulative synchronization distance (N, P) along each of N paths, up to and including each sample.

    Parameters
    ----------
    nodes : Trellis
    image : (P, 2D + 1)
        Disparity space image.
    paths : (N, P) int, or (P,)
        Disparities.
    """
    paths = np.atleast_2d(paths)
    return nodes.distances_so_far(image[np.arange(paths.shape[1]), paths + image.shape[1] // 2], paths)


def single_corner_changes(nodes: Trellis, path: np.ndarray) -> np.ndarray:
    """Admissible paths (N, P) whose disparity differs from the path (P,) by 1 at exactly one sample."""
    count = len(path)
    changed = np.repeat(path[None], 2 * count, axis=0)
    changed[np.arange(2 * count), np.tile(np.arange(count), 2)] += np.repeat([-1, 1], count)
    within = ((changed >= nodes.low) & (changed <= nodes.high)).all(axis=1)
    allowed = np.isin(-np.diff(changed, axis=1), nodes.steps).all(axis=1)
    return changed[within & allowed]


def random_paths(nodes: Trellis, count: int, generator: np.random.Generator) -> np.ndarray:
    """Draw random admissible paths (N, P), from the last sample to the first.

    Each step is drawn among the steps from which the start can be reached.
    """
    least = nodes.low.min()
    reached = _reached(nodes, least)
    steps = np.array(nodes.steps)
    paths = np.zeros((count, len(nodes.low)), int)
    for p in range(len(nodes.low) - 1, 0, -1):
        towards = paths[:, p, None] + steps
        column = towards - least
        inside = (column >= 0) & (column < reached.shape[1])
        leads_on = inside & reached[p - 1][np.where(inside, column, 0)]
        # The step with the largest of random numbers, one for each step that leads on.
        drawn_step = np.where(leads_on, generator.random(leads_on.shape), -1.0).argmax(axis=1)
        paths[:, p - 1] = towards[np.arange(count), drawn_step]
    return paths


def _reached(nodes: Trellis, least: int) -> np.ndarray:
    """Mask of the trellis nodes that admissible paths can reach, with axes (P, disparities from `least` upwards)."""
    disparities = np.arange(least, nodes.high.max() + 1)
    inside = (disparities >= nodes.low[:, None]) & (disparities <= nodes.high[:, None])
    reached = inside.copy()
    for p in range(1, len(inside)):
        before = np.pad(reached[p - 1], nodes.margin)
        onward = [before[nodes.margin + k :][: len(disparities)] for k in nodes.steps]
        reached[p] &= np.logical_or.reduce(onward)
    return reached
