"""The pictures of park2011 figures 3b and 3c: error of one limb against errors of what is given."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.pictures import curves as pictures
from pipeline.studies.figure_inputs import Made, Tables
from pipeline.studies.limbs.figures.limb_paths import ADJUST_COLOURS, CAMERA_COLOURS, CAMERA_NAMES, LEAST
from pipeline.studies.options import RadiusScaleSweep, RootErrorSweep

ADJUST_LABELS = {"global": "global", "robust": "robust", "per_frame": "per frame"}


def root_error(made: Made, made_tables: Tables, stem: Path) -> None:
    """Error against that of the parent, and its spread."""
    columns = made_tables["table_cameras"][0]
    cameras = [str(camera) for camera in made.sweep.arrays["cameras"]]
    ratios = made.sweep.arrays["values"]
    panels = []
    for letter, column, label in (
        ("a", "child_error_median", "3D error / limb length"),
        ("b", "child_error_sd", "Its standard deviation"),
    ):
        series = []
        for number, camera in enumerate(cameras):
            here = columns["camera"] == camera
            band = (columns["child_error_low"][here], columns["child_error_high"][here])
            series.append(
                pictures.Series(
                    x=ratios,
                    y=columns[column][here],
                    spread=band if letter == "a" and not number else None,
                    label=camera if letter == "a" else "",
                    colour=CAMERA_COLOURS[camera],
                    style="dashed" if number else "solid",
                )
            )
        if letter == "a":
            series.append(pictures.Series(x=ratios, y=ratios, label="parent", colour="grey", style="dotted"))
        panels.append(
            pictures.Panel(
                title=f"({letter})",
                series=series,
                xlabel=r"Error of the parent $r_e$ / limb length $r_a$",
                ylabel=label,
                ylim=(0.0, 1.08 * _top(series)),
            )
        )
    pictures.curves(
        stem,
        panels,
        columns=2,
        caption=f"{made.caption} {_trials(made)} (a) Median from a {cameras[0]} camera"
        + (f", and from a {' or '.join(cameras[1:])} one (dashed)" if len(cameras) > 1 else "")
        + "; band: quartiles; dotted: the error of the parent itself. (b) Over trials.",
    )


def radius_scale(made: Made, made_tables: Tables, stem: Path) -> None:
    """Error against the scale of the radius, a panel to a camera."""
    columns = made_tables["table_cameras"][0]
    sweep = made.sweep.arrays
    panels = []
    for number, camera in enumerate(map(str, sweep["cameras"])):
        series = []
        for way, adjust in enumerate(map(str, sweep["adjusts"])):
            here = (columns["camera"] == camera) & (columns["adjust"] == adjust)
            low, middle, high = (
                np.maximum(columns[f"limb_error_{name}"][here], LEAST) for name in ("low", "median", "high")
            )
            series.append(
                pictures.Series(
                    x=sweep["values"],
                    y=middle,
                    spread=None if way else (low, high),
                    label="" if number else ADJUST_LABELS[adjust],
                    colour=ADJUST_COLOURS[adjust],
                    style="dashed" if way else "solid",
                )
            )
        panels.append(
            pictures.Panel(
                title=f"({'abc'[number]})",
                series=series,
                xlabel="Assumed radius / true radius",
                ylabel=f"3D error / limb length, {CAMERA_NAMES[camera]}",
                xscale="log",
                yscale="log",
                references=[("x", 1.0, ""), ("x", 10.0, "")],
            )
        )
    pictures.curves(
        stem,
        panels,
        columns=2,
        caption=f"{made.caption} {_trials(made)} Lines: median for each way of adjusting the radius to rays that miss "
        "the sphere (global: as long as the farthest ray asks for, as in the paper; robust: as 95 % of the rays ask "
        "for; per frame: longer in a frame alone); band: quartiles of the first. Dotted: the true radius, and ten "
        "times that.",
    )


def _top(series: list[pictures.Series]) -> float:
    tops = [np.max(s.spread[1] if isinstance(s.spread, tuple) else s.y) for s in series]
    return float(np.max(tops))


def _trials(made: Made) -> str:
    """How many trials, before which camera, without noise or with it, for captions."""
    sweep = made.config.sweep
    assert isinstance(sweep, RootErrorSweep | RadiusScaleSweep)
    noise = f"noise of {sweep.noise_px:g} px" if sweep.noise_px else "no noise"
    return (
        f"{sweep.trials} limbs at every point, {sweep.distance_mm / 1000:g} m from the camera, {noise}. Error: mean "
        "distance over the limb's length."
    )
