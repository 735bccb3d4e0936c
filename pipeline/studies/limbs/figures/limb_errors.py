"""Error of the trials against what is swept, with bands: park2011 figures 3b, 3c and 3d.

Root error and radius scale are here, a whole skeleton with missing points in `pipeline.figures.missing_data`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pipeline.core.limb_chain import WALKER14
from pipeline.studies.figure_inputs import Made, Tables, sd
from pipeline.studies.limbs.figures import missing_data
from pipeline.studies.limbs.figures.limb_paths import (
    ADJUST_COLOURS,
    ADJUST_NAMES,
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

RECORDED_COLOURS = {"shaky": "blue", "still": "orange", "moving": "purple"}


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
    from pipeline.studies.limbs.figures import (
        limb_errors_picture,  # drawing is slow to import, and not always wanted
    )

    match made.config.sweep:
        case RootErrorSweep():
            limb_errors_picture.root_error(made, made_tables, stem)
        case RadiusScaleSweep():
            limb_errors_picture.radius_scale(made, made_tables, stem)
        case _:
            missing_data.picture(made, made_tables, stem)


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """The curves, and one limb on its sphere at the value at the cursor, or a skeleton with missing points."""
    points = made_tables["table_cameras" if "table_cameras" in made_tables else "table_points"][0]
    match made.config.sweep:
        case RootErrorSweep():
            _recording(
                made,
                folder,
                timeline="root_error_per_mille",
                at=np.rint(1000 * made.sweep.arrays["values"]).astype(int),
                curves={
                    f"child_error/{camera}": (
                        points["child_error_median"][points["camera"] == camera],
                        CAMERA_NAMES[camera],
                        RECORDED_COLOURS[camera],
                    )
                    for camera in map(str, made.sweep.arrays["cameras"])
                }
                | {
                    "child_error/parent": (
                        points["root_error_ratio"][points["camera"] == made.sweep.arrays["cameras"][0]],
                        "error of the parent",
                        "grey",
                    )
                },
                plot="median error / limb length over 1000 x root error / limb length",
            )
        case RadiusScaleSweep():
            first = points["camera"] == made.sweep.arrays["cameras"][0]
            _recording(
                made,
                folder,
                timeline="log10_scale_per_mille",
                at=np.rint(1000 * np.log10(made.sweep.arrays["values"])).astype(int),
                curves={
                    f"log10_limb_error/{adjust}": (
                        np.log10(
                            np.maximum(
                                points["limb_error_median"][first & (points["adjust"] == adjust)], LEAST
                            )
                        ),
                        ADJUST_NAMES[adjust],
                        ADJUST_COLOURS[adjust],
                    )
                    for adjust in map(str, made.sweep.arrays["adjusts"])
                },
                plot="log10 of median error / limb length over 1000 log10 of the scale",
            )
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


def _recording(
    made: Made,
    folder: Path,
    *,
    timeline: str,
    at: np.ndarray,
    curves: dict[str, tuple[np.ndarray, str, str]],
    plot: str,
) -> None:
    """Curves over what is swept, and the limb that is shown, on its sphere."""
    from pipeline.recordings import recording  # drawing is slow to import, and not always wanted

    sweep = made.sweep.arrays
    shown = int(sweep["shown"][0])
    truth, found = RADIUS_MM * sweep["paths"][:, 0], RADIUS_MM * OUTSIDE * sweep["paths"][:, 1]
    globe, wires = sphere()
    heights = np.concatenate([values for values, _, _ in curves.values()])
    # Room for the legend above the curves.
    low, high = float(heights.min()), float(heights.min() + 1.35 * max(np.ptp(heights), 1e-6))
    bones, index = path_bones(truth.shape[1]), {timeline: at}
    with recording.Recording(
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
        for name, (values, label, colour) in curves.items():
            rec.curve(f"curves/{name}", at, values, label=label, colour=colour)
        rec.skeleton("world/truth", truth, bones, index=index, colour="green", thickness_mm=6.0)
        rec.skeleton("world/estimate", found, bones, index=index, colour="orange", thickness_mm=6.0)
        rec.skeleton("world/sphere", globe, wires, index={timeline: at[:1]}, thickness_mm=1.0)
        rec.blueprint(
            recording.Split(
                "columns",
                [
                    recording.Space3D(name="truth and estimate", eye_mm=EYE_MM, target_mm=(0.0, 0.0, 0.0)),
                    recording.Split(
                        "rows",
                        [recording.Plot(name=plot, origin="curves", y_range=(low, high)), recording.Notes()],
                        [3, 2],
                    ),
                ],
                [1, 1],
            )
        )
