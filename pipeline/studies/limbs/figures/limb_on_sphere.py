"""Recording of a sweep over trials with one limb: charts of the error, and the path of a limb on its sphere."""

from __future__ import annotations

import numpy as np

from pipeline.charts import on_timeline
from pipeline.scenes import Columns, Notes, Rows, Space3D
from pipeline.studies.figure_inputs import FigureInputs
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.model import BasisFit
from pipeline.studies.limbs.one_limb import SweptErrors
from pipeline.studies.study import Recorder

Inputs = FigureInputs[LimbStretches, BasisFit, SweptErrors]


RADIUS_MM = 1000.0
"""Radius, mm, of the sphere in recordings; paths of limbs are scaled to this radius."""

EYE_MM = (2100.0, 1500.0, 1000.0)
"""Position of the viewer's eye relative to the centre of the sphere."""

OUTSIDE = 1.03
"""Factor that draws the estimated path slightly outside the sphere, so that it does not hide the true path."""

TRUTH_COLOUR, ESTIMATE_COLOUR = "green", "orange"


def sphere() -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Return the points (1, J, 3), mm, of circles on a sphere, and the pairs of points to connect by lines."""
    meridians, parallels, steps = 8, 5, 48  # circles through the poles, around them, and points to a circle
    turn = np.linspace(0.0, 2.0 * np.pi, steps, endpoint=False)
    circles = []
    for azimuth in np.linspace(0.0, np.pi, meridians, endpoint=False):
        flat = np.sin(turn)
        circles.append(np.column_stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.cos(turn)]))
    for height in np.linspace(-1.0, 1.0, parallels + 2)[1:-1]:
        wide = np.sqrt(1.0 - height**2)
        circles.append(np.column_stack([wide * np.cos(turn), wide * np.sin(turn), np.full(steps, height)]))
    joined = [(c * steps + i, c * steps + (i + 1) % steps) for c in range(len(circles)) for i in range(steps)]
    return RADIUS_MM * np.concatenate(circles)[None], joined


def path_bones(frames: int) -> list[tuple[int, int]]:
    """Return the pairs of successive frames, which are the line segments of a path."""
    return [(f, f + 1) for f in range(frames - 1)]


def record_on_sphere(
    inputs: Inputs,
    begin: Recorder,
    timeline: str,
    swept: str,
) -> None:
    """Record charts of the error against the varied quantity, and the path of one limb on its sphere."""
    sweep = inputs.sweep
    trial = sweep.rows[sweep.rows["trial"] == sweep.shown].iloc[0]
    truth, estimate = RADIUS_MM * sweep.paths[:, 0], RADIUS_MM * OUTSIDE * sweep.paths[:, 1]
    globe, wires = sphere()
    at = np.unique(on_timeline(timeline, sweep.rows[swept].to_numpy()))
    bones = path_bones(truth.shape[1])
    with begin(
        f"\nThe limb shown is `{trial['limb']}` of `{trial['clip']}`, {Camera(trial['camera']).words}: the trial whose"
        " errors are nearest to the medians. Its end moves on the sphere of the limb, drawn with a radius of "
        f"{RADIUS_MM / 1000.0:g} m: {TRUTH_COLOUR} the truth, {ESTIMATE_COLOUR} the estimate at the value at the "
        f"cursor, drawn {100 * (OUTSIDE - 1):.0f} % outside. Drag the cursor.\n",
        timeline=timeline,
        at=at,
    ) as rec:
        rec.skeleton("world/original", truth, bones, colour=TRUTH_COLOUR, thickness_mm=6.0)
        rec.skeleton("world/reconstructed", estimate, bones, colour=ESTIMATE_COLOUR, thickness_mm=6.0)
        rec.skeleton("world/sphere", globe, wires, at=at[:1], thickness_mm=1.0)
        sphere_view = Space3D(name="truth and estimate", eye_mm=EYE_MM, target_mm=(0.0, 0.0, 0.0))
        rec.blueprint(Columns(sphere_view, Rows(*rec.plots, Notes())))
