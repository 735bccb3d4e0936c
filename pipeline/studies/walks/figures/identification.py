"""Whether people are told apart by what is reconstructed from different views: zhang2004 sections 4.3 and 5."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pandas as pd

from pipeline.core import camera
from pipeline.studies.eigenwalkers.model import Eigenwalkers
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.study import stacked
from pipeline.studies.walks.known_view import KnownViewErrors
from pipeline.studies.walks.methods import AVERAGE_WALKER

Inputs = FigureInputs[FourierSamples, Eigenwalkers, KnownViewErrors]


def missing_dimensions(sweep: KnownViewErrors) -> dict[str, np.ndarray]:
    """What each method and the average walker have at the demonstration views, (R, V, 5, 15) each."""
    reconstructed = dict(zip(sweep.methods.tolist(), sweep.missing, strict=True))
    return {**reconstructed, AVERAGE_WALKER.name: sweep.average_walker}


def identification_table(inputs: Inputs) -> pd.DataFrame:
    """Whether the nearest of all reconstructions from another view is the same person's, for every pair of views.

    The same walk is seen from both views: identification over walks of a person is harder.
    """
    sweep, data = inputs.sweep, inputs.dataset
    person = np.unique(data.person, return_inverse=True)[1]
    views = sweep.demonstration_view_deg
    turned = np.radians(views)[None, :, None, None]
    seen = camera.project(data.coefficients[:, None], turned)
    blocks = []
    for name, depth in missing_dimensions(sweep).items():
        walkers = camera.combine(seen, depth, turned)
        flat = walkers.reshape(*walkers.shape[:2], -1)
        for one, other in permutations(range(len(views)), 2):
            apart = ((flat[:, one, None] - flat[None, :, other]) ** 2).sum(axis=-1)
            blocks.append(
                {
                    "person": data.person,
                    "walker": inputs.samples,
                    "method": name,
                    "view_angle_deg": views[one],
                    "among_view_angle_deg": views[other],
                    "identified": (person[apart.argmin(axis=1)] == person).astype(int),
                }
            )
    by = ["walker", "method", "view_angle_deg", "among_view_angle_deg"]
    # Of a single view there are no pairs: a table without rows.
    return tidy(stacked(blocks).reindex(columns=["person", *by, "identified"]), by=by)
