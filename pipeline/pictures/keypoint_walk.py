"""Picture of a walk reconstructed from keypoints: images with the reprojection, views, joint angles with bars."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pipeline.palette import hex_colour
from pipeline.skeleton import WALKER15

SIZE_INCHES = (10.0, 6.4)
DPI = 120


@dataclass(frozen=True)
class WalkPicture:
    """What is drawn.

    Attributes
    ----------
    keypoints, reprojected : (F, 15, 2)
        Of a few frames, px; NaN where missing.
    frames : (F,) int
    headings_deg, heading_cost : (H,)
        Twice the negative logarithm of the probability of each heading, before the refinement.
    heading_deg : float
    times_s : (T,)
    angles_deg, half_deg : (T, A)
        Joint angles and half widths of their 95 % bars.
    angle_names : sequence of str
    positions_mm : (F, 15, 3)
        Of the same frames about the pelvis: right, down, away.
    title : str
    """

    keypoints: np.ndarray
    reprojected: np.ndarray
    frames: np.ndarray
    headings_deg: np.ndarray
    heading_cost: np.ndarray
    heading_deg: float
    times_s: np.ndarray
    angles_deg: np.ndarray
    half_deg: np.ndarray
    angle_names: Sequence[str]
    positions_mm: np.ndarray
    title: str


def draw_keypoint_walk(path: Path, drawn: WalkPicture) -> None:
    """Draw a reconstructed walk as a PNG."""
    figure = Figure(figsize=SIZE_INCHES, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(drawn.title, fontsize=10)
    image, view, side, angles = figure.subplots(2, 2).ravel()
    seen, made = hex_colour("original"), hex_colour("map")
    image.set_title("keypoints (dots) and reprojection (lines), px", fontsize=8)
    for keypoints, lines in zip(drawn.keypoints, drawn.reprojected, strict=True):
        for a, b in WALKER15.bones:
            image.plot(lines[[a, b], 0], lines[[a, b], 1], color=made, linewidth=0.8)
        image.plot(keypoints[:, 0], keypoints[:, 1], ".", color=seen, markersize=3)
    image.invert_yaxis()
    image.set_aspect("equal", adjustable="datalim")
    view.set_title("how unlikely each heading is before the refinement (0: towards the camera)", fontsize=8)
    order = np.argsort((drawn.headings_deg + 180.0) % 360.0)
    view.plot(
        (drawn.headings_deg[order] + 180.0) % 360.0 - 180.0,
        drawn.heading_cost[order] - drawn.heading_cost.min(),
        color=made,
        linewidth=1.0,
    )
    view.axvline(drawn.heading_deg, color=seen, linewidth=0.8, linestyle=":")
    view.set_yscale("symlog", linthresh=10.0)
    view.set_ylim(bottom=0.0)
    side.set_title("from above (x right, y away) and from the walker's place, mm", fontsize=8)
    for number, posture in enumerate(drawn.positions_mm):
        shift = 900.0 * number
        for a, b in WALKER15.bones:
            side.plot(shift + posture[[a, b], 0], -posture[[a, b], 1], color=made, linewidth=0.8)
            side.plot(shift + posture[[a, b], 0], -1500.0 + posture[[a, b], 2], color=seen, linewidth=0.8)
    side.set_aspect("equal", adjustable="datalim")
    angles.set_title("knee angles, degrees, with 95 % bars", fontsize=8)
    for k, name in enumerate(drawn.angle_names):
        colour = seen if k else made
        angles.plot(drawn.times_s, drawn.angles_deg[:, k], color=colour, linewidth=1.0, label=name)
        low, high = (
            drawn.angles_deg[:, k] - drawn.half_deg[:, k],
            drawn.angles_deg[:, k] + drawn.half_deg[:, k],
        )
        angles.fill_between(drawn.times_s, low, high, color=colour, alpha=0.16, linewidth=0)
    angles.legend(fontsize=7)
    angles.set_xlabel("s", fontsize=8)
    for axes in (image, view, side, angles):
        axes.tick_params(labelsize=7)
    figure.savefig(path, dpi=DPI, metadata={"Software": None})
