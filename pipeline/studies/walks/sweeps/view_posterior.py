"""The view angle with its posterior: how far off, how sure, and whether front and back are told apart."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from scipy.special import ndtri

from pipeline.core import anatomical, statistics
from pipeline.processes import map_processes
from pipeline.studies.study import Sweep, Swept, scaled
from pipeline.studies.walks.anatomical_model import AnatomicalInputs, AnatomicalModel
from pipeline.studies.walks.sweeps.held_out import BARS, CANDIDATES, People
from pipeline.studies.walks.sweeps.setting import PLAIN, anatomical_setting, approach_two
from pipeline.validation import InvalidInput, Positive

METHODS = ("two_harmonics", "anatomical")
"""The plain covariance of two harmonics with sigma² = 70 and mirror images, and the anatomical prior."""
LEVELS = np.array([0.5, 0.8, 0.95])


@dataclass(frozen=True)
class ViewPosteriors:
    """Errors of view angles and their posteriors.

    Attributes
    ----------
    rows : DataFrame
        A row to each person, method and view: absolute error of the highest mode; standard deviation about it;
        probability more than a right angle away.
    bars : DataFrame
        A row to each person, method, kind of bars and level: what they cover over views, and their half width.
    view_angle_deg : (A,)
    candidate_deg : (F,)
    density : (A, F)
        Of the anatomical prior, about the true angle, mean over people; per degree.
    """

    rows: pd.DataFrame
    bars: pd.DataFrame
    view_angle_deg: np.ndarray
    candidate_deg: np.ndarray
    density: np.ndarray


class ViewAngleBars(Sweep):
    """Posterior of the view angle."""

    seen_from_deg: Swept = scaled(start=-90, stop=90, step="structure_step_deg")  # true views
    noise_variance_mm2: Positive = 70.0  # of the plain covariance

    def measure(self, inputs: AnatomicalInputs) -> ViewPosteriors:
        """Return the view angles and their posteriors."""
        view_deg = self.seen_from_deg.values("sweep.seen_from_deg")
        view = np.radians(view_deg)
        people = People(inputs.dataset, inputs.model)
        options: AnatomicalModel = inputs.model_options
        if not options.mirror:
            raise InvalidInput("half of the circle stands for all of it", "model.mirror", "true")
        plain = replace(
            approach_two(self.noise_variance_mm2), shrinkage=replace(PLAIN, mirror=True), all_walks=True
        )
        settings = (plain, anatomical_setting(options, people.harmonics))

        def one(person: int) -> tuple[list[pd.DataFrame], np.ndarray, np.ndarray]:
            fold = people.fold(person)
            rows = []
            for method, setting in zip(METHODS, settings, strict=True):
                shown = people.in_image_axes(person, view)[:, :, :2, : 1 + 2 * setting.harmonics]
                costs = anatomical.view_costs(fold.prior(setting), shown, CANDIDATES, noise=setting.noise)
                found = anatomical.posterior_of(costs)
                off = statistics.angle_difference_deg(np.degrees(found.angle_rad), view_deg)
                columns = {
                    "person": inputs.model.people[person],
                    "method": method,
                    "view_angle_deg": view_deg,
                    "absolute_angle_error_deg": np.abs(off),
                    "posterior_sd_deg": np.degrees(found.sd_rad),
                    "other_share": np.clip(found.other_share, 0.0, 1.0),
                }
                rows.append(pd.DataFrame(columns))
            return rows, np.radians(found.density), np.degrees(found.angles_rad)

        folds = map_processes(one, range(people.count), inputs.workers)
        rows = pd.concat([frame for fold in folds for frame in fold[0]], ignore_index=True)
        bars = []
        for method, of in rows.groupby("method", sort=False):
            off, sd = (
                of[name].to_numpy().reshape(people.count, -1)
                for name in ("absolute_angle_error_deg", "posterior_sd_deg")
            )
            learnt = anatomical.multipliers_without((off / sd)[..., None], np.zeros(1, int), LEVELS)[:, 0]
            textbook = np.broadcast_to(ndtri(0.5 + LEVELS / 2.0), learnt.shape)
            for kind, multipliers in zip(BARS, (textbook, learnt), strict=True):
                for number, level in enumerate(LEVELS):
                    half = multipliers[:, None, number] * sd
                    columns = {
                        "person": inputs.model.people,
                        "method": method,
                        "bars": kind,
                        "level_percent": 100.0 * level,
                        "covered_percent": 100.0 * (off <= half).mean(axis=1),
                        "half_width_deg": half.mean(axis=1),
                    }
                    bars.append(pd.DataFrame(columns))
        return ViewPosteriors(
            rows=rows,
            bars=pd.concat(bars, ignore_index=True),
            view_angle_deg=view_deg,
            candidate_deg=folds[0][2],
            density=np.mean([fold[1] for fold in folds], axis=0),
        )
