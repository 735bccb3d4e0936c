"""Estimated against true view angle: zhang2007 figure 6, zhang2004 figure 5."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Reference, Sheet
from pipeline.core import statistics
from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.replicated import interval_over_people
from pipeline.studies.study import Figure
from pipeline.studies.walks.figures.presentation import CURVES, VIEW
from pipeline.studies.walks.unknown_view import UnknownView, ViewAngles

Inputs = FigureInputs[FourierSamples, Eigenwalkers, ViewAngles]


@dataclass(kw_only=True)
class ViewAngleEstimates(Figure):
    """Estimated against true view angle."""

    model = EigenwalkersModel
    sweep = UnknownView
    over_people = ("table", "table_people")
    sequence = timeline = "view_angle_deg"

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """Return ``table``: per method and view; ``table_people``: the error of every walker at every view.

        ``table_walkers``: per walker and method, mean over views.  ``table_published``: the error of every walker by
        the solver of appendix B, where it was tried.
        """
        sweep, person = inputs.sweep, inputs.dataset.person
        names = [*sweep.methods.tolist(), *sweep.nulls.tolist()]
        views, estimated = sweep.view_angle_deg, np.concatenate([sweep.angle_deg, sweep.null_angle_deg])
        error = statistics.angle_difference_deg(estimated, views)
        failed = np.abs(error) > sweep.failure_deg
        mean_error = statistics.circular_mean_deg(error, axis=1)
        low, high = interval_over_people(person, np.swapaxes(error, 0, 1))
        of_published = {}
        if len(sweep.published_view_deg):
            of_published["table_published"] = _errors_of_people(
                inputs, names, sweep.published_view_deg, sweep.published_angle_deg
            )
        own, own_failed = error[: len(sweep.methods)], failed[: len(sweep.methods)]
        return {
            **of_published,
            "table": tidy(
                {
                    "method": np.array(names)[:, None],
                    "view_angle_deg": views,
                    "estimated_mean_deg": views + mean_error,
                    "estimated_mean_deg_low": views + low,
                    "estimated_mean_deg_high": views + high,
                    "estimated_sd_deg": statistics.circular_sd_deg(error, axis=1),
                    "absolute_angle_error_median_deg": np.median(np.abs(error), axis=1),
                    "failures": failed.sum(axis=1),
                    "walkers": len(person),
                },
                by=["method", "view_angle_deg"],
            ),
            "table_people": _errors_of_people(inputs, names, views, estimated),
            "table_walkers": tidy(
                {
                    "person": person,
                    "walker": inputs.samples,
                    "method": sweep.methods[:, None],
                    "mean_error_deg": statistics.circular_mean_deg(own, axis=2),
                    "absolute_angle_error_median_deg": np.median(np.abs(own), axis=2),
                    "absolute_angle_error_max_deg": np.abs(own).max(axis=2),
                    "failures": own_failed.sum(axis=2),
                    "runner_up_cost_ratio_min": (sweep.runner_up_cost / sweep.cost).min(axis=2),
                    "not_converged": (~sweep.converged).sum(axis=2),
                },
                by=["walker", "method"],
            ),
        }

    def charts(self, inputs: Inputs, tables: dict[str, pd.DataFrame]) -> Sheet:
        """Estimated against true angle, what is left of it, and the median of its size."""
        view = partial(Chart, **{**VIEW, "x_label": "true view angle"}, by="method", styles=CURVES)
        estimate = partial(view, y="estimated_mean_deg", band="estimated_sd_deg")
        charts = [
            estimate(label="estimated view angle", references=[Reference(slope=1.0)]),
            estimate(
                label="estimate less truth",
                less="view_angle_deg",
                name="error_deg",
                references=[Reference(y=0.0)],
            ),
            view(y="absolute_angle_error_median_deg", label="median error", zero=True),
        ]
        notes = [
            _note(tables["table"], str(method), inputs.sweep.failure_deg) for method in inputs.sweep.methods
        ]
        return Sheet(
            charts=charts,
            columns=2,
            caption="Bands: ±1 standard deviation over walkers, and 95 % interval of the mean over people. "
            + " ".join(notes),
        )


def _note(table: pd.DataFrame, method: str, failure_deg: float) -> str:
    """Return what the caption says of a method."""
    rows = table[table["method"] == method]
    off = (rows["estimated_mean_deg"] - rows["view_angle_deg"]).abs().mean()
    return (
        f"{CURVES[method].label}: means off by {off:.2f}°, sd {rows['estimated_sd_deg'].mean():.2f}°, off by more than "
        f"{failure_deg:g}° {rows['failures'].sum()} of {rows['walkers'].sum()} times."
    )


def _errors_of_people(
    inputs: Inputs, methods: list[str], views: np.ndarray, estimated_deg: np.ndarray
) -> pd.DataFrame:
    """Return a row for every walker, method (M,) and view (A,), from the estimated angles (M, R, A)."""
    error = statistics.angle_difference_deg(estimated_deg, views)
    return tidy(
        {
            "person": inputs.dataset.person[:, None],
            "walker": np.array(inputs.samples)[:, None],
            "method": np.array(methods)[:, None, None],
            "view_angle_deg": views,
            "error_deg": error,
            "failed": (np.abs(error) > inputs.sweep.failure_deg).astype(int),
        },
        by=["walker", "method", "view_angle_deg"],
    )
