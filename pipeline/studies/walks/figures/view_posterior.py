"""The view angle with its posterior: our figure beside zhang2007's figure 6."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.special import ndtri

from pipeline import pictures, recordings
from pipeline.core import anatomical, statistics
from pipeline.palette import Style
from pipeline.seeding import derive_generator
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.study import Figure
from pipeline.studies.walks.anatomical_model import AnatomicalModel, AnatomicalWalkers
from pipeline.studies.walks.figures.ladder import one_row
from pipeline.studies.walks.figures.presentation import VIEW_AXIS
from pipeline.studies.walks.people_intervals import PeopleResampled
from pipeline.studies.walks.sweeps.held_out import BARS
from pipeline.studies.walks.sweeps.view_posterior import ViewAngleBars, ViewPosteriors

Inputs = FigureInputs[FourierSamples, AnatomicalWalkers, ViewPosteriors]

METHODS = {
    "two_harmonics": Style("two harmonics, plain covariance", "map", line="dashed"),
    "anatomical": Style("anatomical prior", "green"),
}
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

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Error and posterior width by view; the posterior about the true angle; error against width."""
        sweep = inputs.sweep
        off = np.abs(statistics.angle_difference_deg(sweep.angle_deg, sweep.view_angle_deg))
        best = sweep.methods.tolist().index("anatomical")
        from_truth = statistics.angle_difference_deg(sweep.candidate_deg[None], sweep.view_angle_deg[:, None])
        middle = len(sweep.view_angle_deg) // 2
        shown = np.abs(from_truth[middle]) <= 20.0
        order = np.argsort(from_truth[middle][shown], kind="stable")
        sure, wrong = sweep.sd_deg[best].ravel(), off[best].ravel()
        top = float(max(sure.max(), wrong.max())) * 1.03
        panels = [
            pictures.Panel(
                y="absolute_angle_error_mean_deg",
                band=("absolute_angle_error_mean_deg_low", "absolute_angle_error_mean_deg_high"),
                x="view_angle_deg",
                xlabel=VIEW_AXIS,
                ylabel="Mean error (degree)",
                xticks=30,
                from_zero=True,
            ),
            pictures.Panel(
                y="posterior_sd_deg",
                x="view_angle_deg",
                xlabel=VIEW_AXIS,
                ylabel="Posterior sd (degree)",
                xticks=30,
                from_zero=True,
            ),
            pictures.Panel(
                series=[
                    pictures.Series(
                        x=from_truth[middle][shown][order],
                        y=sweep.density[middle][shown][order],
                        colour="green",
                    )
                ],
                xlabel="Candidate less true angle (degree)",
                ylabel="Density, mean over people",
                from_zero=True,
                annotation=f"seen from {sweep.view_angle_deg[middle]:g}°",
            ),
            pictures.Panel(
                series=[
                    pictures.Series(x=sure, y=wrong, colour="green", line="points"),
                    pictures.Series(
                        x=np.array([0.0, top / 1.96]), y=np.array([0.0, top]), colour="reference"
                    ),
                ],
                xlabel="Posterior sd (degree)",
                ylabel="Error (degree)",
                from_zero=True,
                annotation="line: 95 % should lie below",
            ),
        ]
        pictures.draw_lines(
            stem,
            panels,
            tables["table"],
            by="method",
            styles=METHODS,
            columns=2,
            legend="figure",
            caption=f"{inputs.caption} Bands: 95 % intervals over people.",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Error and posterior width over view angle; the posterior as a matrix."""
        table, sweep = tables["table"], inputs.sweep
        with inputs.recording(
            folder, "\nThe matrix: true angle down, candidates across.\n", timeline="view_angle_deg"
        ) as rec:
            for column in ("absolute_angle_error_mean_deg", "posterior_sd_deg"):
                rec.curves(table, x="view_angle_deg", y=column, by="method", styles=METHODS)
            rec.matrix("matrices/posterior", sweep.density)
            rec.blueprint(
                recordings.Columns(
                    recordings.Rows(
                        recordings.Plot(name="mean error (°)", origin="curves/absolute_angle_error_mean_deg"),
                        recordings.Plot(name="posterior sd (°)", origin="curves/posterior_sd_deg"),
                    ),
                    recordings.Rows(recordings.Matrix(name="posterior over the circle"), recordings.Notes()),
                    shares=(1, 1),
                )
            )
