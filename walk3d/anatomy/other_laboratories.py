"""Reconstruction of walks by a prior learnt from other laboratories and calibrated on people of the data set."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.validation import require_range
from walk3d.anatomy import prior as anatomical
from walk3d.anatomy.method import VIEWS_AT_A_TIME, AnatomicalApproach
from walk3d.anatomy.prior import Prior
from walk3d.anatomy.prior.own_laboratory import OF_HEIGHT, Learnt, calibrated, height_mm, truncated
from walk3d.anatomy.study.model import AnatomicalModel
from walk3d.anatomy.study.sweeps.setting import anatomical_setting


class OtherLaboratories(AnatomicalApproach):
    """Reconstruction of every walk by a prior learnt from other laboratories.

    The prior is calibrated on all people of the data set except the person who walks.

    Parameters
    ----------
    data : FourierSamples
    learnt : Learnt
        Prior with at least as many harmonics as the data.
    """

    def __init__(self, data: FourierSamples, learnt: Learnt) -> None:
        blocks = data.coefficients.shape[1]
        require_range("dataset.harmonics", blocks // 2, at_most=learnt.prior.mean.shape[-1] // 2)
        self._data = data
        self._learnt = replace(learnt, prior=truncated(learnt.prior, blocks))
        self._setting = anatomical_setting(AnatomicalModel(), blocks // 2)
        unmeasured = data.unmeasured
        self._height_mm = np.array([height_mm(walk) for walk in data.coefficients])
        self._height_mm[unmeasured[:, list(OF_HEIGHT)].any(axis=1)] = np.nan
        self._complete = ~unmeasured.any(axis=1)

    def fold(self, walk: int) -> Any:
        """Return None, because the method uses a prior that was trained before."""

    def prior(self, walk: int) -> Prior:
        """Return the prior calibrated on everyone except the person whose walk is given."""
        others = self._complete & (self._data.person != self._data.person[walk])
        people = [others & (self._data.person == who) for who in dict.fromkeys(self._data.person[others])]
        heights = [float(self._height_mm[person].mean()) for person in people]
        walker_mm = float(np.nan_to_num(self._height_mm[walk], nan=float(np.mean(heights or [np.nan]))))
        if not walker_mm > 0:  # neither this walker nor any other shows a height
            walker_mm = height_mm(anatomical.by_block(self._learnt.prior.mean))
        walks = [self._data.coefficients[person].mean(axis=0) for person in people]
        return calibrated(self._learnt, walker_mm, walks, heights)

    def missing(self, fold: Any, walk: int, view_rad: np.ndarray) -> np.ndarray:
        """Return the reconstructed missing dimension (A, 1 + 2H, 15) of a walk from each of A views, mm."""
        prior, noise = self.prior(walk), self._setting.noise
        walker, hidden = anatomical.by_joint(self._data.coefficients[walk]), self._data.unmeasured[walk]
        tolerances = anatomical.tolerances(prior, within=self._setting.within, pairs=self._setting.pairs)
        parts = []
        for views in np.array_split(view_rad, max(len(view_rad) // VIEWS_AT_A_TIME, 1)):
            conditional = anatomical.condition(prior, views, noise=noise, hidden=hidden)
            visible = ~conditional.unknown
            rows = np.einsum("aij,kjb->akib", anatomical.image_axes(views), walker).reshape(len(views), -1)
            posterior = anatomical.fit_lengths(conditional, rows[:, None, visible], tolerances)
            rows[:, ~visible] = posterior.unknown[:, 0]
            parts.append(rows.reshape(len(views), *walker.shape)[:, :, 2])
        return np.swapaxes(np.concatenate(parts), -1, -2)
