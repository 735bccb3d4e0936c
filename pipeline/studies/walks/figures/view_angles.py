"""Estimated against true view angle: zhang2007 figure 6, zhang2004 figure 5."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline import pictures, recordings
from pipeline.core import statistics
from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.replicated import interval_over_people
from pipeline.studies.study import Figure
from pipeline.studies.walks.figures.presentation import CURVES, NULLS, VIEW_AXIS
from pipeline.studies.walks.unknown_view import UnknownView, ViewAngles

Inputs = FigureInputs[FourierSamples, Eigenwalkers, ViewAngles]


@dataclass(kw_only=True)
class ViewAngleEstimates(Figure):
    """Estimated against true view angle."""

    model = EigenwalkersModel
    sweep = UnknownView
    over_people = ("table", "table_people")
    sequence = "view_angle_deg"

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

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Mean estimated angle (solid) and one standard deviation on either side (dashed), a panel to a method."""
        table, methods = tables["table"], inputs.sweep.methods.tolist()
        mean, spread = table["estimated_mean_deg"], table["estimated_sd_deg"]
        edges = table.assign(low=mean - spread, high=mean + spread)
        solid = pictures.Style("mean", "black")
        dashed = pictures.Style("±1 sd", "black", line="dashed")
        nothing = NULLS["average_walker"]
        around = partial(pictures.series, edges, x="view_angle_deg", where={"method": "average_walker"})
        panels = []
        for method in methods:
            line = partial(pictures.series, edges, x="view_angle_deg", where={"method": method})
            panels.append(
                pictures.Panel(
                    series=[
                        *line(
                            y="estimated_mean_deg",
                            styles=solid,
                            band=("estimated_mean_deg_low", "estimated_mean_deg_high"),
                        ),
                        *line(y="low", styles=dashed),
                        *line(y="high", styles=replace(dashed, label="")),
                        *around(y="low", styles=replace(nothing, label="average walker ±1 sd")),
                        *around(y="high", styles=replace(nothing, label="")),
                    ],
                    xlabel=VIEW_AXIS,
                    ylabel="Reconstructed viewpoint (degree)",
                    xticks=30,
                    annotation=_note(table[table["method"] == method], method, inputs.sweep.failure_deg),
                )
            )
        pictures.draw_lines(
            stem,
            panels,
            columns=len(panels),
            legend="figure",
            caption=f"{inputs.caption} Band: 95 % interval of the mean over people.",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Estimate less truth over the true angle, with its spread; median error below."""
        table = tables["table"]
        table = table.assign(error_deg=table["estimated_mean_deg"] - table["view_angle_deg"])
        with inputs.recording(folder, timeline="view_angle_deg") as rec:
            for name, column, spread in (
                ("estimated_deg", "estimated_mean_deg", "estimated_sd_deg"),
                ("error_deg", "error_deg", "estimated_sd_deg"),
                ("absolute_error_median_deg", "absolute_angle_error_median_deg", ""),
            ):
                rec.curves(
                    table,
                    x="view_angle_deg",
                    y=column,
                    by="method",
                    sd=spread,
                    styles=CURVES,
                    entity=f"curves/{name}/{{series}}",
                )
            rec.blueprint(
                recordings.Columns(
                    recordings.Plot(
                        name="estimated view angle (°) ± sd over walkers", origin="curves/estimated_deg"
                    ),
                    recordings.Rows(
                        recordings.Plot(name="estimate less truth (°)", origin="curves/error_deg"),
                        recordings.Plot(
                            name="median absolute error (°)",
                            origin="curves/absolute_error_median_deg",
                        ),
                        recordings.Notes(),
                    ),
                    shares=(1, 1),
                )
            )


def _note(rows: pd.DataFrame, method: str, failure_deg: float) -> str:
    """Return what is written into a method's panel, from its rows of the table."""
    off = (rows["estimated_mean_deg"] - rows["view_angle_deg"]).abs().mean()
    return (
        f"{CURVES[method].label}\nmean over views: off by {off:.2f}°, sd {rows['estimated_sd_deg'].mean():.2f}°\n"
        f"off by more than {failure_deg:g}°: {rows['failures'].sum()} of {rows['walkers'].sum()}"
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
