"""Choice of sigma² for each walker by other people, on models that have not seen the walker.

zhang2007 chooses sigma² on the walkers that it reports.  Here people are dealt to groups.  For the walkers of group g
sigma² has the lowest error over the walkers of every other group h, reconstructed by the model without g and h: the
walker neither votes nor takes part in a model that does.
"""

from __future__ import annotations

import numpy as np

from pipeline.core import linear_model, reconstruction
from pipeline.core.choice import evenly
from pipeline.processes import map_processes
from pipeline.studies.eigenwalkers.model import EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples

GROUPS = 10
"""Groups of people; fewer if there are fewer people."""

LEAST_PEOPLE = 4

VIEWS = 5
"""View angles at which sigma² is chosen, of those of the sweep."""


def nested_choice(
    data: FourierSamples,
    options: EigenwalkersModel,
    view_angles_rad: np.ndarray,
    noise_variances: np.ndarray,
    workers: int,
) -> np.ndarray:
    """Return for each walker (R,) the index of the sigma² that others choose, on models without that walker.

    Fewer than four people choose for nobody, for two are left out of each model: the result is then empty.

    Parameters
    ----------
    data : FourierSamples
    options : EigenwalkersModel
    view_angles_rad : (A,)
        Of which `VIEWS` are used.
    noise_variances : (S,)
        mm².
    workers : int
    """
    samples, how = options.training(data)
    groups = np.unique(data.person, return_inverse=True)[1] % GROUPS  # dealt in turn
    count = groups.max() + 1
    if count < LEAST_PEOPLE:
        return np.empty(0, int)
    views = view_angles_rad[evenly(VIEWS, len(view_angles_rad))]

    def tried(fold: tuple[linear_model.LinearModel, int, int]) -> tuple[int, int, np.ndarray, np.ndarray]:
        model, g, h = fold
        paths: dict[bytes, reconstruction.NoisePath] = {}

        def error(r: np.intp) -> np.ndarray:
            """Of the joints of a walker that were measured; one path serves all of whom the same ones were."""
            measured = ~data.unmeasured[r]
            if (key := measured.tobytes()) not in paths:
                of_measured = linear_model.of_measured(model, measured)
                paths[key] = reconstruction.NoisePath(of_measured, views, noise_variances)
            found = paths[key].error(linear_model.without_joints(samples[r], measured)).mean(axis=0)
            return found * (len(measured) / measured.sum())

        of_g, of_h = (sum(map(error, np.flatnonzero(groups == group))) for group in (g, h))
        return g, h, np.asarray(of_g), np.asarray(of_h)

    folds = linear_model.leave_two_out(samples, options.components, groups=groups, **how)
    votes = np.zeros((count, len(noise_variances)))
    for g, h, of_g, of_h in map_processes(tried, folds, workers):
        votes[g] += of_h
        votes[h] += of_g
    return votes.argmin(axis=1)[groups]
