"""Error of the time recovered by synchronization against smoothness: mozerov2006 section 3.

The performances have a known true course.  The pattern is the median sequence of the model.  Each sample of the pattern
is matched with a frame of the performance; the error is the distance in frames to the frame of the same true phase.
The phase is undefined while the pattern stands still.  Errors are therefore also given for moving samples only.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from pipeline.core import synchronization
from pipeline.core.action_model import mean_squared_deviation
from pipeline.processes import map_processes
from pipeline.studies.actions.model import ActionInputs, Penalty, Start
from pipeline.studies.study import Sweep
from pipeline.validation import Distinct, NonNegative


@dataclass(frozen=True)
class TimeErrors:
    """Errors of the time recovered by synchronization, and the true frames of the performances.

    Attributes
    ----------
    starts, penalties : (S,), (K,) text
    smoothness : (V,)
        mu in mean squared deviations of a frame.
    error_frames, error_moving_frames : (S, K, V, M)
        Mean error over all samples, and over samples at which the pattern moves; zero for the pattern itself.
    true_frames : (M, P)
        Frame of each performance, fractional, that shows the phase of each sample of the pattern.
    moving : (P,) bool
        True for samples at which the pattern moves.
    """

    starts: np.ndarray
    penalties: np.ndarray
    smoothness: np.ndarray
    error_frames: np.ndarray
    error_moving_frames: np.ndarray
    true_frames: np.ndarray
    moving: np.ndarray


class Smoothness(Sweep):
    """Options of the sweep over the smoothness mu of synchronization, with two penalties [mozerov2006 12, 16]."""

    smoothness: Distinct[NonNegative] = [  # mu, of the synchronization
        0.0, 0.001, 0.003, 0.01, 0.02, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0,
    ]  # fmt: skip
    penalties: Distinct[Penalty] = list(Penalty)  # of the disparity

    def measure(self, inputs: ActionInputs) -> TimeErrors:
        """Return the errors of the time recovered by synchronization, at every value of the smoothness."""
        dataset, linear, median = inputs.dataset, inputs.model.linear, inputs.model.median
        mu = np.array(self.smoothness, float) * mean_squared_deviation(linear)
        samples = linear.shape[1]
        true, moving = dataset.true_course(median, samples)
        frames_per_sample = (np.diff(dataset.first) - 1) / (samples - 1)
        starts, penalties = [start.value for start in Start], [penalty.value for penalty in self.penalties]

        def one(m: int) -> np.ndarray:
            errors = []
            for start, penalty, smoothness in product(starts, penalties, mu):
                options = inputs.model_options.path_options | {"start": start, "penalty": penalty}
                path = synchronization.synchronize(
                    linear[median], linear[m], smoothness=smoothness, **options
                )
                off = np.abs(synchronization.rate_to_rate(path.disparity) * frames_per_sample[m] - true[m])
                errors.append((off.mean(), off[moving].mean()))
            return np.array(errors).reshape(len(starts), len(penalties), len(mu), 2)

        error = np.stack(map_processes(one, range(len(linear)), inputs.workers), axis=3)
        return TimeErrors(
            starts=np.array(starts),
            penalties=np.array(penalties),
            smoothness=np.array(self.smoothness, float),
            error_frames=error[..., 0],
            error_moving_frames=error[..., 1],
            true_frames=true,
            moving=moving,
        )
