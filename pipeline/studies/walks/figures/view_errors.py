"""Errors and missing variance against view angle: zhang2007 figure 5, zhang2004 figure 4."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipeline.core import camera, errors, fourier
from pipeline.core.linear_model import LinearModel
from pipeline.core.reconstruction import from_known_views
from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import (
    ABSCISSA_OF_VIEWS,
    METHOD_COLOURS,
    METHOD_NAMES,
    METHOD_STYLES,
    Made,
    Tables,
    lift,
    sd,
)

if TYPE_CHECKING:
    from pipeline.pictures import curves as pictures

_INSTANT = 0.25
"""Fraction of the cycle at which the recording shows the walker: the left ankle is farthest ahead of the right."""


def tables(made: Made) -> Tables:
    """``table``: per method and view; ``table_walkers``: per walker and method, mean over views."""
    sweep = made.sweep.arrays
    views, variance = sweep["view_angle_deg"], sweep["missing_variance_mm2"]
    absolute = errors.walker_error(sweep["absolute_error_mm2"])
    relative = errors.walker_error(sweep["relative_error"])
    methods, walkers, angles = absolute.shape
    return {
        "table": (
            {
                "method": np.repeat(made.methods, angles),
                "view_angle_deg": np.tile(views, methods),
                "absolute_error_mm2": absolute.mean(axis=1).ravel(),
                "absolute_error_sd_mm2": sd(absolute, 1).ravel(),
                "rms_error_mm": np.sqrt(absolute).mean(axis=1).ravel(),
                "relative_error": relative.mean(axis=1).ravel(),
                "relative_error_sd": sd(relative, 1).ravel(),
                "missing_variance_mm2": np.tile(variance.mean(axis=0), methods),
                "missing_variance_sd_mm2": np.tile(sd(variance, 0), methods),
            },
            ["method", "view_angle_deg"],
        ),
        "table_walkers": (
            {
                "walker": np.tile(made.walkers, methods),
                "method": np.repeat(made.methods, walkers),
                "absolute_error_mm2": absolute.mean(axis=2).ravel(),
                "relative_error": relative.mean(axis=2).ravel(),
            },
            ["walker", "method"],
        ),
    }


_PANELS = (
    ("(a)", "absolute_error_mm2", "absolute_error_sd_mm2", "Absolute error (mm$^2$)"),
    ("(b)", "relative_error", "relative_error_sd", "Relative error"),
    ("(c)", "missing_variance_mm2", "missing_variance_sd_mm2", "Variance (mm$^2$)"),
)


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """Three panels: absolute error, relative error, variance of the missing dimension."""
    from pipeline.pictures import curves as pictures  # drawing is slow to import, and not always wanted

    columns = made_tables["table"][0]
    views = made.sweep.arrays["view_angle_deg"]
    # zhang2004 prints the variance between the two errors; zhang2007 after them.
    order = (0, 1, 2) if made.config.paper == "zhang2007" else (0, 2, 1)
    panels = []
    for letter, which in zip("abc", order, strict=True):
        _, value, spread, label = _PANELS[which]
        series = []
        for method in made.methods:
            here = columns["method"] == method
            single = value == "missing_variance_mm2"
            series.append(
                pictures.Series(
                    x=views,
                    y=columns[value][here],
                    spread=columns[spread][here],
                    label="" if single or len(made.methods) == 1 else METHOD_NAMES[method],
                    style="solid" if single else METHOD_STYLES[method],
                    colour="black" if single or len(made.methods) == 1 else METHOD_COLOURS[method],
                )
            )
            if single:
                break
        panels.append(
            pictures.Panel(
                title=f"({letter})",
                series=series,
                xlabel=ABSCISSA_OF_VIEWS,
                ylabel=label,
                xlim=(float(views[0]), float(views[-1])),
                ylim=(0.0, 1.04 * max(_top(line) for line in series)),
                xticks=_ticks(views),
            )
        )
    pictures.curves(
        stem,
        panels,
        caption=f"{made.caption} Bands: ±1 standard deviation over walkers, as far as the axes go.",
    )


def _top(line: pictures.Series) -> float:
    """Where the curve, and the band as far as twice the curve's own height, ends."""
    high = np.asarray(line.y, dtype=float)
    band = high + np.asarray(line.spread, dtype=float)
    return float(min(band.max(), 2.0 * high.max()))


def _ticks(views: np.ndarray) -> list[float]:
    return [float(t) for t in range(-90, 91, 30) if views[0] <= t <= views[-1]]


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """The curves over view angle; one walker, seen and reconstructed from the angle at the cursor."""
    from pipeline.recordings import recording  # drawing is slow to import, and not always wanted

    columns = made_tables["table"][0]
    sweep, data, model = made.sweep.arrays, made.dataset.arrays, made.model.arrays
    views = np.rint(sweep["view_angle_deg"]).astype(int)
    absolute = errors.walker_error(sweep["absolute_error_mm2"])
    walker = int(np.argsort(absolute[0].mean(axis=1))[absolute.shape[1] // 2])  # the median one
    fold = LinearModel(
        model["fold_mean"][walker],
        model["fold_components"][walker],
        model["fold_eigenvalues"][walker],
        float(model["fold_total_variance"][walker]),
        float(model["fold_last_scale"][walker]),
    )
    truth = data["coefficients"][walker]
    index = {"view_angle_deg": views}
    instant = np.array([_INSTANT])
    posture = fourier.synthesise(truth, 1.0, instant)[0]
    ground = lift(posture)
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about
        + f"\nThe walker shown is {made.walkers[walker]}, the one of median error. Drag the cursor: the image "
        "is what the camera at that angle sees, the coloured skeletons what each approach makes of it"
        + (" (at the phase of the 3D motion).\n" if "phase_rad" in sweep else ".\n"),
        timeline="view_angle_deg",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        for method in made.methods:
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
            noise = float(made.sweep.notes["noise_variance_mm2"]) if method == "map" else None
            found = from_known_views(
                fold, model["samples"][walker], np.radians(sweep["view_angle_deg"]), noise_variance=noise
            )
            again = np.stack(
                [
                    fourier.synthesise(
                        camera.combine(camera.project(truth, a), found.missing[i], a), 1.0, instant
                    )[0]
                    for i, a in enumerate(np.radians(sweep["view_angle_deg"]))
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
            sweep["missing_variance_mm2"].mean(axis=0),
            sd=sd(sweep["missing_variance_mm2"], 0),
            label="variance of the missing dimension",
            colour="green",
        )
        rec.skeleton(
            "world/original",
            np.repeat(posture[None] + ground, len(views), axis=0),
            WALKER15.bones,
            index=index,
        )
        seen = np.stack([camera.project(posture, a) for a in np.radians(sweep["view_angle_deg"])])
        rec.image_points("image/observed", seen, WALKER15.bones, index=index)
        rec.blueprint(
            recording.Split(
                "columns",
                [
                    recording.Split(
                        "rows",
                        [
                            recording.Plot(name="absolute error (mm²)", origin="curves/absolute_error_mm2"),
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
