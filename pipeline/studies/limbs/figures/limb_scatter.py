"""Error of each trial against its reconstructibility: park2011 figure 3a."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.core.limb_chain import WALKER14
from pipeline.core.reconstructibility import MARGIN_GREEN_ABOVE
from pipeline.core.statistics import rank_correlation
from pipeline.studies.figure_inputs import Made, Tables
from pipeline.studies.limbs.figures.limb_paths import CAMERA_COLOURS, CAMERA_NAMES, quartiles
from pipeline.studies.limbs.scores import SUCCESS
from pipeline.studies.limbs.trials import STARTS
from pipeline.studies.options import ReconstructibilitySweep

EDGES = (0.0, 0.8, 0.95, 1.05, 1.25, 2.0, 5.0, 1000.0)
"""Of the bins of reconstructibility; what is larger goes into the last one."""

WINDOW = 8
"""The running median is over the n / 8 trials that are nearest in rank, 5 at least."""


def tables(made: Made) -> Tables:
    """``table``: every trial; ``table_bins``, ``table_running``: of all cameras, over reconstructibility.

    ``table_correlation``: rank correlation of error and what might predict it; ``table_refinement``: of direct
    optimisation from other starts; ``table_matrices``: whether the programmes' matrices are positive definite.
    """
    sweep = made.sweep.arrays
    cameras, trials = sweep["limb_error"].shape
    eta = np.minimum(reconstructibility_of(made), EDGES[-1])
    error = sweep["limb_error"]
    names = np.array(WALKER14.limbs)
    scores = {
        name: sweep[name].ravel()
        for name in (
            "mirror_margin", "limb_error", "relative_error", "error_up_to_mirror", "proved", "objective",
            "lower_bound", "truth_objective", "impostor_objective", "light", "taken_impostor",
        )
    }  # fmt: skip
    return {
        "table": (
            {
                "trial": np.tile(np.arange(trials), cameras),
                "clip": np.tile(np.array(made.walkers)[sweep["stretch"]], cameras),
                "limb": np.tile(names[sweep["limb"]], cameras),
                "camera": np.repeat(sweep["cameras"], trials),
                "reconstructibility": reconstructibility_of(made).ravel(),
                "reconstructibility_angle": sweep["reconstructibility_angle"].ravel(),
                **scores,
            },
            ["camera", "trial"],
        ),
        "table_bins": (_bins(eta.ravel(), error.ravel(), sweep["taken_impostor"].ravel()), []),
        "table_running": (_running(eta.ravel(), error.ravel()), []),
        "table_correlation": (_correlations(sweep), ["camera"]),
        "table_refinement": (
            {
                "start": np.array(STARTS),
                "limb_error_median": np.median(sweep["refined_error"], axis=(0, 1)),
                "reprojection_error_px_median": np.median(sweep["refined_px"], axis=(0, 1)),
                "converged_share": sweep["refined_converged"].mean(axis=(0, 1)),
                "success": (sweep["refined_error"] < SUCCESS).mean(axis=(0, 1)),
                "trials": np.full(len(STARTS), sweep["refined_px"][..., 0].size),
            },
            [],
        ),
        "table_matrices": (
            {
                "camera": sweep["cameras"],
                "numerically_singular_share": (sweep["eigenvalue_ratio"] < _ROUNDING).mean(axis=1),
                "trials": np.full(cameras, trials),
            },
            ["camera"],
        ),
    }


_ROUNDING = 1e-8
"""Smallest to largest eigenvalue below which a matrix is singular: the root of the machine's precision, about."""


def _options(made: Made) -> ReconstructibilitySweep:
    assert isinstance(made.config.sweep, ReconstructibilitySweep)
    return made.config.sweep


def reconstructibility_of(made: Made) -> np.ndarray:
    """Reconstructibility (C, T) by the reading that was asked for."""
    return np.asarray(made.sweep.arrays[f"reconstructibility_{_options(made).reading}"])


def _bins(eta: np.ndarray, error: np.ndarray, impostor: np.ndarray) -> dict[str, np.ndarray]:
    """One row to each bin that has trials."""
    rows: list[dict[str, Any]] = []
    for low, high in pairwise(EDGES):
        here = (eta >= low) & ((eta < high) | (high == EDGES[-1]))
        if here.any():
            middle, lower, upper = quartiles(error[here])
            rows.append(
                {
                    "reconstructibility_from": low,
                    "reconstructibility_to": high,
                    "trials": int(here.sum()),
                    "limb_error_median": middle,
                    "limb_error_low": lower,
                    "limb_error_high": upper,
                    "success": (error[here] < SUCCESS).mean(),
                    "taken_impostor": impostor[here].mean(),
                }
            )
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _running(values: np.ndarray, error: np.ndarray) -> dict[str, np.ndarray]:
    """Median and quartiles of the error of the trials that are nearest in rank, at every trial."""
    order = np.argsort(values, kind="stable")
    count = len(values)
    width = min(count, max(5, count // WINDOW))
    starts = np.clip(np.arange(count) - width // 2, 0, count - width)
    near = error[order][starts[:, None] + np.arange(width)]
    middle, low, high = quartiles(near)
    return {
        "reconstructibility": values[order],
        "limb_error_median": middle,
        "limb_error_low": low,
        "limb_error_high": high,
    }


def _correlations(sweep: Mapping[str, Any]) -> dict[str, np.ndarray]:
    rows = []
    for camera in [*map(str, sweep["cameras"]), "all"]:
        here = slice(None) if camera == "all" else sweep["cameras"] == camera
        error = sweep["limb_error"][here].ravel()
        predicted_by = {
            "spearman_vector": "reconstructibility_vector",
            "spearman_angle": "reconstructibility_angle",
            "spearman_margin": "mirror_margin",
        }
        row: dict[str, Any] = {"camera": camera}
        row |= {name: rank_correlation(sweep[by][here].ravel(), error) for name, by in predicted_by.items()}
        mirror = (sweep["error_up_to_mirror"][here] < SUCCESS).mean()
        row |= {"success": (error < SUCCESS).mean(), "success_up_to_mirror": mirror, "trials": error.size}
        rows.append(row)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """Error of every trial against reconstructibility, with the running median, and against the mirror margin."""
    from pipeline import pictures

    columns, running = made_tables["table"][0], made_tables["table_running"][0]
    cameras = [str(camera) for camera in made.sweep.arrays["cameras"]]

    def dots(column: str, named: bool) -> list[pictures.Series]:
        return [
            pictures.Series(
                x=np.clip(columns[column][columns["camera"] == camera], 1e-2, EDGES[-1]),
                y=columns["limb_error"][columns["camera"] == camera],
                line="points",
                label=CAMERA_NAMES[camera] if named else "",
                colour=CAMERA_COLOURS[camera],
            )
            for camera in cameras
        ]

    line = pictures.Series(
        x=np.maximum(running["reconstructibility"], 1e-2),
        y=running["limb_error_median"],
        label="",
        colour="black",
    )
    top = 1.05 * float(columns["limb_error"].max())
    reading = "" if _options(made).reading == "vector" else " of angles, as printed"
    correlation = made_tables["table_correlation"][0]
    overall = correlation["camera"] == "all"
    panels = [
        pictures.Panel(
            series=[*dots("reconstructibility", True), line],
            xlabel=rf"Reconstructibility $\eta_a${reading}",
            ylabel="3D error / limb length",
            xscale="log",
            ylim=(0.0, top),
            references=[("x", 1.0, "")],
        ),
        pictures.Panel(
            series=dots("mirror_margin", False),
            xlabel=r"Margin of the mirror $J(-s)\,/\,J(s)$",
            xscale="log",
            ylim=(0.0, top),
            references=[("x", MARGIN_GREEN_ABOVE, "")],
        ),
    ]
    proved = columns["proved"].mean()
    green = columns["light"] == "green"
    right = (
        f": {100 * (columns['limb_error'][green] < SUCCESS).mean():.0f} % of those {green.sum()} err by less than "
        f"{SUCCESS:g}"
        if green.any()
        else ""
    )
    pictures.draw_lines(
        stem,
        panels,
        columns=2,
        caption=f"{made.caption} {made.sweep.arrays['limb_error'].shape[1]} limbs, each before "
        f"{len(cameras)} cameras at {_options(made).distance_mm / 1000:g} m. Error: mean distance of "
        "relative trajectories over the limb's length. (a) Line: running median; dotted: $\\eta_a$ = 1; rank "
        f"correlation {float(correlation['spearman_vector'][overall][0]):.2f} (of angles, as printed: "
        f"{float(correlation['spearman_angle'][overall][0]):.2f}). (b) What can be known without the truth; dotted: "
        f"{MARGIN_GREEN_ABOVE:g}, above which a limb is called green{right}. {100 * proved:.1f} % of the programmes "
        "are proved to be solved.",
    )


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """Running median over log eta; truth, impostor and estimate of the trial at the cursor, of a good and a bad one."""
    from pipeline.studies.limbs.figures import (
        limb_scatter_recording,  # drawing is slow to import, and not always wanted
    )

    limb_scatter_recording.record(made, made_tables["table_running"][0], reconstructibility_of(made), folder)
