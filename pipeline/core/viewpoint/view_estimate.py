"""Record of jointly estimated view angles and coefficients."""

from __future__ import annotations

import numpy as np

from pipeline.shortened import shortened


@shortened
class ViewEstimate:
    """View angles and coefficients of A observations.

    For one flat observation, the arrays have no first axis: scalars, and coefficients (N,).

    Attributes
    ----------
    angle_rad : (A,)
        In (-pi, pi].
    coefficients : (A, N)
        k in mm; within a search whitened, z.
    cost : (A,)
        The minimum of [zhang2007 4.5], squared, or of [zhang2007 4.6] times 2 sigma²; mm².
    runner_up_cost : (A,)
        The lowest cost of any other local minimum, to the accuracy of the grid; infinite where there is none
        or, from one start, none was looked for.  Near `cost`, the view is ambiguous (a front seen for a back).
    converged : (A,) bool
    n_iterations : (A,) int
    """

    angle_rad: np.ndarray
    coefficients: np.ndarray
    cost: np.ndarray
    runner_up_cost: np.ndarray
    converged: np.ndarray
    n_iterations: np.ndarray
