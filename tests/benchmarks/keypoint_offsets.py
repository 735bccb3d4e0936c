"""Distance of MediaPipe's joints from optical joint centres, on the only film with both; nothing is timed.

For each kind of joint, in the walker's frame (outwards of its side, forwards, up): the offset, mm, that both sides
share, less the mean of all kinds (which no film tells from where the camera stands), with its standard error, and the
floor that the layout assumes.  Camera, focal length and offsets are fitted together; errors of successive frames are
taken to be as alike as they are.  One person in one stride: standard errors are of this film, and no other person's
offset lies within them.  Needs KEYPOINTS_RECORDINGS.

Symbols: ``f`` focal length, ``R`` turn and ``T`` place of the camera, ``o`` offsets by kind, ``u`` what one side has of
its own.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from pipeline.skeleton import WALKER15
from tests.benchmarks.tables import Row
from walk3d.film import keypoints
from walk3d.film.reconstruct import layouts
from walk3d.film.reconstruct.clip import FOCAL_SHARE
from walk3d.film.reconstruct.image import in_pixels

CENTRES = {
    "shoulder": "humerus", "elbow": "ulna", "wrist": "hand", "hip": "femur", "knee": "tibia", "ankle": "talus",
}  # fmt: skip
"""Body of the OpenSim model whose origin is the joint centre, for each kind of joint."""
OFFSET_MM, OWN_MM, NOISE_PX, FOCAL_SD = 40.0, 10.0, 4.0, 0.25
"""Prior standard deviations of shared offsets and one-sided offsets, mm, of keypoints, px, and of log focal length."""
_OUTWARDS = {"left": -1.0, "right": 1.0}
_KINDS = len(CENTRES)
JOINTS = [f"{side}_{kind}" for kind in CENTRES for side in _OUTWARDS]


def run() -> list[Row]:
    """Return one row for each kind of joint."""
    folder = folder_of_film("keypoint_offsets")
    source = keypoints.read(str(folder / "mediapipe.csv"))
    layout, order, _ = layouts.recognise(source, "")
    pixels, confidence = layouts.to_joints(layout, order, source)
    pixels, size = in_pixels(pixels, source.image_size, [])
    rows = [WALKER15.index(joint) for joint in JOINTS]
    image = (pixels - np.array(size) / 2.0)[:, rows]
    observed = (confidence[:, rows] > 0.3)[..., None] & np.isfinite(image)
    truth = centres(folder / "sample_mocap.json", source.frame / source.frame_rate_hz)
    offset, error, rms_px = _offsets(truth, np.nan_to_num(image), observed, FOCAL_SHARE * max(size))
    return [
        {
            "joint": kind,
            **{f"{axis}_mm": float(offset[k, a]) for a, axis in enumerate(("outwards", "forwards", "up"))},
            **{
                f"{axis}_error_mm": float(error[k, a])
                for a, axis in enumerate(("outwards", "forwards", "up"))
            },
            "assumed_floor_mm": float(layout.detector.floor_mm[WALKER15.index(f"left_{kind}")]),
            "rms_residual_px": rms_px,
        }
        for k, kind in enumerate(CENTRES)
    ]


def folder_of_film(asks: str) -> Path:
    """Return the folder with the film, its keypoints and the optical joint centres."""
    folder = Path(os.environ.get("KEYPOINTS_RECORDINGS", "")) / "mediapipe_oblique_with_truth"
    if not (folder / "sample_mocap.json").is_file():
        raise SystemExit(
            f"{asks}: set KEYPOINTS_RECORDINGS to the folder that contains mediapipe_oblique_with_truth"
        )
    return folder


def centres(path: Path, times: np.ndarray) -> np.ndarray:
    """Return optical joint centres (T, 12, 3), mm, at the film's times: to the walker's right, forwards, up."""
    recorded = json.loads(path.read_text(encoding="utf-8"))
    bodies = [f"{CENTRES[joint.split('_')[1]]}_{joint[0]}" for joint in JOINTS]
    points = 1e3 * np.stack([recorded["bodies"][body]["translation"] for body in bodies], axis=1)
    points = np.stack(
        [points[..., 2], points[..., 0], points[..., 1]], axis=-1
    )  # from forwards, up, to the right
    finite, at = np.array(recorded["time"]), times - times[0]
    flat = [np.interp(at, finite - finite[0], column) for column in points.reshape(len(points), -1).T]
    return np.stack(flat, axis=-1).reshape(len(times), *points.shape[1:])


def _offsets(
    truth: np.ndarray, image: np.ndarray, seen: np.ndarray, focal_px: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the offset of each kind of joint from the mean offset, its standard error, mm, and the residual, px."""
    side = np.array([*_OUTWARDS.values()] * _KINDS)
    mirror = np.stack([side, np.ones_like(side), np.ones_like(side)], axis=-1)
    kind = np.arange(2 * _KINDS) // 2

    def residual(x: np.ndarray) -> np.ndarray:
        shared, reference = x[7 : 7 + 3 * _KINDS].reshape(-1, 3), x[7 + 3 * _KINDS :].reshape(-1, 3)
        points = truth + mirror * shared[kind] + reference
        camera = points @ Rotation.from_rotvec(x[1:4]).as_matrix().T + x[4:7]
        return (np.exp(x[0]) * camera[..., :2] / camera[..., 2:] - image) * seen

    def weighted(x: np.ndarray) -> np.ndarray:
        reference = x[7 + 3 * _KINDS :] / OWN_MM
        prior = ((x[0] - np.log(focal_px)) / FOCAL_SD, x[7 : 7 + 3 * _KINDS] / OFFSET_MM, reference)
        return np.concatenate([residual(x).ravel() / NOISE_PX, np.hstack(prior)])

    fits = [least_squares(weighted, start, x_scale="jac") for start in _starts(truth, image, focal_px)]
    best = min(fits, key=lambda fit: fit.cost)
    left = residual(best.x)
    alike = float((left[1:] * left[:-1]).sum() / (left**2).sum())
    inflation = (1.0 + alike) / (1.0 - alike)  # of the variance of a mean, of errors that are alike so
    count = left.size
    covariance = np.linalg.inv(
        best.jac[:count].T @ best.jac[:count] / inflation + best.jac[count:].T @ best.jac[count:]
    )
    less_mean = np.kron(np.eye(_KINDS) - 1.0 / _KINDS, np.eye(3))
    shared = slice(7, 7 + 3 * _KINDS)
    error = np.sqrt(np.diag(less_mean @ covariance[shared, shared] @ less_mean.T))
    rms = float(np.sqrt((left**2).sum() / seen.sum()))
    return (less_mean @ best.x[shared]).reshape(-1, 3), error.reshape(-1, 3), rms


def _starts(truth: np.ndarray, image: np.ndarray, focal_px: float) -> list[np.ndarray]:
    """Return initial cameras at twelve azimuths around the walker, at the distance given by the walker's image size."""
    middle = truth.mean(axis=(0, 1))
    depth = focal_px * np.ptp(truth[..., 2], axis=1).mean() / np.ptp(image[..., 1], axis=1).mean()
    starts = []
    for angle in np.radians(np.arange(0.0, 360.0, 30.0)):
        ahead, down = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([0.0, 0.0, -1.0])
        turn = np.stack([np.cross(down, ahead), down, ahead])
        position = np.array([0.0, 0.0, depth]) - turn @ middle
        vector = Rotation.from_matrix(turn).as_rotvec()
        starts.append(np.concatenate([[np.log(focal_px)], vector, position, np.zeros(9 * _KINDS)]))
    return starts
