"""Errors of one limb while one cause of error is swept: park2011 section 5.1."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from pipeline.processes import map_processes
from pipeline.studies.limbs.trials import LimbInputs, LimbSweep, LimbTrial, stacked


@dataclass(frozen=True, kw_only=True)
class SweptErrors:
    """Errors of T trials before each of C cameras at V values, and at further ones (…) in some sweeps.

    Attributes
    ----------
    cameras : (C,) text
    values : (V,)
        Of what is swept.
    stretch, limb : (T,) int
        Of the trial, indices into the data set and ``WALKER14.limbs``.
    limb_error, relative_error, error_up_to_mirror, proved, objective, lower_bound : (C, V, …, T)
        As `scores.LimbScore`.
    hanging_error, mean_pose_error : (C, V, …, T)
        As `nulls.limb_errors`.
    shown : (1,) int
        The first camera's trial whose errors are, over all values, nearest to the medians.
    paths : (V, 2, F, 3)
        Of that trial: the child as it is and as estimated, less its true parent, over the limb's length.
    """

    cameras: np.ndarray
    values: np.ndarray
    stretch: np.ndarray
    limb: np.ndarray
    limb_error: np.ndarray
    relative_error: np.ndarray
    error_up_to_mirror: np.ndarray
    proved: np.ndarray
    objective: np.ndarray
    lower_bound: np.ndarray
    hanging_error: np.ndarray
    mean_pose_error: np.ndarray
    shown: np.ndarray
    paths: np.ndarray


@dataclass(kw_only=True)
class ErrorSweep(LimbSweep):
    """A sweep of one cause of error."""

    in_the_basis: ClassVar[bool] = False
    """Whether errors are made in the trajectory basis, so that K has to be given."""


def measured(
    sweep: ErrorSweep,
    inputs: LimbInputs,
    points: Sequence[int],
    errors_of: Callable[[LimbTrial], list[dict[str, Any]]],
) -> dict[str, np.ndarray]:
    """Return the fields of `SweptErrors`, but for the values, and whatever else is found at every point.

    Parameters
    ----------
    sweep : ErrorSweep
    inputs : LimbInputs
    points : sequence of int
        Numbers of values that are swept, the first those of `SweptErrors.values`.
    errors_of : callable
        What was found at every point for one trial, `paths` (2, F, 3) among it.
    """
    cameras, trials, flat = len(sweep.cameras), sweep.trials, int(np.prod(points))
    tried = sweep.every_trial(inputs)
    found = map_processes(errors_of, tried, inputs.workers)
    paths = [[row.pop("paths") for row in of_trial] for of_trial in found]
    columns = stacked([row for of_trial in found for row in of_trial], (cameras, trials, flat))
    columns = {name: np.moveaxis(values, 1, 2) for name, values in columns.items()}
    errors = np.log(np.maximum(columns["limb_error"][0], 1e-3))
    shown = int(np.argmin(np.abs(errors - np.median(errors, axis=1, keepdims=True)).sum(axis=0)))
    return {
        "cameras": np.array(sweep.cameras),
        "stretch": np.array([trial.stretch for trial in tried[:trials]]),
        "limb": np.array([trial.limb for trial in tried[:trials]]),
        **{name: values.reshape(cameras, *points, trials) for name, values in columns.items()},
        "shown": np.array([shown]),
        "paths": np.stack(paths[shown])[:: flat // points[0]],
    }
