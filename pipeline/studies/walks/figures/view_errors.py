"""Errors and missing variance against view angle: zhang2007 figure 5, zhang2004 figure 4."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline import pictures, recordings
from pipeline.core import camera, errors, fourier
from pipeline.core.reconstruction import from_known_views
from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import FigureInputs, sd, tidy
from pipeline.studies.presentation import lift
from pipeline.studies.study import Figure
from pipeline.studies.walks.dataset import FourierSamples
from pipeline.studies.walks.figures.presentation import METHODS, VIEW_AXIS
from pipeline.studies.walks.known_view import KnownView, KnownViewErrors
from pipeline.studies.walks.model import Eigenwalkers, EigenwalkersModel

_INSTANT = 0.25
"""Fraction of the cycle at which the recording shows the walker: the left ankle is farthest ahead of the right."""


Inputs = FigureInputs[FourierSamples, Eigenwalkers, KnownViewErrors]


@dataclass(kw_only=True)
class ViewErrors(Figure):
    """Errors and missing variance against view angle."""

    model = EigenwalkersModel
    sweep = KnownView
    sequence = "view_angle_deg"

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """``table``: per method and view; ``table_walkers``: per walker and method, mean over views."""
        sweep = inputs.sweep
        views, variance = sweep.view_angle_deg, sweep.missing_variance_mm2
        absolute = errors.walker_error(sweep.absolute_error_mm2)
        relative = errors.walker_error(sweep.relative_error)
        methods, walkers, angles = absolute.shape
        return {
            "table": tidy(
                {
                    "method": np.repeat(sweep.methods.tolist(), angles),
                    "view_angle_deg": np.tile(views, methods),
                    "absolute_error_mm2": absolute.mean(axis=1).ravel(),
                    "absolute_error_sd_mm2": sd(absolute, 1).ravel(),
                    "rms_error_mm": np.sqrt(absolute).mean(axis=1).ravel(),
                    "relative_error": relative.mean(axis=1).ravel(),
                    "relative_error_sd": sd(relative, 1).ravel(),
                    "missing_variance_mm2": np.tile(variance.mean(axis=0), methods),
                    "missing_variance_sd_mm2": np.tile(sd(variance, 0), methods),
                },
                by=["method", "view_angle_deg"],
            ),
            "table_walkers": tidy(
                {
                    "walker": np.tile(inputs.samples, methods),
                    "method": np.repeat(sweep.methods.tolist(), walkers),
                    "absolute_error_mm2": absolute.mean(axis=2).ravel(),
                    "relative_error": relative.mean(axis=2).ravel(),
                },
                by=["walker", "method"],
            ),
        }

    def arrays(self, inputs: Inputs) -> dict[str, np.ndarray]:
        """Return the walkers themselves: the report makes each fold of them, and reconstructs from any view."""
        data = inputs.dataset
        return {
            "samples": inputs.model.samples,
            "residual_covariance_mm2": data.residual_covariance,
            "temporal_covariance_mm2": data.temporal_covariance,
            "walker_frequency_hz": data.frequency_hz,
            "person": data.person,
        }

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Three panels: absolute error, relative error, variance of the missing dimension."""
        methods = inputs.sweep.methods.tolist()
        panel = partial(pictures.Panel, from_zero=True, xticks=30)
        absolute = panel(
            y="absolute_error_mm2", band="absolute_error_sd_mm2", ylabel="Absolute error (mm$^2$)"
        )
        relative = panel(y="relative_error", band="relative_error_sd", ylabel="Relative error")
        variance = panel(
            y="missing_variance_mm2",
            band="missing_variance_sd_mm2",
            ylabel="Variance (mm$^2$)",
            by="",
            where={"method": methods[0]},  # the same for every method
        )
        # zhang2004 prints the variance between the two errors; zhang2007 after them.
        printed_last = inputs.experiment.paper == "zhang2007"
        pictures.draw_lines(
            stem,
            [absolute, relative, variance] if printed_last else [absolute, variance, relative],
            tables["table"],
            x="view_angle_deg",
            by="method",
            styles=METHODS if len(methods) > 1 else pictures.Style(colour="black"),
            xlabel=VIEW_AXIS,
            caption=f"{inputs.caption} Bands: ±1 standard deviation over walkers, as far as the axes go.",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """The curves over view angle; one walker, seen and reconstructed from the angle at the cursor."""
        table = tables["table"]
        sweep, data, model = inputs.sweep, inputs.dataset, inputs.model
        views, angles = np.rint(sweep.view_angle_deg).astype(int), np.radians(sweep.view_angle_deg)
        absolute = errors.walker_error(sweep.absolute_error_mm2)
        walker = int(np.argsort(absolute[0].mean(axis=1))[absolute.shape[1] // 2])  # the median one
        fold = model.fold(walker)
        truth = data.coefficients[walker]
        index = {"view_angle_deg": views}
        instant = np.array([_INSTANT])
        posture = fourier.synthesise(truth, 1.0, instant)[0]
        ground = lift(posture)
        with inputs.recording(
            folder,
            f"\nThe walker shown is {inputs.samples[walker]}, the one of median error. Drag the cursor: the image "
            "is what the camera at that angle sees, the coloured skeletons what each approach makes of it"
            + (" (at the phase of the 3D motion).\n" if sweep.phase_rad is not None else ".\n"),
            timeline="view_angle_deg",
        ) as rec:
            for measure, spread in (
                ("absolute_error_mm2", "absolute_error_sd_mm2"),
                ("relative_error", "relative_error_sd"),
            ):
                rec.curves(table, x="view_angle_deg", y=measure, by="method", sd=spread, styles=METHODS)
            rec.curves(
                table,
                x="view_angle_deg",
                y="missing_variance_mm2",
                sd="missing_variance_sd_mm2",
                where={"method": sweep.methods[0]},  # the same for every method
                styles=recordings.Style("variance of the missing dimension", "green"),
                entity="curves/missing_variance_mm2/truth",
            )
            for method in sweep.methods.tolist():
                noise = sweep.noise_variance_mm2 if method == "map" else None
                found = from_known_views(fold, model.samples[walker], angles, noise_variance=noise)
                again = [
                    fourier.synthesise(camera.combine(camera.project(truth, a), missing, a), 1.0, instant)[0]
                    for a, missing in zip(angles, found.missing, strict=True)
                ]
                rec.skeleton(
                    f"world/reconstructed/{method}",
                    np.stack(again) + ground,
                    WALKER15.bones,
                    index=index,
                    colour=METHODS[method].colour,
                )
            rec.skeleton(
                "world/original",
                np.repeat(posture[None] + ground, len(views), axis=0),
                WALKER15.bones,
                index=index,
            )
            seen = np.stack([camera.project(posture, a) for a in angles])
            rec.image_points("image/observed", seen, WALKER15.bones, index=index)
            rec.blueprint(
                recordings.Columns(
                    recordings.Rows(
                        recordings.Plot(name="absolute error (mm²)", origin="curves/absolute_error_mm2"),
                        recordings.Plot(name="relative error", origin="curves/relative_error"),
                        recordings.Plot(
                            name="variance of the missing dimension (mm²)",
                            origin="curves/missing_variance_mm2",
                        ),
                    ),
                    recordings.Rows(
                        recordings.Space3D(name="original and reconstructed"),
                        recordings.Columns(recordings.Image2D(name="observed"), recordings.Notes()),
                        shares=(3, 2),
                    ),
                    shares=(1, 1),
                )
            )
