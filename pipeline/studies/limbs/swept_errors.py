"""Errors of one limb while one cause of error is swept: park2011 section 5.1."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipeline.processes import map_processes
from pipeline.studies.limbs.trials import LimbInputs, LimbSweep, LimbTrial


@dataclass(frozen=True)
class SweptErrors:
    """Errors of every trial before every camera at every point of a sweep, and one trial to look at.

    Attributes
    ----------
    rows : DataFrame
        `LimbTrial.keys`, the point, and what was found there.
    shown : int
        The first camera's trial whose errors are, over all points, nearest to the medians.
    paths : (V, 2, F, 3)
        Of that trial at every value: the child as it is and as estimated, less its true parent, over the limb's length.
    """

    rows: pd.DataFrame
    shown: int
    paths: np.ndarray


def measured(
    sweep: LimbSweep,
    inputs: LimbInputs,
    errors_of: Callable[[LimbTrial], list[dict[str, Any]]],
    *,
    every: int = 1,
) -> SweptErrors:
    """Return the errors of every trial.

    Parameters
    ----------
    sweep : LimbSweep
    inputs : LimbInputs
    errors_of : callable
        What was found at every point for one trial, `paths` (2, F, 3) among it.
    every : int
        Points to a value: at the first of them the paths are kept.
    """
    tried = sweep.every_trial(inputs)
    found = map_processes(errors_of, tried, inputs.workers)
    paths = [[row.pop("paths") for row in of_trial] for of_trial in found]
    rows = [trial.keys | row for trial, of_trial in zip(tried, found, strict=True) for row in of_trial]
    first = [[row["limb_error"] for row in of_trial] for of_trial in found[: sweep.trials]]
    errors = np.log(np.maximum(first, 1e-3))
    shown = int(np.argmin(np.abs(errors - np.median(errors, axis=0)).sum(axis=1)))
    return SweptErrors(pd.DataFrame(rows), shown, np.stack(paths[shown])[::every])
