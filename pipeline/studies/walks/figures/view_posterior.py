"""The view angle with its posterior: our figure beside zhang2007's figure 6."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from scipy.special import ndtri

from pipeline.charts import Chart, Reference, Sheet
from pipeline.core import anatomical, statistics
from pipeline.palette import Style
from pipeline.scenes import Columns, Matrix, Notes, Rows
from pipeline.seeding import derive_generator
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.study import Figure
from pipeline.studies.walks.anatomical_model import AnatomicalModel, AnatomicalWalkers
from pipeline.studies.walks.figures.ladder import one_row
from pipeline.studies.walks.figures.presentation import VIEW
from pipeline.studies.walks.people_intervals import PeopleResampled
from pipeline.studies.walks.sweeps.held_out import BARS
from pipeline.studies.walks.sweeps.view_posterior import ViewAngleBars, ViewPosteriors

if TYPE_CHECKING:
    from pipeline.recordings import Recorder

Inputs = FigureInputs[FourierSamples, AnatomicalWalkers, ViewPosteriors]

METHODS = {
    "two_harmonics": Style("two harmonics, plain covariance", "map", line="dashed"),
    "anatomical": Style("anatomical prior", "green"),
}
NEAR_DEG = 20.0
"""How far from the truth the posterior is drawn."""

LEVELS = np.array([0.5, 0.8, 0.95])


@dataclass(kw_only=True)
class ViewPosterior(Figure):
    """View angles, how sure, and whether surely right."""

    model = AnatomicalModel
    sweep = ViewAngleBars

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """``table``: by method and view; ``table_bars``: by level; ``table_walkers``: by walker."""
        sweep = inputs.sweep
        methods, views = sweep.methods.tolist(), sweep.view_angle_deg
        people = PeopleResampled(len(inputs.model.people), derive_generator(inputs.experiment.seed, "people"))
        off = np.abs(statistics.angle_difference_deg(sweep.angle_deg, views))  # (M, P, A)
        rows, bars, walkers = [], [], []
        for m, method in enumerate(methods):
            rows += [
                {
                    "method": method,
                    "view_angle_deg": view,
                    "absolute_angle_error_median_deg": float(np.median(off[m, :, a])),
                    **one_row(people.mean(off[m, :, a]), "absolute_angle_error_mean_deg"),
                    "posterior_sd_deg": float(sweep.sd_deg[m, :, a].mean()),
                    "wrong_way": int((off[m, :, a] > 90.0).sum()),
                    "other_way_percent": round(100.0 * float(sweep.other_share[m, :, a].max()), 6),
                    "walkers": off.shape[1],
                }
                for a, view in enumerate(views.tolist())
            ]
            z = (off[m] / sweep.sd_deg[m])[..., None]  # (P, A, 1)
            learnt = anatomical.multipliers_without(z, np.zeros(1, dtype=int), LEVELS)[:, 0]
            textbook = np.broadcast_to(ndtri(0.5 + LEVELS / 2.0), learnt.shape)
            for kind, multipliers in zip(BARS, (textbook, learnt), strict=True):
                for number, level in enumerate(LEVELS.tolist()):
                    half = multipliers[:, None, number] * sweep.sd_deg[m]
                    covered = 100.0 * (off[m] <= half).mean(axis=1)
                    bars.append(
                        {
                            "method": method,
                            "bars": kind,
                            "level_percent": 100.0 * level,
                            **one_row(people.mean(covered), "covered_percent"),
                            "half_width_deg": float(half.mean()),
                        }
                    )
            half = multipliers[:, None, -1] * sweep.sd_deg[m]  # calibrated, 95 %
            walkers += [
                {
                    "person": who,
                    "walker": who,
                    "method": method,
                    "absolute_angle_error_median_deg": float(np.median(off[m, p])),
                    "absolute_angle_error_max_deg": float(off[m, p].max()),
                    "posterior_sd_deg": float(sweep.sd_deg[m, p].mean()),
                    "covered_percent": 100.0 * float((off[m, p] <= half[p]).mean()),
                }
                for p, who in enumerate(inputs.model.people)
            ]
        return {
            "table": tidy(rows, by=["method", "view_angle_deg"]),
            "table_bars": tidy(bars, by=["method", "bars", "level_percent"]),
            "table_walkers": tidy(walkers, by=["walker", "method"]),
        }

    def charts(self, inputs: Inputs, tables: dict[str, pd.DataFrame]) -> Sheet:
        """Error and posterior width by view; the posterior about the true angle; error against width."""
        sweep = inputs.sweep
        off = np.abs(statistics.angle_difference_deg(sweep.angle_deg, sweep.view_angle_deg))
        best, middle = sweep.methods.tolist().index("anatomical"), len(sweep.view_angle_deg) // 2
        from_truth = statistics.angle_difference_deg(sweep.candidate_deg, sweep.view_angle_deg[middle])
        near = np.abs(from_truth) <= NEAR_DEG
        about_truth = {
            "candidate_less_true_angle_deg": from_truth[near],
            "density": sweep.density[middle][near],
        }
        errors = {
            "posterior_standard_deviation_deg": sweep.sd_deg[best].ravel(),
            "error_deg": off[best].ravel(),
        }
        view = partial(Chart, **VIEW, by="method", styles=METHODS, zero=True)
        charts = [
            view(y="absolute_angle_error_mean_deg", label="mean error"),
            view(y="posterior_sd_deg", label="posterior standard deviation"),
            Chart(
                table=about_truth, x="candidate_less_true_angle_deg", y="density",
                zero=True,
                label="density, mean over people", styles=Style("", "green"),
                note=f"seen from {sweep.view_angle_deg[middle]:g}°",
            ),
            Chart(
                table=errors, x="posterior_standard_deviation_deg", y="error_deg",
                styles=Style("", "green", line="points"), zero=True, note="line: 95 % should lie below", page=False,
                references=[Reference(slope=1.96)],
            ),
        ]  # fmt: skip
        return Sheet(charts=charts, columns=2, caption="Bands: 95 % intervals over people.")

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], begin: Recorder) -> None:
        """Error and posterior width over view angle; the posterior as a matrix."""
        with begin("\nThe matrix: true angle down, candidates across.\n", timeline="view_angle_deg") as rec:
            rec.matrix("matrices/posterior", inputs.sweep.density)
            beside = Rows(Matrix(name="posterior over the circle"), Notes())
            rec.blueprint(Columns(Rows(*rec.plots), beside))
