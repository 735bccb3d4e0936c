"""Errors and missing variance against view angle: zhang2007 figure 5, zhang2004 figure 4."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.core import camera, errors, fourier
from pipeline.core.reconstruction import from_known_views
from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import FigureInputs, columns_of, sd, tidy
from pipeline.studies.study import Figure
from pipeline.studies.walks.dataset import FourierSamples
from pipeline.studies.walks.figures.presentation import (
    METHOD_COLOURS,
    METHOD_NAMES,
    METHOD_STYLES,
    VIEW_AXIS,
    lift,
)
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
                    "method": np.repeat(inputs.sweep.methods.tolist(), angles),
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
                    "method": np.repeat(inputs.sweep.methods.tolist(), walkers),
                    "absolute_error_mm2": absolute.mean(axis=2).ravel(),
                    "relative_error": relative.mean(axis=2).ravel(),
                },
                by=["walker", "method"],
            ),
        }

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Three panels: absolute error, relative error, variance of the missing dimension."""
        from pipeline.pictures import curves as pictures  # drawing is slow to import, and not always wanted

        columns = columns_of(tables["table"])
        views = inputs.sweep.view_angle_deg
        # zhang2004 prints the variance between the two errors; zhang2007 after them.
        order = (0, 1, 2) if inputs.experiment.paper == "zhang2007" else (0, 2, 1)
        panels = []
        for letter, which in zip("abc", order, strict=True):
            _, value, spread, label = _PANELS[which]
            series = []
            for method in inputs.sweep.methods.tolist():
                here = columns["method"] == method
                single = value == "missing_variance_mm2"
                series.append(
                    pictures.Series(
                        x=views,
                        y=columns[value][here],
                        spread=columns[spread][here],
                        label=""
                        if single or len(inputs.sweep.methods.tolist()) == 1
                        else METHOD_NAMES[method],
                        style="solid" if single else METHOD_STYLES[method],
                        colour="black"
                        if single or len(inputs.sweep.methods.tolist()) == 1
                        else METHOD_COLOURS[method],
                    )
                )
                if single:
                    break
            panels.append(
                pictures.Panel(
                    title=f"({letter})",
                    series=series,
                    xlabel=VIEW_AXIS,
                    ylabel=label,
                    xlim=(float(views[0]), float(views[-1])),
                    ylim=(0.0, 1.04 * max(_top(line) for line in series)),
                    xticks=_ticks(views),
                )
            )
        pictures.curves(
            stem,
            panels,
            caption=f"{inputs.caption} Bands: ±1 standard deviation over walkers, as far as the axes go.",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """The curves over view angle; one walker, seen and reconstructed from the angle at the cursor."""
        from pipeline.recordings import recording  # drawing is slow to import, and not always wanted

        columns = columns_of(tables["table"])
        sweep, data, model = inputs.sweep, inputs.dataset, inputs.model
        views = np.rint(sweep.view_angle_deg).astype(int)
        absolute = errors.walker_error(sweep.absolute_error_mm2)
        walker = int(np.argsort(absolute[0].mean(axis=1))[absolute.shape[1] // 2])  # the median one
        fold = inputs.model.fold(walker)
        truth = data.coefficients[walker]
        index = {"view_angle_deg": views}
        instant = np.array([_INSTANT])
        posture = fourier.synthesise(truth, 1.0, instant)[0]
        ground = lift(posture)
        with recording.Recording(
            folder / "recording.rrd",
            name=inputs.experiment.name,
            about=inputs.about
            + f"\nThe walker shown is {inputs.samples[walker]}, the one of median error. Drag the cursor: the image "
            "is what the camera at that angle sees, the coloured skeletons what each approach makes of it"
            + (" (at the phase of the 3D motion).\n" if sweep.phase_rad is not None else ".\n"),
            timeline="view_angle_deg",
            edition=inputs.edition,
        ) as rec:
            for method in inputs.sweep.methods.tolist():
                here = columns["method"] == method
                for _, value, spread, _ in _PANELS[:2]:
                    rec.curve(
                        f"curves/{value}/{method}",
                        views,
                        columns[value][here],
                        sd=columns[spread][here],
                        label=METHOD_NAMES[method],
                        colour=METHOD_COLOURS[method],
                    )
                noise = inputs.sweep.noise_variance_mm2 if method == "map" else None
                found = from_known_views(
                    fold, model.samples[walker], np.radians(sweep.view_angle_deg), noise_variance=noise
                )
                again = np.stack(
                    [
                        fourier.synthesise(
                            camera.combine(camera.project(truth, a), found.missing[i], a), 1.0, instant
                        )[0]
                        for i, a in enumerate(np.radians(sweep.view_angle_deg))
                    ]
                )
                rec.skeleton(
                    f"world/reconstructed/{method}",
                    again + ground,
                    WALKER15.bones,
                    index=index,
                    colour=METHOD_COLOURS[method],
                )
            rec.curve(
                "curves/missing_variance_mm2/truth",
                views,
                sweep.missing_variance_mm2.mean(axis=0),
                sd=sd(sweep.missing_variance_mm2, 0),
                label="variance of the missing dimension",
                colour="green",
            )
            rec.skeleton(
                "world/original",
                np.repeat(posture[None] + ground, len(views), axis=0),
                WALKER15.bones,
                index=index,
            )
            seen = np.stack([camera.project(posture, a) for a in np.radians(sweep.view_angle_deg)])
            rec.image_points("image/observed", seen, WALKER15.bones, index=index)
            rec.blueprint(
                recording.Split(
                    "columns",
                    [
                        recording.Split(
                            "rows",
                            [
                                recording.Plot(
                                    name="absolute error (mm²)", origin="curves/absolute_error_mm2"
                                ),
                                recording.Plot(name="relative error", origin="curves/relative_error"),
                                recording.Plot(
                                    name="variance of the missing dimension (mm²)",
                                    origin="curves/missing_variance_mm2",
                                ),
                            ],
                        ),
                        recording.Split(
                            "rows",
                            [
                                recording.Space3D(name="original and reconstructed"),
                                recording.Split(
                                    "columns", [recording.Image2D(name="observed"), recording.Notes()]
                                ),
                            ],
                            [3, 2],
                        ),
                    ],
                    [1, 1],
                )
            )


_PANELS = (
    ("(a)", "absolute_error_mm2", "absolute_error_sd_mm2", "Absolute error (mm$^2$)"),
    ("(b)", "relative_error", "relative_error_sd", "Relative error"),
    ("(c)", "missing_variance_mm2", "missing_variance_sd_mm2", "Variance (mm$^2$)"),
)


def _top(line: Any) -> float:
    """Where the curve, and the band as far as twice the curve's own height, ends."""
    high = np.asarray(line.y, dtype=float)
    band = high + np.asarray(line.spread, dtype=float)
    return float(min(band.max(), 2.0 * high.max()))


def _ticks(views: np.ndarray) -> list[float]:
    return [float(t) for t in range(-90, 91, 30) if views[0] <= t <= views[-1]]
