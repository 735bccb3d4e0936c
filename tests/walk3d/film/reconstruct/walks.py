"""Files with simulated keypoints."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from pipeline.skeleton import WALKER15
from walk3d.film.reconstruct.clip import Input
from walk3d.film.reconstruct.layouts import layouts
from walk3d.film.simulation.keypoints import DetectorError, SimulatedKeypoints

SIZE = (1920, 1080)
ERROR = DetectorError(white_px=2.0, slow_px=2.0, bias_mm=5.0, missing=0.02, swaps_per_s=0.0)


def given(path: Path, **more: object) -> Input:
    """Return the input options that describe a simulated video."""
    options = {"path": str(path), "frame_rate_hz": 30.0, "width": SIZE[0], "height": SIZE[1], "focal_px": 0.0}
    return Input(**{**options, **more})  # type: ignore[arg-type]


def in_layout(sim: SimulatedKeypoints, name: str) -> np.ndarray:
    """Return the points (T, K, 3) of a layout, px and confidence, from simulated joints.

    Points that are not joints have the confidence 0.
    """
    layout = layouts()[name]
    pixels = np.nan_to_num(sim.pixels + np.array(SIZE) / 2.0)
    values = np.zeros((len(pixels), len(layout.points), 3))
    for joint, points in layout.joints.items():
        for point in points:
            column = layout.points.index(point)
            values[:, column, :2] = pixels[:, WALKER15.index(joint)]
            values[:, column, 2] = 0.9
    values[~np.isfinite(sim.pixels).all(axis=-1).any(axis=1)] = 0.0
    return values


def alphapose(path: Path, values: np.ndarray) -> Path:
    """Write keypoints to a file in the format of AlphaPose, and return its path."""
    rows = [
        {"image_id": f"{t}.jpg", "keypoints": v.ravel().tolist(), "idx": [0.0]} for t, v in enumerate(values)
    ]
    path.write_text(json.dumps(rows), encoding="utf-8")
    return path
