"""Error of eigenwalkers and of articulated trajectories against view, noise and occlusion: of no paper, ours."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import Made, Tables, lift
from pipeline.studies.options import FaceOffSweep

if TYPE_CHECKING:
    from pipeline import pictures

NAMES = {
    "least_squares": "eigenwalkers (least squares)",
    "map": "eigenwalkers (MAP)",
    "mean_walker": "average walker",
    "articulated": "articulated",
    "articulated_hinges": "articulated, hinges",
    "articulated_mirrors": "articulated, mirrors tried",
}
COLOURS = {
    "least_squares": "orange",
    "map": "blue",
    "mean_walker": "grey",
    "articulated": "purple",
    "articulated_hinges": "green",
    "articulated_mirrors": "sky",
}
RECORDED_COLOURS = COLOURS | {"mean_walker": "yellow"}  # the truth is light grey there
STYLES = {"map": "dashed", "mean_walker": "dotted", "articulated": "dashed"}

HUNG = [j for j, joint in enumerate(WALKER15.joints) if joint != "pelvis"]

_PANELS = (
    ("none", "view_angle_deg", "Viewpoint (degree)"),
    ("noise", "noise_px", "Noise of the image (px)"),
    ("occlusion", "occluded", "Share of joints hidden"),
)
_LEGENDS = (
    ("least_squares", "map"),
    ("articulated", "articulated_hinges"),
    ("articulated_mirrors", "mean_walker"),
)
"""Which lines each panel of the first row names: all names above one panel would not fit."""


def tables(made: Made) -> Tables:
    """``table``: each walker; ``table_joints``: each joint of the undisturbed views; ``table_summary``: means.

    A method that a camera's images cannot be given to has no rows there.
    """
    sweep = made.sweep.arrays
    joints, missing = sweep["error_mm"], sweep["missing_dimension_error_mm"]
    error = joints[..., HUNG].mean(axis=-1)  # (W, D, C, M)
    used = np.isfinite(error[0])
    walkers = np.array(made.walkers)[sweep["walkers"]]

    def keys(conditions: np.ndarray, *, walkers_too: bool) -> dict[str, np.ndarray]:
        """Labels of rows: one to each place (D, C, M) that is used."""
        d, c, m = np.nonzero(conditions)
        labels = {
            "view_angle_deg": sweep["view_angle_deg"][d],
            "camera": sweep["cameras"][c],
            "method": sweep["methods"][m],
            "varied": sweep["varied"][d],
            "noise_px": sweep["noise_px"][d],
            "occluded": sweep["occluded"][d],
        }
        if not walkers_too:
            return labels
        return {
            "walker": np.repeat(walkers, len(d)),
            **{name: np.tile(values, len(walkers)) for name, values in labels.items()},
        }

    every = [error[w][used] for w in range(len(walkers))]
    stacked, away = np.stack(every), np.stack([missing[w][used] for w in range(len(walkers))])
    plain = used & (sweep["varied"] == "none")[:, None, None]
    per_joint = np.stack([joints[w][plain][:, HUNG] for w in range(len(walkers))])  # (W, rows, 14)
    of_plain = keys(plain, walkers_too=False)
    order = ["varied", "camera", "method", "view_angle_deg", "noise_px", "occluded"]
    return {
        "table": (
            {
                **keys(used, walkers_too=True),
                "error_mm": stacked.ravel(),
                "missing_dimension_error_mm": away.ravel(),
                "frames": np.repeat(sweep["frames"], stacked.shape[1]),
            },
            ["walker", *order],
        ),
        "table_joints": (
            {
                **{
                    name: np.repeat(of_plain[name], len(HUNG))
                    for name in ("method", "camera", "view_angle_deg")
                },
                "joint": np.tile([WALKER15.joints[j] for j in HUNG], per_joint.shape[1]),
                "error_mm": per_joint.mean(axis=0).ravel(),
                "error_sd_mm": _sd(per_joint).ravel(),
            },
            ["camera", "method", "view_angle_deg"],
        ),
        "table_summary": (
            {
                **keys(used, walkers_too=False),
                "error_mm": stacked.mean(axis=0),
                "error_sd_mm": _sd(stacked),
                "missing_dimension_error_mm": away.mean(axis=0),
                "walkers": np.full(stacked.shape[1], len(walkers)),
            },
            order,
        ),
    }


def _sd(values: np.ndarray) -> np.ndarray:
    """Standard deviation over the first axis, divisor n - 1 (0 for a single walker)."""
    return values.std(axis=0, ddof=1) if len(values) > 1 else np.zeros_like(values[0])


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """A row of panels to a camera: error against view, noise and occlusion."""
    from pipeline import pictures

    options = _options(made)
    columns = made_tables["table_summary"][0]
    count = int(columns["walkers"][0])
    band = columns["error_sd_mm"] / np.sqrt(count)
    top = 1.05 * float((columns["error_mm"] + band).max())
    panels: list[pictures.Panel] = []
    for camera in made.sweep.arrays["cameras"]:
        for place, (varied, column, label) in enumerate(_PANELS):
            here = (columns["camera"] == camera) & (columns["varied"] == varied)
            series = [
                _line(
                    columns,
                    here & (columns["method"] == m),
                    column,
                    len(panels) == place and m in _LEGENDS[place],
                )
                for m in made.methods
                if (here & (columns["method"] == m)).any()
            ]
            panels.append(
                pictures.Panel(
                    series=series,
                    xlabel=label,
                    ylabel="" if place else f"Error (mm), {camera} camera",
                    xticks=[float(v) for v in np.unique(columns[column][here])],
                    ylim=(0.0, top),
                )
            )
    pictures.draw_lines(
        stem,
        panels,
        columns=len(_PANELS),
        caption=f"{made.caption} Mean distance of the joints from the recorded motion, relative to the pelvis, over "
        f"{count} walkers; bands: ±1 standard error. Perspective camera at {options.distance_mm:g} mm with a focal "
        f"length of {options.focal_px:g} px; noise and hidden joints at {options.varied_view_deg:g}°. Eigenwalkers: "
        "the model learnt without the walker, frequency and phase from the still view alone, none where the camera "
        "moves. Articulated: no walk was learnt; true lengths of the limbs. Both are given the pelvis. Average "
        "walker: with the true frequency and phase.",
    )


def _options(made: Made) -> FaceOffSweep:
    if not isinstance(made.config.sweep, FaceOffSweep):
        raise TypeError(f"no face-off is made of {type(made.config.sweep).__name__}")
    return made.config.sweep


def _line(columns: dict[str, np.ndarray], here: np.ndarray, column: str, named: bool) -> pictures.Series:
    """One method's error over what is varied."""
    from pipeline import pictures

    method = str(columns["method"][here][0])
    order = np.argsort(columns[column][here], kind="stable")
    x, y, spread, count = (
        columns[name][here][order] for name in (column, "error_mm", "error_sd_mm", "walkers")
    )
    return pictures.Series(
        x=x,
        y=y,
        band=spread / np.sqrt(count),
        label=NAMES[method] if named else "",
        line=STYLES.get(method, "solid") if len(x) > 1 else "points",
        colour=COLOURS[method],
    )


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """One walker: recorded, by every method from every camera; what the cameras saw; errors over time."""
    from pipeline import recordings as recording

    sweep, notes, options = made.sweep.arrays, made.sweep.notes, _options(made)
    true = sweep["shown_true"]
    ground, times = lift(true), np.arange(len(true)) / options.frame_rate_hz
    index = {"time": times}
    cameras = [str(camera) for camera in sweep["cameras"]]
    to_mm = options.distance_mm / options.focal_px * np.array([1.0, -1.0])
    pelvis = WALKER15.index("pelvis")
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about + f"\nWalker `{made.walkers[int(sweep['shown'][0])]}` from "
        f"{notes['shown_view_angle_deg']:g}°, noise {notes['shown_noise_px']:g} px; of all walkers the one whose "
        "error by the articulated method is the median. All bodies are laid on the recorded pelvis. Grey: recorded. "
        + ", ".join(f"{RECORDED_COLOURS[m]}: {NAMES[m]}" for m in made.methods)
        + ".\n",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        worst = 0.0
        rec.skeleton("world/original", true + ground, WALKER15.bones, index=index)
        for c, camera in enumerate(cameras):
            rec.image_points(
                f"image/observed/{camera}", sweep["shown_images"][c] * to_mm, WALKER15.bones, index=index
            )
            for m, method in enumerate(made.methods):
                body = sweep["shown_positions"][c, m]
                if np.isnan(body).all():
                    continue
                moved = body - body[:, [pelvis]] + true[:, [pelvis]]
                colour = RECORDED_COLOURS[method]
                entity = f"world/reconstructed/{camera}/{method}"
                rec.skeleton(entity, moved + ground, WALKER15.bones, index=index, colour=colour)
                off = np.linalg.norm(moved - true, axis=-1)[:, HUNG].mean(axis=1)
                worst = max(worst, float(off.max()))
                rec.curve(
                    f"curves/error_mm/{camera}/{method}", times, off, label=NAMES[method], colour=colour
                )
        # From the side of a camera, what it does not show lies across.
        side = np.radians(notes["shown_view_angle_deg"]) + np.pi / 3
        eye = (2600.0 * float(np.sin(side)), -2600.0 * float(np.cos(side)), 1400.0)
        columns = [
            recording.Rows(
                recording.Space3D(
                    name=f"{camera} camera: recorded and reconstructed",
                    contents=("world/original", f"world/reconstructed/{camera}"),
                    shown=(
                        "world/original",
                        *(
                            f"world/reconstructed/{camera}/{m}"
                            for m in (
                                ("map", "articulated_mirrors")
                                if camera == "still"
                                else ("articulated_mirrors",)
                            )
                        ),
                    ),
                    eye_mm=eye,
                ),
                recording.Image2D(name=f"image of the {camera} camera", origin=f"image/observed/{camera}"),
                recording.Plot(
                    name=f"error (mm) against time (s), {camera} camera",
                    origin=f"curves/error_mm/{camera}",
                    y_range=(0.0, 1.7 * worst),  # the legend takes the upper part
                ),
                shares=(4, 3, 3),
            )
            for camera in cameras
        ]
        rec.blueprint(
            recording.Columns(*columns, recording.Notes(), shares=[3] * len(columns) + [2]), playing=True
        )
