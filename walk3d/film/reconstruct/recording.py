"""Recording of one reconstructed walk for the viewer: image, reprojection, 3D with error bars, view, residuals."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from pipeline import recordings
from pipeline.scenes import Bars, Columns, Image2D, Notes, Plot, Rows, Space3D, Tabs
from pipeline.seeding import derive_generator
from pipeline.skeleton import WALKER15
from walk3d.film.reconstruct.clip import Walk
from walk3d.film.reconstruct.cycle import LEVEL_95
from walk3d.film.reconstruct.motion import keypoints_px, upright
from walk3d.film.reconstruct.summary import filmed_mm
from walk3d.film.video.small import film_of
from walk3d.film.walk import Reconstruction
from walk3d.film.walk.calibration import NORMAL, angle_half_widths, joint_half_widths
from walk3d.film.walk.objective import PITCH
from walk3d.film.walk.posterior import sample_positions
from walk3d.film.walk.sagittal_angles import ANGLES
from walk3d.film.walk.view import pitched

MAX_SAMPLES, MAX_SAMPLED_POSTURES = 12, 4000
"""Maximum number of walks, and of postures in all walks, that are drawn from the posterior.

The limits keep the recording below 5 MB.
"""
KNEE_COLOURS = {"left_knee": "blue", "right_knee": "orange"}
FRUSTUM_SHARE = 0.25
"""Length of the camera's frustum, as a share of the distance to the walker."""
_PELVIS = WALKER15.index("pelvis")


def drawn_walks(walk: Walk, reconstruction: Reconstruction, count: int) -> np.ndarray:
    """Draw walks (S, T, 15, 3), mm, from the posterior, with a spread that matches the calibrated error bars.

    Positions are relative to the pelvis, in level camera axes.
    """
    generator = derive_generator(0, "posterior samples")
    samples = sample_positions(
        reconstruction.posterior, reconstruction.fit.x, reconstruction.fit.times, generator, count
    )
    wider = joint_half_widths(walk.calibration, np.ones((len(WALKER15.joints), 3)), LEVEL_95)
    factor = wider / NORMAL[LEVEL_95]
    mean = reconstruction.posterior.positions_mm
    return mean + factor * (samples - mean)


def camera_matrix(
    reconstruction: Reconstruction, size_px: np.ndarray, scale: float, height_mm: float
) -> np.ndarray:
    """Return the camera matrix (3, 4) from homogeneous points, mm, to pixels of an image of the given size.

    The axes are right, away and up, and the camera is `height_mm` above their origin.  `scale` is the size of the image
    relative to the film.
    """
    focal = scale * reconstruction.focal_px
    inner = np.array([[focal, 0.0, size_px[0] / 2.0], [0.0, focal, size_px[1] / 2.0], [0.0, 0.0, 1.0]])
    level = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    turned = inner @ pitched(reconstruction.fit.x[PITCH]) @ level
    return np.column_stack([turned, -height_mm * turned[:, 2]])


def write_recording(walk: Walk, summary_text: str, path: Path, small: Mapping[int, np.ndarray]) -> None:
    """Write the recording of a walk's best stretch for the viewer.

    Parameters
    ----------
    walk : Walk
    summary_text : str
        Summary of the walk, Markdown.
    path : Path
    small : mapping of int to (h, w, 3)
        Small pictures of the film by frame; empty for keypoints alone.
    """
    stretch, reconstruction = walk.best, walk.best.fitted
    T = len(stretch.pixels)
    seconds = stretch.frames / walk.frame_rate_hz
    size_px = 2.0 * walk.centre_px
    if small:
        size_px = np.array(next(iter(small.values())).shape[1::-1], float)
    scale = size_px[0] / (2.0 * walk.centre_px[0])
    # A recording takes millimetres and has metres, here pixels of the small film; its rows count upwards.
    flip = 1e3 * scale * np.array([1.0, -1.0])
    image = {
        "keypoints": (keypoints_px(reconstruction) + walk.centre_px) * flip,
        "reprojection": (reconstruction.image_px + walk.centre_px) * flip,
    }
    mean = upright(reconstruction.posterior.positions_mm)
    mean[..., 2] -= mean[..., 2].min()
    count = int(np.clip(MAX_SAMPLED_POSTURES // T, 2, MAX_SAMPLES))
    samples = upright(drawn_walks(walk, reconstruction, count))
    samples += mean[:, _PELVIS, None] - samples[:, :, _PELVIS, None]
    size = 1e3 * scale * reconstruction.height_px
    walked = upright(filmed_mm(reconstruction))
    camera_height = -walked[..., 2].min()
    on_ground = walked + np.array([0.0, 0.0, camera_height])
    frustum = FRUSTUM_SHARE * np.linalg.norm(walked[:, _PELVIS], axis=-1).mean()
    residual = np.linalg.norm(keypoints_px(reconstruction) - reconstruction.image_px, axis=-1)
    visible = np.isfinite(residual)
    rms = np.sqrt(np.where(visible, residual**2, 0.0).sum(axis=1) / np.maximum(visible.sum(axis=1), 1) / 2.0)
    half = angle_half_widths(walk.calibration, reconstruction.posterior.angles_sd_rad, LEVEL_95)
    headings = (np.degrees(reconstruction.starts.headings_rad) + 180.0) % 360.0 - 180.0
    order = np.argsort(headings)
    evidence = reconstruction.starts.heading_cost.max() - reconstruction.starts.heading_cost
    knees = ", ".join(f"{name.removesuffix('_knee')} {colour}" for name, colour in KNEE_COLOURS.items())
    with recordings.Recording(path, name="keypoint_walk", about=summary_text, at=seconds) as recording:
        recording.image_points("image/observed", image["keypoints"], [(0, 0)], thickness_mm=0.009 * size)
        recording.image_points(
            "image/reprojection", image["reprojection"], colour="map",
            thickness_mm=0.006 * size,
        )  # fmt: skip
        recording.film(
            "image", camera_matrix(reconstruction, size_px, scale, camera_height), size_px, frustum_mm=frustum,
            content=film_of([*small.values()], walk.frame_rate_hz) if small else b"",
            at=np.array([*small]) / walk.frame_rate_hz,
        )  # fmt: skip
        recording.skeleton("walked/reconstructed", on_ground, colour="map", thickness_mm=20.0)
        bones = [(15 * s + a, 15 * s + b) for s in range(count) for a, b in WALKER15.bones]
        cloud = np.moveaxis(samples, 0, 1).reshape(T, -1, 3)
        recording.skeleton("world/samples", cloud, bones, colour="grey", thickness_mm=1.5)
        recording.skeleton("world/reconstructed", mean, colour="map")
        recording.bars("view/evidence", evidence[order] / 2.0, headings[order])
        for name, colour in KNEE_COLOURS.items():
            k = ANGLES.index(name)
            recording.curve(
                f"curves/angles/{name}", seconds, np.degrees(reconstruction.posterior.angles_rad[:, k]),
                sd=np.degrees(half[:, k]) / NORMAL[LEVEL_95], label=name.replace("_", " "), colour=colour,
            )  # fmt: skip
        recording.curve("curves/residual/rms", seconds, rms, label="rms", colour="black")
        recording.blueprint(
            Columns(
                Rows(
                    Image2D(name="image: keypoints (dots), reprojection (lines)"),
                    Plot(name="residual (px)", origin="curves/residual"),
                    shares=(3, 1),
                ),
                Rows(
                    Space3D(
                        name="3D: mean, and walks drawn from the posterior", eye_mm=(1800.0, -2200.0, 1400.0)
                    ),
                    Plot(name=f"knees (°): {knees}, ± 1 SD", origin="curves/angles"),
                    shares=(3, 1),
                ),
                Rows(
                    Tabs(Notes(), Bars(name="evidence by heading, 0: towards", origin="view")),
                    Space3D(
                        name="the camera, its film and the walk",
                        origin="walked",
                        contents=("walked", "image"),
                        eye_mm=(-3000.0, -1200.0, 2200.0),
                    ),
                    shares=(3, 2),
                ),
                shares=(3, 3, 2),
            ),
            playing=True,
        )
