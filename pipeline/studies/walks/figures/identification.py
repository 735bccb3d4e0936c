"""Identification of people from walks reconstructed from different views: zhang2004 sections 4.3 and 5."""

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
    """Depth coefficients (R, V, 5, 15), mm, by method, as reconstructed from the demonstration views."""
    reconstructed = dict(zip(sweep.methods.tolist(), sweep.missing, strict=True))
    return {**reconstructed, AVERAGE_WALKER.name: sweep.average_walker}


def identification_table(inputs: Inputs) -> pd.DataFrame:
    """Table of identification: for each pair of views and method, 1 for each walker who is identified.

    A walker is identified if the nearest reconstruction from the other view belongs to the same person.

    Both views show the same walk; identification across different walks of a person is harder.
    """
    sweep, data = inputs.sweep, inputs.dataset
    person = np.unique(data.person, return_inverse=True)[1]
    views = sweep.demonstration_view_deg
    turned = np.radians(views)[None, :, None, None]
    images = camera.project(data.coefficients[:, None], turned)
    blocks = []
    for name, depth in missing_dimensions(sweep).items():
        walkers = camera.combine(images, depth, turned)
        flat = walkers.reshape(*walkers.shape[:2], -1)
        for first, second in permutations(range(len(views)), 2):
            distances = ((flat[:, first, None] - flat[None, :, second]) ** 2).sum(axis=-1)
            blocks.append(
                {
                    "person": data.person,
                    "walker": inputs.samples,
                    "method": name,
                    "view_angle_deg": views[first],
                    "among_view_angle_deg": views[second],
                    "identified": (person[distances.argmin(axis=1)] == person).astype(int),
                }
            )
    by = ["walker", "method", "view_angle_deg", "among_view_angle_deg"]
    # A single view has no pairs; the table then has no rows.
    return tidy(stacked(blocks).reindex(columns=["person", *by, "identified"]), by=by)
