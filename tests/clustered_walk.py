"""Synthetic walk with marker clusters on thighs and shanks only, and a standing trial with knee and ankle markers.

Markers bear the names of OpenSim's Gait2354, y up, x forwards.  Clusters are rigid with segments of a synthetic walker,
so that knees and ankles are known: midway between the lateral and the medial marker.
"""

from __future__ import annotations

import numpy as np

from pipeline.skeleton import WALKER15
from pipeline.synthetic import walkers

HZ = 60.0
SIDES = {"R": 1.0, "L": -1.0}
TECHNICAL = {
    "Thigh": {"Upper": (60, 20, 260), "Front": (10, 75, 200), "Rear": (70, -20, 120)},
    "Shank": {"Upper": (45, 20, 300), "Front": (5, 50, 240), "Rear": (45, -25, 190)},
}
"""Marker positions of each cluster, mm from the lower end of the segment: lateral, forwards and upwards."""
ANATOMICAL = [
    f"{side}.{part}.{end}" for side in SIDES for part in ("Knee", "Ankle") for end in ("Lat", "Med")
]
_HALF_WIDTH = {"Knee": 50.0, "Ankle": 36.0}


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _frame(right: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Return the axes (T, 3, 3) of a body segment as columns: to the right, forwards, upwards."""
    up = _unit(up)
    right = _unit(right - (right * up).sum(axis=-1, keepdims=True) * up)
    return np.stack([right, np.cross(up, right), up], axis=-1)


def markers(joints: np.ndarray) -> dict[str, np.ndarray]:
    """Return the markers (T, 3), mm, of a body with the given joint positions (T, 15, 3), by marker name."""

    def at(name: str) -> np.ndarray:
        return joints[:, WALKER15.index(name)]

    across = at("right_hip") - at("left_hip")
    pelvis = _frame(across, at("sternum") - at("pelvis"))

    def stuck(origin: np.ndarray, axes: np.ndarray, *place: float) -> np.ndarray:
        return origin + axes @ np.array(place, dtype=float)

    output = {
        "V.Sacral": stuck(at("pelvis"), pelvis, 0, -90, 60),
        "Sternum": at("sternum"),
        "Top.Head": at("head"),
    }
    for side, sign in SIDES.items():
        long = {"R": "right", "L": "left"}[side]
        output[f"{side}.ASIS"] = stuck(at("pelvis"), pelvis, sign * 125, 80, 70)
        for marker, joint in (("Acromium", "shoulder"), ("Elbow", "elbow"), ("Wrist.Lat", "wrist")):
            output[f"{side}.{marker}"] = at(f"{long}_{joint}")
        for segment, upper, lower in (("Thigh", "hip", "knee"), ("Shank", "knee", "ankle")):
            end = at(f"{long}_{lower}")
            axes = _frame(across, at(f"{long}_{upper}") - end)
            for name, (lateral, forwards, up) in TECHNICAL[segment].items():
                output[f"{side}.{segment}.{name}"] = stuck(end, axes, sign * lateral, forwards, up)
            for name, which in (("Lat", 1.0), ("Med", -1.0)):
                width = _HALF_WIDTH[lower.title()]
                output[f"{side}.{lower.title()}.{name}"] = stuck(end, axes, sign * which * width, 0, 0)
        foot = _frame(across, _unit(axes[..., 2]) + np.array([0, 0, 1.0]))
        for name, offset in (
            ("Heel", (0, -60, -50)),
            ("Midfoot.Sup", (0, 60, -10)),
            ("Toe.Tip", (0, 170, -50)),
        ):
            output[f"{side}.{name}"] = stuck(end, foot, *offset)
    return output


def standing(joints: np.ndarray) -> np.ndarray:
    """Return the body (1, 15, 3) of a walk's first frame in standing posture, rotated by 90° about the vertical."""
    body = joints[:1].copy()
    for side in ("left", "right"):
        hip, knee, ankle = (WALKER15.index(f"{side}_{part}") for part in ("hip", "knee", "ankle"))
        thigh, shank = (np.linalg.norm(joints[0, a] - joints[0, b]) for a, b in ((hip, knee), (knee, ankle)))
        body[0, knee] = body[0, hip] - [0, 0, thigh]
        body[0, ankle] = body[0, knee] - [0, 0, shank]
    return body @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]) + [400.0, -900.0, 3.0]


def trials(
    seed: int = 4, noise_mm: float = 0.0, seconds: float = 4.0
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return all markers of a walk and of a standing trial, with y up; tests remove the markers they do not need."""
    output = walkers.walking_population(
        np.random.default_rng(seed),
        male=1,
        female=0,
        duration_s=seconds,
        frame_rate_hz=HZ,
        marker_noise_mm=0.0,
    )
    joints = output.positions_mm[0] + np.arange(output.positions_mm.shape[1])[:, None, None] / HZ * [
        0,
        1200.0,
        0,
    ]
    random = np.random.default_rng(seed)

    def as_filmed(markers_of: dict[str, np.ndarray], frames: int) -> dict[str, np.ndarray]:
        return {
            name: np.broadcast_to(position, (frames, 3))[:, [1, 2, 0]]
            + random.normal(scale=noise_mm, size=(frames, 3))
            for name, position in markers_of.items()
        }

    return as_filmed(markers(joints), len(joints)), as_filmed(markers(standing(joints)), 50)


def without(points: dict[str, np.ndarray], names: list[str]) -> dict[str, np.ndarray]:
    """Return the marker positions without the markers of the given names."""
    return {name: position for name, position in points.items() if name not in names}
