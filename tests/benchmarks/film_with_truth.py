"""Errors of a public film, reconstructed by the command, relative to optical joint centres; nothing is timed.

A row from the film (where the extra `video` and its networks are there) and one from its keypoints: verdict, heading
and cadence; the mean distance of hips, knees, ankles, shoulders, elbows and wrists from the recorded centres, mm, both
about the middle of the hips, turned about the vertical and scaled once; root mean square error of the knees' angles;
and how often the bars of 95 % hold.  Needs KEYPOINTS_RECORDINGS.
"""

from __future__ import annotations

import importlib.util
import json
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from tests.benchmarks.keypoint_offsets import JOINTS, centres, folder_of_film
from tests.benchmarks.tables import Row
from walk3d.film.reconstruct.clip import Input
from walk3d.film.reconstruct.writing import Output, Reconstruct
from walk3d.film.reconstruct.writing import run as reconstruct


def run() -> list[Row]:
    """Return one row for the film and one row for its keypoints."""
    folder = folder_of_film("film_with_truth")
    inputs = ["mediapipe.csv"]
    if all(importlib.util.find_spec(name) for name in ("cv2", "ai_edge_litert")):
        inputs.insert(0, "video.mp4")
    return [_row(folder, name) for name in inputs]


def _row(folder: Path, name: str) -> Row:
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "walk"
        output = Output(path=str(out), page=False, recording=False, overlay=False)
        reconstruct(Reconstruct(input=Input(path=str(folder / name)), output=output))
        summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
        joints = pd.read_csv(out / "joints.csv").query("stretch == 0")
    by_joint = dict(iter(joints.groupby("joint")))
    axes = list("xyz")
    result = np.stack([by_joint[joint][axes].to_numpy() for joint in JOINTS], axis=1)
    half = np.stack([by_joint[joint][[f"half_{a}" for a in axes]].to_numpy() for joint in JOINTS], axis=1)
    truth = centres(folder / "sample_mocap.json", by_joint[JOINTS[0]]["time_s"].to_numpy())
    hips = [JOINTS.index(f"{side}_hip") for side in ("left", "right")]
    result, truth = (points - points[:, hips].mean(axis=1, keepdims=True) for points in (result, truth))
    aligned, scale = _aligned(result, truth)
    knees = [_knee(result, side) - _knee(truth, side) for side in ("left", "right")]
    return {
        "input": name,
        "verdict": str(summary["verdict"]),
        "heading_deg": float(summary["view_angle_deg"]["heading_deg"]),
        "steps_per_min": float(summary["cadence"]["steps_per_min"]),
        "error_mm": float(np.linalg.norm(aligned - truth, axis=-1).mean()),
        "knee_rms_deg": float(np.sqrt(np.mean(np.square(knees)))),
        "bars_hold": float(np.mean(np.abs(aligned - truth) <= scale * half)),
    }


def _aligned(found: np.ndarray, truth: np.ndarray) -> tuple[np.ndarray, float]:
    """Return points rotated about the vertical and scaled to fit the ground truth, and the scale factor."""
    a, b = found[..., 0] + 1j * found[..., 1], truth[..., 0] + 1j * truth[..., 1]
    level = a * np.exp(1j * np.angle((a.conj() * b).sum()))
    points = np.stack([level.real, level.imag, found[..., 2]], axis=-1)
    scale = float((points * truth).sum() / (points**2).sum())
    return scale * points, scale


def _knee(points: np.ndarray, side: str) -> np.ndarray:
    """Return the knee flexion (T,), degrees: the angle between thigh and shank."""
    hip, knee, ankle = (points[:, JOINTS.index(f"{side}_{joint}")] for joint in ("hip", "knee", "ankle"))
    thigh, shank = knee - hip, ankle - knee
    size = np.linalg.norm(thigh, axis=-1) * np.linalg.norm(shank, axis=-1)
    return np.degrees(np.arccos(np.clip((thigh * shank).sum(axis=-1) / size, -1.0, 1.0)))
