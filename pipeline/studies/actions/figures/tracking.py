"""Error of tracking with the action model as prior, without it, and of the mean performance alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import Made, Tables, sd

if TYPE_CHECKING:
    from pipeline import pictures

NAMES = {
    "prior": "prior",
    "no_prior": "no prior",
    "no_prior_own_step": "no prior, steps as in the data",
    "mean_linear_phase": "mean, constant rate",
    "mean_best_phase": "mean, best phase",
}
COLOURS = {
    "prior": "blue",
    "no_prior": "orange",
    "no_prior_own_step": "purple",
    "mean_linear_phase": "grey",
    "mean_best_phase": "green",
}
RECORDED_COLOURS = COLOURS | {"mean_linear_phase": "yellow"}  # the truth is grey there
STYLES = {"mean_linear_phase": "dashed", "mean_best_phase": "dashed"}

_PANELS = (
    ("particles", "particles", "Particles"),
    ("noise", "noise_mm", "Noise of the image (mm)"),
    ("occlusion", "occluded", "Share of joints hidden"),
)
_LEGENDS = {
    "particles": ("prior", "no_prior"),
    "noise": ("no_prior_own_step",),
    "occlusion": ("mean_linear_phase", "mean_best_phase"),
}
"""Which lines each panel of the first row names: all names above one panel would not fit."""


def tables(made: Made) -> Tables:
    """``table``: mean over performances of each condition and method; ``table_performances``: each performance."""
    sweep = made.sweep.arrays
    error, ways, methods = sweep["error_mm"], sweep["leave_out"], sweep["methods"]
    conditions, count = error.shape[1:3]
    aspace = np.broadcast_to(sweep["aspace_error_mm"][:, None, :, None], error.shape)

    def over(values: np.ndarray, axis: int, shape: tuple[int, ...]) -> np.ndarray:
        """One value to a row, from values along one axis."""
        places = [1] * len(shape)
        places[axis] = len(values)
        return np.broadcast_to(values.reshape(places), shape).ravel()

    def keys(shape: tuple[int, ...]) -> dict[str, np.ndarray]:
        return {
            "leave_out": over(ways, 0, shape),
            "varied": over(sweep["varied"], 1, shape),
            "method": over(methods, len(shape) - 1, shape),
            **{name: over(sweep[name], 1, shape) for name in ("particles", "noise_mm", "occluded")},
        }

    whole = (len(ways), conditions, len(methods))
    names = np.array(made.walkers)[sweep["tracked"]]
    filters = sweep["lost_fraction"].shape[-1]
    lost = np.zeros(error.shape)
    lost[..., :filters] = sweep["lost_fraction"]
    sort_by = ["leave_out", "varied", "particles", "noise_mm", "occluded", "method"]
    return {
        "table": (
            {
                **keys(whole),
                "error_mm": error.mean(axis=2).ravel(),
                "error_sd_mm": sd(error, 2).ravel(),
                "error_median_mm": np.median(error, axis=2).ravel(),
                "aspace_error_mm": aspace.mean(axis=2).ravel(),
                "lost_fraction": lost.mean(axis=2).ravel(),
                "performances": np.full(np.prod(whole), count),
            },
            sort_by,
        ),
        "table_performances": (
            {
                "performance": over(names, 2, error.shape),
                **keys(error.shape),
                "error_mm": error.ravel(),
                "aspace_error_mm": aspace.ravel(),
                "lost_fraction": lost.ravel(),
            },
            ["performance", *sort_by],
        ),
    }


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """A row of panels to a way of leaving out: error against particles, noise and occlusion."""
    from pipeline import pictures

    columns = made_tables["table"][0]
    ways = [str(way) for way in made.sweep.arrays["leave_out"]]
    top = 1.05 * float(
        (columns["error_mm"] + columns["error_sd_mm"] / np.sqrt(columns["performances"])).max()
    )
    panels: list[pictures.Panel] = []
    for row, way in enumerate(ways):
        for varied, column, label in _PANELS:
            here = (columns["leave_out"] == way) & (columns["varied"] == varied)
            x = np.unique(columns[column][here])
            panels.append(
                pictures.Panel(
                    series=[
                        _line(
                            columns,
                            here & (columns["method"] == m),
                            column,
                            not row and m in _LEGENDS[varied],
                        )
                        for m in made.methods
                    ],
                    xlabel=label,
                    ylabel=f"Error (mm), without the {way}" if varied == "particles" else "",
                    xscale="log" if varied == "particles" else "linear",
                    ylim=(0.0, top),
                    references=[("y", float(columns["aspace_error_mm"][here].mean()), "")],
                )
            )
            if len(x) > 1 and varied == "occlusion":
                panels[-1] = _with_ticks(panels[-1], x)
    shown = made.sweep.arrays
    usual = shown["particles"][shown["varied"] == "noise"][0]
    noise = shown["noise_mm"][shown["varied"] == "particles"][0]
    pictures.draw_lines(
        stem,
        panels,
        columns=len(_PANELS),
        caption=f"{made.caption} Mean distance of the joints, relative to the pelvis, over "
        f"{int(columns['performances'][0])} performances, each by a model learnt without it (or without its person). "
        f"Bands: ±1 standard error. Where not varied: {usual} particles, noise {noise:g} mm, nothing hidden. Prior: "
        "the action model; no prior: a random walk with the same diffusion, or with steps as large as in the data; "
        "mean: the mean performance alone. Dotted line: the true postures, projected into the aSpace.",
    )


def _line(columns: dict[str, np.ndarray], here: np.ndarray, column: str, named: bool) -> pictures.Series:
    """One method's error over what is varied."""
    from pipeline import pictures

    method = str(columns["method"][here][0])
    order = np.argsort(columns[column][here], kind="stable")
    x, y, spread, count = (
        columns[name][here][order] for name in (column, "error_mm", "error_sd_mm", "performances")
    )
    return pictures.Series(
        x=x,
        y=y,
        band=spread / np.sqrt(count),
        label=NAMES[method] if named else "",
        line=STYLES.get(method, "solid") if len(x) > 1 else "points",
        colour=COLOURS[method],
    )


def _with_ticks(panel: pictures.Panel, places: np.ndarray) -> pictures.Panel:
    from dataclasses import replace

    return replace(panel, xticks=[float(v) for v in places])


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """One performance: true, tracked with the prior and without, the mean alone; what the camera saw; errors."""
    from pipeline import recordings as recording

    sweep, notes = made.sweep.arrays, made.sweep.notes
    times = sweep["shown_time_s"]
    index = {"time": times}
    name = made.walkers[int(sweep["shown"][0])]
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about
        + f"\nPerformance `{name}`, by the model learnt without "
        + ("it" if sweep["leave_out"][0] == "performance" else "its person")
        + f": {notes['shown_particles']} particles, noise {notes['shown_noise_mm']:g} mm, "
        f"{100 * notes['shown_occluded']:g} % of the joints hidden in runs of frames. Of all tracked ones it is the "
        "one whose error with the prior is the median. Grey: recorded. "
        + ", ".join(f"{RECORDED_COLOURS[m]}: {NAMES[m]}" for m in made.methods)
        + ".\n",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        rec.skeleton("world/original", sweep["shown_true"], WALKER15.bones, index=index)
        for m, method in enumerate(made.methods):
            joints = sweep["shown_joints"][m]
            # Laid on the recorded pelvis, as the error is.
            moved = joints - joints[:, [8]] + sweep["shown_true"][:, [8]]
            rec.skeleton(
                f"world/tracked/{method}",
                moved,
                WALKER15.bones,
                index=index,
                colour=RECORDED_COLOURS[method],
            )
            rec.curve(
                f"curves/error_mm/{method}",
                times,
                sweep["shown_error_mm"][m],
                label=NAMES[method],
                colour=RECORDED_COLOURS[method],
            )
        rec.image_points("image/observed", sweep["shown_image"], WALKER15.bones, index=index)
        spaces = [
            recording.Space3D(
                name=NAMES[method],
                contents=("world/original", f"world/tracked/{method}"),
                eye_mm=(2000.0, 1450.0, 1100.0),
            )
            for method in ("prior", "no_prior_own_step", "mean_best_phase")
        ]
        rec.blueprint(
            recording.Rows(
                recording.Columns(*spaces),
                recording.Columns(
                    recording.Image2D(name="observed joints"),
                    recording.Plot(name="error (mm) against time (s)", origin="curves/error_mm"),
                    recording.Notes(),
                    shares=(1, 2, 1),
                ),
                shares=(3, 2),
            ),
            playing=True,
        )
