"""Compiled loops over the particles of a frame: motion, postures and image likelihoods.

Symbols as in `prediction` and `likelihood`.  Each loop is what the lines of arrays in its caller's words would be; it
is compiled: a frame has few particles and many small operations, whose overhead exceeds their work.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from pipeline.compilation import compiled_exactly


@compiled_exactly
def step_forward(state, innovations, keep, step, rate_step, rate_bounds, last, after):
    """Compute the particles' next states from states (S, 2 + b) and innovations, with the rate reflected at its bounds.

    A rate that is NaN, without the prior, stays so, and so does the phase.
    """
    low, high = rate_bounds
    width = high - low
    for i in range(len(state)):
        rate = state[i, 1] + rate_step * innovations[i, 1]
        if width <= 0.0:
            rate += low - rate
        elif rate < low or rate > high:
            beyond = (rate - low) % (2.0 * width)
            rate = low + min(beyond, 2.0 * width - beyond)
        phase = state[i, 0] + rate
        after[i, 0] = last if phase > last else phase
        after[i, 1] = rate
        for k in range(2, state.shape[1]):
            after[i, k] = keep * state[i, k] + step[k - 2] * innovations[i, k]


@compiled_exactly
def deviate(state, mean, sd, x):
    """Compute the postures x = m(p) + s(p) z (S, b) of S particles from phase p and deviation z.

    Mean m and standard deviation s are interpolated linearly between samples.
    """
    for i in range(len(state)):
        before = int(state[i, 0])
        after = min(before + 1, len(mean) - 1)
        share = state[i, 0] - before
        for k in range(mean.shape[1]):
            m = mean[before, k] + share * (mean[after, k] - mean[before, k])
            s = sd[before, k] + share * (sd[after, k] - sd[before, k])
            x[i, k] = m + s * state[i, 2 + k]


@compiled_exactly
def image_misfit(points, matrix, seen, image, weights, free_axes, misfit):
    """Compute the sum of squared image residuals (S,) of the joints of S particles (S, J, 3).

    Along free axes, the residuals are relative to their weighted mean.

    Parameters
    ----------
    points : (S, J, 3)
    matrix : (2, 3)
        From a point to its image.
    seen : (K,) int
        Joints that take part.
    image : (K, 2)
        Where they were seen.
    weights : (K,)
        One over sigma.
    free_axes : int
    misfit : (S,)
    """
    residuals = np.empty((2, len(seen)))
    total = 0.0
    for j in range(len(seen)):
        total += weights[j] ** 2
    for i in range(len(points)):
        for j in range(len(seen)):
            for axis in range(2):
                projected = 0.0
                for d in range(3):
                    projected += matrix[axis, d] * points[i, seen[j], d]
                residuals[axis, j] = projected - image[j, axis]
        for axis in range(free_axes):
            middle = 0.0
            for j in range(len(seen)):
                middle += weights[j] ** 2 * residuals[axis, j]
            middle /= total
            for j in range(len(seen)):
                residuals[axis, j] -= middle
        squares = 0.0
        for j in range(len(seen)):
            squares += (weights[j] * residuals[0, j]) ** 2 + (weights[j] * residuals[1, j]) ** 2
        misfit[i] = np.inf if np.isnan(squares) else squares
