"""The view angle with its posterior: our figure beside zhang2007's figure 6."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Reference, Sheet
from pipeline.core import statistics
from pipeline.palette import Style
from pipeline.scenes import Columns, Matrix, Notes, Rows
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.replicated import OVER_PEOPLE
from pipeline.studies.study import Figure, Recorder, Tables
from pipeline.studies.walks.anatomical_model import AnatomicalModel, AnatomicalWalkers
from pipeline.studies.walks.figures.presentation import VIEW
from pipeline.studies.walks.people_intervals import PeopleResampled
from pipeline.studies.walks.sweeps.held_out import BARS
from pipeline.studies.walks.sweeps.view_posterior import ViewAngleBars, ViewPosteriors

Inputs = FigureInputs[FourierSamples, AnatomicalWalkers, ViewPosteriors]

METHODS = {
    "two_harmonics": Style("two harmonics, plain covariance", "map", line="dashed"),
    "anatomical": Style("anatomical prior", "green"),
}
PARTS = 12
"""Of the posteriors, in the order of their width."""

NEAR_DEG = 20.0
"""How far from the truth the posterior is drawn."""


class ViewPosterior(Figure):
    """View angles, how sure, and whether surely right."""

    model = AnatomicalModel
    sweep = ViewAngleBars

    def tables(self, inputs: Inputs) -> Tables:
        """``table``: by method and view; ``table_bars``: by level; ``table_walkers``: by walker."""
        rows, bars, which = inputs.sweep.rows, inputs.sweep.bars, ["method", "view_angle_deg"]
        people = PeopleResampled(len(inputs.model.people), inputs.experiment.seed)
        error = "absolute_angle_error"
        table = []
        for (method, view), of in rows.groupby(which):
            off = of[f"{error}_deg"]
            table.append(
                {
                    "method": method,
                    "view_angle_deg": view,
                    f"{error}_median_deg": off.median(),
                    **people.mean(off, f"{error}_mean_deg"),
                    "posterior_sd_deg": of["posterior_sd_deg"].mean(),
                    "wrong_way": (off > 90.0).sum(),
                    "other_way_percent": round(100.0 * of["other_share"].max(), 6),
                    "walkers": len(of),
                }
            )
        each = rows.groupby(["person", "method"], as_index=False).agg(
            absolute_angle_error_median_deg=(f"{error}_deg", "median"),
            absolute_angle_error_max_deg=(f"{error}_deg", "max"),
            posterior_sd_deg=("posterior_sd_deg", "mean"),
        )
        calibrated = bars[(bars["bars"] == BARS[1]) & np.isclose(bars["level_percent"], 95.0)]
        each = each.merge(calibrated[["person", "method", "covered_percent"]], on=["person", "method"])
        each.insert(1, "walker", each["person"])
        return {
            "table": pd.DataFrame(table),
            "table_bars": people.means(
                bars, ["method", "bars", "level_percent"], "covered_percent", ["half_width_deg"]
            ),
            "table_walkers": tidy(each, by=["walker", "method"]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Error and posterior width by view; the posterior about the true angle; error against width."""
        sweep = inputs.sweep
        middle, best = len(sweep.view_angle_deg) // 2, sweep.rows[sweep.rows["method"] == "anatomical"]
        from_truth = statistics.angle_difference_deg(sweep.candidate_deg, sweep.view_angle_deg[middle])
        near = np.abs(from_truth) <= NEAR_DEG
        about_truth = {
            "candidate_less_true_angle_deg": from_truth[near],
            "density": sweep.density[middle][near],
        }
        errors = _by_width(best["posterior_sd_deg"].to_numpy(), best["absolute_angle_error_deg"].to_numpy())
        view = partial(Chart, **VIEW, by="method", styles=METHODS, zero=True)
        charts = [
            view(y="absolute_angle_error_mean_deg", label="mean error"),
            view(y="posterior_sd_deg", label="posterior standard deviation"),
            Chart(
                table=about_truth, x="candidate_less_true_angle_deg", y="density",
                zero=True,
                label="density, mean over people", styles=Style("", "green"),
                title=f"seen from {sweep.view_angle_deg[middle]:g}°",
            ),
            Chart(
                table=errors, x="posterior_standard_deviation_deg", y="error_deg", by="below",
                styles={"50": Style("half of the errors lie below", "green", width=0.7),
                        "95": Style("95 % lie below", "green")},
                zero=True, references=[Reference(slope=1.96, label="1.96 standard deviations")],
            ),
        ]  # fmt: skip
        return Sheet(charts=charts, columns=2, caption=f"Bands: {OVER_PEOPLE}.")

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Error and posterior width over view angle; the posterior as a matrix."""
        with begin(
            "\nThe matrix: true angle down, candidates across, in the same degrees.\n",
            timeline="view_angle_deg",
        ) as rec:
            steps = max(len(inputs.sweep.view_angle_deg) - 1, 1)
            degrees = max(len(inputs.sweep.candidate_deg) // (2 * steps), 1)
            rec.matrix("matrices/posterior", np.repeat(inputs.sweep.density, degrees, axis=0))
            beside = Rows(Matrix(name="posterior over the circle"), Notes())
            rec.blueprint(Columns(Rows(*rec.plots), beside))


def _by_width(sd_deg: np.ndarray, error_deg: np.ndarray) -> dict[str, np.ndarray]:
    """Median and 95 % of the errors (N,), in parts of equal size in the order of the posteriors' width."""
    parts = np.array_split(np.argsort(sd_deg, kind="stable"), min(PARTS, len(sd_deg)))
    return {
        "posterior_standard_deviation_deg": np.tile([np.median(sd_deg[p]) for p in parts], 2),
        "error_deg": np.array([np.percentile(error_deg[p], q) for q in (50, 95) for p in parts]),
        "below": np.repeat(["50", "95"], len(parts)),
    }
