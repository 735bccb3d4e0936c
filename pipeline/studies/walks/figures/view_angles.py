"""Estimated against true view angle: zhang2007 figure 6, zhang2004 figure 5."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.core import statistics
from pipeline.studies.figure_inputs import FigureInputs, columns_of, tidy
from pipeline.studies.study import Figure
from pipeline.studies.walks.dataset import FourierSamples
from pipeline.studies.walks.figures.presentation import METHOD_COLOURS, METHOD_NAMES, VIEW_AXIS
from pipeline.studies.walks.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.walks.unknown_view import UnknownView, ViewAngles

Inputs = FigureInputs[FourierSamples, Eigenwalkers, ViewAngles]


@dataclass(kw_only=True)
class ViewAngleEstimates(Figure):
    """Estimated against true view angle."""

    model = EigenwalkersModel
    sweep = UnknownView
    sequence = "view_angle_deg"

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """``table``: per method and view; ``table_walkers``: per walker and method, mean over views."""
        sweep = inputs.sweep
        views, estimated = sweep.view_angle_deg, sweep.angle_deg
        error = statistics.angle_difference_deg(estimated, views)
        failed = np.abs(error) > sweep.failure_deg
        methods, walkers, angles = estimated.shape
        mean_error = statistics.circular_mean_deg(error, axis=1)
        return {
            "table": tidy(
                {
                    "method": np.repeat(inputs.sweep.methods.tolist(), angles),
                    "view_angle_deg": np.tile(views, methods),
                    "estimated_mean_deg": (views + mean_error).ravel(),
                    "estimated_sd_deg": statistics.circular_sd_deg(error, axis=1).ravel(),
                    "absolute_angle_error_median_deg": np.median(np.abs(error), axis=1).ravel(),
                    "failures": failed.sum(axis=1).ravel(),
                    "walkers": np.full(methods * angles, walkers),
                },
                by=["method", "view_angle_deg"],
            ),
            "table_walkers": tidy(
                {
                    "walker": np.tile(inputs.samples, methods),
                    "method": np.repeat(inputs.sweep.methods.tolist(), walkers),
                    "mean_error_deg": statistics.circular_mean_deg(error, axis=2).ravel(),
                    "absolute_angle_error_median_deg": np.median(np.abs(error), axis=2).ravel(),
                    "absolute_angle_error_max_deg": np.abs(error).max(axis=2).ravel(),
                    "failures": failed.sum(axis=2).ravel(),
                    "runner_up_cost_ratio_min": (sweep.runner_up_cost / sweep.cost).min(axis=2).ravel(),
                    "not_converged": (~sweep.converged).sum(axis=2).ravel(),
                },
                by=["walker", "method"],
            ),
        }

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Mean estimated angle (solid) and one standard deviation on either side (dashed), a panel to a method."""
        from pipeline.pictures import curves as pictures  # drawing is slow to import, and not always wanted

        columns = columns_of(tables["table"])
        panels = []
        for m, method in enumerate(inputs.sweep.methods.tolist()):
            here = columns["method"] == method
            views, mean, spread = (
                columns[name][here] for name in ("view_angle_deg", "estimated_mean_deg", "estimated_sd_deg")
            )
            panels.append(
                pictures.Panel(
                    title=f"({'ab'[m]})" if len(inputs.sweep.methods.tolist()) > 1 else "",
                    series=[
                        pictures.Series(x=views, y=mean, label="mean", colour="black"),
                        pictures.Series(
                            x=views,
                            y=mean - spread,
                            style="dashed",
                            colour="black",
                            label="±1 standard deviation",
                        ),
                        pictures.Series(x=views, y=mean + spread, style="dashed", colour="black"),
                    ],
                    xlabel=VIEW_AXIS,
                    ylabel="Reconstructed viewpoint (degree)",
                    xlim=(float(views[0]), float(views[-1])),
                    xticks=[float(t) for t in range(-90, 91, 30) if views[0] <= t <= views[-1]],
                    annotation=_note(columns, here, method, inputs.sweep.failure_deg),
                )
            )
        pictures.curves(stem, panels, columns=len(panels), caption=inputs.caption)

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Estimate less truth over the true angle, with its spread; median error below."""
        from pipeline.recordings import recording  # drawing is slow to import, and not always wanted

        columns = columns_of(tables["table"])
        with recording.Recording(
            folder / "recording.rrd",
            name=inputs.experiment.name,
            about=inputs.about,
            timeline="view_angle_deg",
            edition=inputs.edition,
        ) as rec:
            for method in inputs.sweep.methods.tolist():
                here = columns["method"] == method
                views = np.rint(columns["view_angle_deg"][here]).astype(int)
                mean, spread = columns["estimated_mean_deg"][here], columns["estimated_sd_deg"][here]
                curves = {
                    "estimated_deg": (mean, spread),
                    "error_deg": (mean - views, spread),
                    "absolute_error_median_deg": (columns["absolute_angle_error_median_deg"][here], None),
                }
                for name, (values, band) in curves.items():
                    rec.curve(
                        f"curves/{name}/{method}",
                        views,
                        values,
                        sd=band,
                        label=METHOD_NAMES[method],
                        colour=METHOD_COLOURS[method],
                    )
            rec.blueprint(
                recording.Split(
                    "columns",
                    [
                        recording.Plot(
                            name="estimated view angle (°) ± sd over walkers", origin="curves/estimated_deg"
                        ),
                        recording.Split(
                            "rows",
                            [
                                recording.Plot(name="estimate less truth (°)", origin="curves/error_deg"),
                                recording.Plot(
                                    name="median absolute error (°)",
                                    origin="curves/absolute_error_median_deg",
                                ),
                                recording.Notes(),
                            ],
                        ),
                    ],
                    [1, 1],
                )
            )


def _note(columns: dict[str, np.ndarray], here: np.ndarray, method: str, failure_deg: float) -> str:
    off = np.abs(columns["estimated_mean_deg"][here] - columns["view_angle_deg"][here]).mean()
    failures, tries = columns["failures"][here].sum(), columns["walkers"][here].sum()
    return (
        f"{METHOD_NAMES[method]}\nmean over views: off by {off:.2f}°, "
        f"sd {columns['estimated_sd_deg'][here].mean():.2f}°\n"
        f"off by more than {failure_deg:g}°: {failures} of {tries}"
    )
