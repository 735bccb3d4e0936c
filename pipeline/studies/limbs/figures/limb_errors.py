"""Error of the trials against what is swept, with bands: park2011 figures 3b, 3c and 3d.

Root error and radius scale are here, a whole skeleton with missing points in `pipeline.figures.missing_data`.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import pictures
from pipeline.core.limb_chain import WALKER14
from pipeline.studies.figure_inputs import Made, Tables, sd
from pipeline.studies.limbs.figures import missing_data
from pipeline.studies.limbs.figures.limb_paths import (
    ADJUST_COLOURS,
    ADJUST_NAMES,
    CAMERA_COLOURS,
    CAMERA_NAMES,
    EYE_MM,
    LEAST,
    OUTSIDE,
    RADIUS_MM,
    path_bones,
    quartiles,
    sphere,
)
from pipeline.studies.options import MissingDataSweep, RadiusScaleSweep, RootErrorSweep


def tables(made: Made) -> Tables:
    """``table``: trials before the first camera; ``table_points``: over them; ``table_cameras``: of all cameras."""
    match made.config.sweep:
        case RootErrorSweep():
            return _root_error_tables(made)
        case RadiusScaleSweep():
            return _radius_scale_tables(made)
        case MissingDataSweep():
            return missing_data.tables(made)
        case other:
            raise TypeError(f"no errors of limbs by {type(other).__name__}")


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """Median and quartiles against what is swept."""
    match made.config.sweep:
        case RootErrorSweep():
            _draw_root_error(made, made_tables, stem)
        case RadiusScaleSweep():
            _draw_radius_scale(made, made_tables, stem)
        case _:
            missing_data.picture(made, made_tables, stem)


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """The curves, and one limb on its sphere at the value at the cursor, or a skeleton with missing points."""
    match made.config.sweep:
        case RootErrorSweep():
            _record_root_error(made, made_tables, folder)
        case RadiusScaleSweep():
            _record_radius_scale(made, made_tables, folder)
        case _:
            missing_data.recordings(made, made_tables, folder)


def _rows(made: Made, shape: tuple[int, ...]) -> dict[str, np.ndarray]:
    """Columns that say which trial (…, T) a row is of."""
    sweep = made.sweep.arrays
    columns = {
        "trial": np.arange(shape[-1]),
        "clip": np.array(made.walkers)[sweep["stretch"]],
        "limb": np.array(WALKER14.limbs)[sweep["limb"]],
        "camera": np.full(shape[-1], sweep["cameras"][0]),
    }
    return {name: np.broadcast_to(values, shape).ravel() for name, values in columns.items()}


def _root_error_tables(made: Made) -> Tables:
    sweep = made.sweep.arrays
    first = {name: sweep[name][0] for name in _ROOT_ERROR}
    shape = first["limb_error"].shape
    rows = []
    for camera, ratio in np.ndindex(sweep["limb_error"].shape[:2]):
        child = sweep["child_error_ratio"][camera, ratio]
        middle, low, high = quartiles(child)
        rows.append(
            {
                "camera": str(sweep["cameras"][camera]),
                "root_error_ratio": float(sweep["values"][ratio]),
                "trials": len(child),
                "child_error_median": middle,
                "child_error_low": low,
                "child_error_high": high,
                "child_error_sd": float(sd(child, 0)),
                "share_above_parent_error": (child > sweep["parent_error_ratio"][camera, ratio]).mean(),
                "limb_error_median": np.median(sweep["limb_error"][camera, ratio]),
                "error_up_to_mirror_median": np.median(sweep["error_up_to_mirror"][camera, ratio]),
            }
        )
    return {
        "table": (
            {
                **_rows(made, shape),
                "root_error_ratio": np.repeat(sweep["values"], shape[-1]),
                **{name: values.ravel() for name, values in first.items()},
            },
            ["trial", "root_error_ratio"],
        ),
        **_points(rows, str(sweep["cameras"][0]), ["root_error_ratio"]),
    }


_ROOT_ERROR = (
    "limb_error", "relative_error", "error_up_to_mirror", "child_error_ratio", "parent_error_ratio",
    "reconstructibility", "proved", "objective", "lower_bound",
)  # fmt: skip


def _radius_scale_tables(made: Made) -> Tables:
    sweep = made.sweep.arrays
    first = {name: sweep[name][0] for name in _RADIUS_SCALE}
    scales, ways, trials = first["limb_error"].shape
    rows = []
    for camera, scale, way in np.ndindex(sweep["limb_error"].shape[:3]):
        middle, low, high = quartiles(sweep["limb_error"][camera, scale, way])
        rows.append(
            {
                "camera": str(sweep["cameras"][camera]),
                "radius_scale": float(sweep["values"][scale]),
                "adjust": str(sweep["adjusts"][way]),
                "trials": trials,
                "limb_error_median": middle,
                "limb_error_low": low,
                "limb_error_high": high,
                "adjusted_share": sweep["adjusted_share"][camera, scale, way].mean(),
                "error_up_to_mirror_median": np.median(sweep["error_up_to_mirror"][camera, scale, way]),
            }
        )
    return {
        "table": (
            {
                **_rows(made, (scales, ways, trials)),
                "radius_scale": np.repeat(sweep["values"], ways * trials),
                "adjust": np.tile(np.repeat(sweep["adjusts"], trials), scales),
                **{name: values.ravel() for name, values in first.items()},
            },
            ["trial", "radius_scale", "adjust"],
        ),
        **_points(rows, str(sweep["cameras"][0]), ["radius_scale", "adjust"]),
    }


_RADIUS_SCALE = (
    "limb_error", "relative_error", "error_up_to_mirror", "adjusted_share", "radius_ratio", "proved", "objective",
    "lower_bound",
)  # fmt: skip


def _points(rows: list[dict[str, Any]], first: str, sort_by: list[str]) -> Tables:
    """``table_points`` of the first camera, and ``table_cameras`` of all."""
    every = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    here = every["camera"] == first
    return {
        "table_points": ({name: values[here] for name, values in every.items()}, sort_by),
        "table_cameras": (every, ["camera", *sort_by]),
    }


def _draw_root_error(made: Made, made_tables: Tables, stem: Path) -> None:
    """Draw the error against that of the parent, and its standard deviation over trials."""
    table = made_tables["table_cameras"][0]
    cameras = [str(camera) for camera in made.sweep.arrays["cameras"]]
    styles = {
        camera: pictures.Style(
            camera, CAMERA_COLOURS[camera], line="dashed" if number else "solid", banded=not number
        )
        for number, camera in enumerate(cameras)
    }
    ratios = made.sweep.arrays["values"]
    parent = pictures.Series(x=ratios, y=ratios, label="parent", colour="null", line="dotted")
    panel = partial(pictures.Panel, from_zero=True)
    pictures.draw_lines(
        stem,
        [
            panel(
                y="child_error_median",
                band=("child_error_low", "child_error_high"),
                ylabel="3D error / limb length",
                series=[parent],
            ),
            panel(y="child_error_sd", ylabel="Its standard deviation", legend=()),
        ],
        table,
        x="root_error_ratio",
        by="camera",
        styles=styles,
        xlabel=r"Error of the parent $r_e$ / limb length $r_a$",
        columns=2,
        caption=f"{made.caption} {_trials(made)} (a) Median from a {cameras[0]} camera"
        + (f", and from a {' or '.join(cameras[1:])} one (dashed)" if len(cameras) > 1 else "")
        + "; band: quartiles; dotted: the error of the parent itself. (b) Over trials.",
    )


def _draw_radius_scale(made: Made, made_tables: Tables, stem: Path) -> None:
    """Draw the error against the scale of the radius, a panel to a camera."""
    table = dict(made_tables["table_cameras"][0])
    for end in ("median", "low", "high"):
        table[f"limb_error_{end}"] = np.maximum(table[f"limb_error_{end}"], LEAST)
    styles = {
        adjust: pictures.Style(
            adjust.replace("_", " "),
            ADJUST_COLOURS[adjust],
            line="dashed" if way else "solid",
            banded=not way,
        )
        for way, adjust in enumerate(map(str, made.sweep.arrays["adjusts"]))
    }
    panels = [
        pictures.Panel(
            y="limb_error_median",
            band=("limb_error_low", "limb_error_high"),
            where={"camera": camera},
            ylabel=f"3D error / limb length, {CAMERA_NAMES[camera]}",
            xscale="log",
            yscale="log",
            references=[("x", 1.0, ""), ("x", 10.0, "")],
        )
        for camera in map(str, made.sweep.arrays["cameras"])
    ]
    pictures.draw_lines(
        stem,
        panels,
        table,
        x="radius_scale",
        by="adjust",
        styles=styles,
        xlabel="Assumed radius / true radius",
        columns=2,
        caption=f"{made.caption} {_trials(made)} Lines: median for each way of adjusting the radius to rays that miss "
        "the sphere (global: as long as the farthest ray asks for, as in the paper; robust: as 95 % of the rays ask "
        "for; per frame: longer in a frame alone); band: quartiles of the first. Dotted: the true radius, and ten "
        "times that.",
    )


def _trials(made: Made) -> str:
    """How many trials, before which camera, without noise or with it, for captions."""
    sweep = made.config.sweep
    assert isinstance(sweep, RootErrorSweep | RadiusScaleSweep)
    noise = f"noise of {sweep.noise_px:g} px" if sweep.noise_px else "no noise"
    return (
        f"{sweep.trials} limbs at every point, {sweep.distance_mm / 1000:g} m from the camera, {noise}. Error: mean "
        "distance over the limb's length."
    )


def _record_root_error(made: Made, made_tables: Tables, folder: Path) -> None:
    """Log the median error from every camera, and the error of the parent, over the latter."""
    table = made_tables["table_cameras"][0]
    ratio, first = table["root_error_ratio"], table["camera"] == made.sweep.arrays["cameras"][0]
    curves = {
        "root_error_per_mille": np.rint(1000 * np.concatenate([ratio, ratio[first]])),
        "child_error": np.concatenate([table["child_error_median"], ratio[first]]),
        "series": np.concatenate([table["camera"], np.full(first.sum(), "parent")]),
    }
    styles = {camera: pictures.Style(CAMERA_NAMES[camera], CAMERA_COLOURS[camera]) for camera in CAMERA_NAMES}
    _record(
        made,
        folder,
        curves,
        timeline="root_error_per_mille",
        y="child_error",
        by="series",
        styles={**styles, "parent": pictures.Style("error of the parent", "null")},
        plot="median error / limb length over 1000 x root error / limb length",
    )


def _record_radius_scale(made: Made, made_tables: Tables, folder: Path) -> None:
    """Log the median error before the first camera over the scale of the radius, both as logarithms."""
    table = made_tables["table_points"][0]
    curves = {
        "log10_scale_per_mille": np.rint(1000 * np.log10(table["radius_scale"])),
        "log10_limb_error": np.log10(np.maximum(table["limb_error_median"], LEAST)),
        "adjust": table["adjust"],
    }
    _record(
        made,
        folder,
        curves,
        timeline="log10_scale_per_mille",
        y="log10_limb_error",
        by="adjust",
        styles={a: pictures.Style(ADJUST_NAMES[a], ADJUST_COLOURS[a]) for a in ADJUST_NAMES},
        plot="log10 of median error / limb length over 1000 log10 of the scale",
    )


def _record(
    made: Made,
    folder: Path,
    table: dict[str, np.ndarray],
    *,
    timeline: str,
    y: str,
    by: str,
    styles: dict[str, pictures.Style],
    plot: str,
) -> None:
    """Log curves over what is swept, and the limb that is shown, on its sphere."""
    from pipeline import recordings

    sweep = made.sweep.arrays
    shown = int(sweep["shown"][0])
    truth, found = RADIUS_MM * sweep["paths"][:, 0], RADIUS_MM * OUTSIDE * sweep["paths"][:, 1]
    globe, wires = sphere()
    at = np.unique(table[timeline])
    bones, index = path_bones(truth.shape[1]), {timeline: at}
    with recordings.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about + f"\nThe limb shown is `{WALKER14.limbs[sweep['limb'][shown]]}` of "
        f"`{made.walkers[sweep['stretch'][shown]]}`, {CAMERA_NAMES[str(sweep['cameras'][0])]}: the trial whose errors "
        "are nearest to the medians. Its end moves on the sphere of the limb, drawn with a radius of one metre: green "
        "the truth, orange the estimate at the value at the cursor, drawn "
        f"{100 * (OUTSIDE - 1):.0f} % outside. Drag the cursor.\n",
        timeline=timeline,
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        rec.curves(table, x=timeline, y=y, by=by, styles=styles)
        rec.skeleton("world/truth", truth, bones, index=index, colour="green", thickness_mm=6.0)
        rec.skeleton("world/estimate", found, bones, index=index, colour="orange", thickness_mm=6.0)
        rec.skeleton("world/sphere", globe, wires, index={timeline: at[:1]}, thickness_mm=1.0)
        rec.blueprint(
            recordings.Columns(
                recordings.Space3D(name="truth and estimate", eye_mm=EYE_MM, target_mm=(0.0, 0.0, 0.0)),
                recordings.Rows(
                    recordings.Plot(name=plot, headroom=0.3),
                    recordings.Notes(),
                    shares=(3, 2),
                ),
                shares=(1, 1),
            )
        )
