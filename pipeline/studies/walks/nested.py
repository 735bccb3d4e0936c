"""Nested choice of sigma² for each walker, from errors of other people in models that omit the walker.

zhang2007 chooses sigma² on the walkers that it reports.  Here people are divided into groups.  For the walkers of
group g, the chosen sigma² has the lowest error over the walkers of every other group h, reconstructed by the model
without g and h.  A walker thus influences neither the choice nor the models behind it.
"""

from __future__ import annotations

import numpy as np

from pipeline.core import linear_model, reconstruction
from pipeline.core.choice import evenly
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.model import EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples

GROUPS = 10
"""Largest number of groups of people for the choice of sigma²; with fewer people, each person is a group."""

MIN_PEOPLE = 4

VIEWS = 5
"""Number of view angles of the sweep that are used to choose sigma²."""


def nested_choice(
    data: FourierSamples,
    options: EigenwalkersModel,
    view_angles_rad: np.ndarray,
    noise_variances: np.ndarray,
    workers: int,
) -> np.ndarray:
    """Return, for each walker (R,), the index of the sigma² with the smallest error for other people.

    Every model leaves out the walker, and also the people in the test of the model.

    The result is empty for fewer than four people, because each model leaves out two.

    Parameters
    ----------
    data : FourierSamples
    options : EigenwalkersModel
    view_angles_rad : (A,)
        View angles; `VIEWS` of them are used.
    noise_variances : (S,)
        Candidates of sigma², mm².
    workers : int
    """
    samples, how = options.training(data)
    groups = np.unique(data.person, return_inverse=True)[1] % GROUPS  # assigned in turn
    count = groups.max() + 1
    if count < MIN_PEOPLE:
        return np.empty(0, int)
    views = view_angles_rad[evenly(VIEWS, len(view_angles_rad))]

    def errors_of_pair(
        fold: tuple[linear_model.LinearModel, int, int],
    ) -> tuple[int, int, np.ndarray, np.ndarray]:
        model, g, h = fold
        paths: dict[bytes, reconstruction.NoisePath] = {}

        def error(r: np.intp) -> np.ndarray:
            """Return the error (S,) of one walker's reconstruction for each sigma², over the measured joints.

            Walkers with the same measured joints share the computation for all sigma².
            """
            measured = ~data.unmeasured[r]
            if (key := measured.tobytes()) not in paths:
                of_measured = linear_model.of_measured(model, measured)
                paths[key] = reconstruction.NoisePath(of_measured, views, noise_variances)
            mean_error = paths[key].error(linear_model.without_joints(samples[r], measured)).mean(axis=0)
            return mean_error * (len(measured) / measured.sum())

        of_g, of_h = (sum(map(error, np.flatnonzero(groups == group))) for group in (g, h))
        return g, h, np.asarray(of_g), np.asarray(of_h)

    folds = linear_model.leave_two_out(samples, options.components, groups=groups, **how)
    votes = np.zeros((count, len(noise_variances)))
    for g, h, of_g, of_h in map_processes(errors_of_pair, folds, workers):
        votes[g] += of_h
        votes[h] += of_g
    return votes.argmin(axis=1)[groups]
