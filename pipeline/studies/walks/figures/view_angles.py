"""Estimated against true view angle: zhang2007 figure 6, zhang2004 figure 5."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Reference, Sheet
from pipeline.core import statistics
from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.replicated import aggregate
from pipeline.studies.study import Figure, Tables, Traits
from pipeline.studies.walks import methods
from pipeline.studies.walks.methods import VIEW
from pipeline.studies.walks.unknown_view import UnknownView, ViewAngles

Inputs = FigureInputs[FourierSamples, Eigenwalkers, ViewAngles]

MIN_RANGE_DEG = 5.0
"""Smallest range of the axis of view-angle errors, in degrees on either side of zero."""


class ViewAngleEstimates(Figure):
    """Figure of the estimated view angle against the true view angle."""

    model = EigenwalkersModel
    sweep = UnknownView
    traits = Traits(
        over_people=("table_people",),
        ranked_by=("table", "error_deg"),
        abscissa="view_angle_deg",
        rows_of={"estimated_mean_deg": "error_deg"},
        sequence="view_angle_deg",
        timeline="view_angle_deg",
    )

    def tables(self, inputs: Inputs) -> Tables:
        """Return ``table`` with errors by method and view, and ``table_people`` with errors of every walker.

        ``table_walkers``: per walker and method, mean over views.  ``table_published``: the error of every walker by
        the solver of appendix B, if it was used.
        """
        by, of_walker = ["method", "view_angle_deg"], ["person", "walker", "method"]
        # Every walker is seen from every view, so the sorted rows are groups of equal length.
        rows = inputs.sweep.rows.sort_values(by)
        errors = rows["error_deg"].to_numpy().reshape(rows.groupby(by).ngroups, -1)
        mean = statistics.circular_mean_deg(errors)
        # Errors are unwrapped about the circular mean, so that the interval belongs to the same mean.
        turns = np.round((errors - mean[:, None]) / 360.0)
        rows = rows.assign(
            absolute_error_deg=rows["error_deg"].abs(), near_deg=(errors - 360.0 * turns).ravel()
        )
        columns = {
            "estimated_mean_deg": ("near_deg", "mean"),
            "absolute_angle_error_median_deg": ("absolute_error_deg", "median"),
            "failures": ("failed", "sum"),
        }
        table = aggregate(rows, by, columns, ["estimated_mean_deg"], cluster="person", count="walkers")
        table["walkers"] = table.pop("walkers")
        table["estimated_mean_deg"] = mean
        position = list(table).index("absolute_angle_error_median_deg")
        table.insert(position, "estimated_sd_deg", statistics.circular_sd_deg(errors))
        for name in ("estimated_mean_deg", "estimated_mean_deg_low", "estimated_mean_deg_high"):
            table[name] += table["view_angle_deg"]
        of_methods = rows[rows["method"].isin(inputs.sweep.methods)]
        of_methods = of_methods.assign(
            ratio=of_methods["runner_up_cost"] / of_methods["cost"], lost=~of_methods["converged"]
        )
        walkers = of_methods.groupby(of_walker, as_index=False).agg(
            absolute_angle_error_median_deg=("absolute_error_deg", "median"),
            absolute_angle_error_max_deg=("absolute_error_deg", "max"),
            failures=("failed", "sum"),
            runner_up_cost_ratio_min=("ratio", "min"),
            not_converged=("lost", "sum"),
        )
        errors = of_methods.sort_values(of_walker)["error_deg"].to_numpy().reshape(len(walkers), -1)
        walkers.insert(3, "mean_error_deg", statistics.circular_mean_deg(errors))
        summaries = {"table": table, "table_walkers": tidy(walkers, by=["walker", "method"])}
        each = ["person", "walker", *by, "error_deg", "failed"]
        every = {"table_people": rows, "table_published": inputs.sweep.published}
        return summaries | {
            name: tidy(frame[each], by=["walker", *by]) for name, frame in every.items() if len(frame)
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Charts of the estimated view angle, its error and its median absolute error, against the true view angle."""
        styles = methods.styles(inputs.sweep.methods.tolist())
        abscissa = replace(VIEW["abscissa"], label="true view angle")
        view = partial(Chart, **VIEW | {"abscissa": abscissa}, by="method", styles=styles)
        estimate = partial(view, y="estimated_mean_deg", band="estimated_sd_deg")
        drawn = tables["table"][tables["table"]["method"].isin(styles)]
        left = drawn["estimated_mean_deg"] - drawn["view_angle_deg"]
        limit = max(MIN_RANGE_DEG, 1.1 * left.abs().max())
        charts = [
            estimate(label="estimated view angle", references=[Reference(slope=1.0)]),
            estimate(
                label="estimate less truth",
                less="view_angle_deg",
                name="error_deg",
                references=[Reference(y=0.0)],
                limits=(-limit, limit),
            ),
            view(y="absolute_angle_error_median_deg", label="median error", zero=True),
        ]
        notes = [
            _note(tables["table"], method, inputs.sweep.failure_deg)
            for method in methods.chosen(inputs.sweep.methods.tolist())
        ]
        return Sheet(
            charts=charts,
            columns=2,
            caption=f"Bands: ± standard deviation over walkers, and {inputs.banded}. " + " ".join(notes),
        )


def _note(table: pd.DataFrame, method: methods.Method, failure_deg: float) -> str:
    """Return the caption's sentence on the view-angle errors of one method."""
    rows = table[table["method"] == method.name]
    off = (rows["estimated_mean_deg"] - rows["view_angle_deg"]).abs().mean()
    return (
        f"{method.style.label}: means off by {off:.2f}°, sd {rows['estimated_sd_deg'].mean():.2f}°, off by more than "
        f"{failure_deg:g}° {rows['failures'].sum()} of {rows['walkers'].sum()} times."
    )
