"""Files of a reconstructed walk in one folder: summary, joints with bars, 3D motion, picture, recording, page."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.core.keypoint_walk.calibration import angle_half_widths
from pipeline.core.keypoint_walk.objective import HEADING
from pipeline.core.keypoint_walk.posterior import ANGLES
from pipeline.pictures.keypoint_walk import WalkPicture, draw_keypoint_walk
from pipeline.reconstruct import motion, recording, words
from pipeline.reconstruct.clip import Input, Walk, reconstruct_clip
from pipeline.reconstruct.model_file import SHIPPED
from pipeline.reconstruct.motion import Format
from pipeline.reconstruct.summary import LEVEL_95, heading_words, summarise, table_rows
from pipeline.storage import tables
from pipeline.validation import InvalidInput, require_name

OURS = ("summary.json", "joints.csv", "picture.png", recording.NAME)
PICTURED = 5
"""Frames that a picture shows."""


@dataclass(kw_only=True)
class Output:
    """What is written where."""

    path: str = ""  # folder; empty: results/reconstructed/<name of the input>
    formats: list[Format] = field(default_factory=lambda: [Format.c3d, Format.trc, Format.bvh, Format.csv])
    picture: bool = True
    recording: bool = True  # for the rerun viewer


@dataclass(kw_only=True)
class Reconstruct:
    """Options of the command ``reconstruct``."""

    input: Input = field(default_factory=Input)
    output: Output = field(default_factory=Output)
    model_folder: str = ""  # of a model of one's own; empty: the one that comes with the package


def run(options: Reconstruct) -> tuple[Walk, dict[str, Any], Path]:
    """Reconstruct a file or folder of keypoints and write what was found.

    Parameters
    ----------
    options : Reconstruct

    Returns
    -------
    walk : Walk
    summary : dict
        As written to ``summary.json``.
    folder : Path

    Raises
    ------
    InvalidInput
        If the input cannot be used, or the folder holds files of others.
    """
    walk = reconstruct_clip(options.input, Path(options.model_folder) if options.model_folder else SHIPPED)
    folder = Path(options.output.path) if options.output.path else _default_folder(options.input.path)
    summary = summarise(walk, options.input)
    write(walk, summary, options, folder)
    return walk, summary, folder


def _default_folder(path: str) -> Path:
    resolved = Path(path).resolve()
    name = resolved.name if resolved.is_dir() else resolved.stem
    # Many are called alike: the folder above tells them apart.
    return Path("results") / "reconstructed" / require_name("output.path", f"{resolved.parent.name}_{name}")


def write(walk: Walk, summary: dict[str, Any], options: Reconstruct, folder: Path) -> None:
    """Write the files of a walk; only files of these names are ever replaced."""
    if folder.exists() and not folder.is_dir():
        raise InvalidInput("must be a folder", where="output.path", received=str(folder))
    folder.mkdir(parents=True, exist_ok=True)
    for path in folder.iterdir():
        if path.name in OURS or motion.OURS.fullmatch(path.name):
            path.unlink()
    text = json.dumps(summary, indent=1, ensure_ascii=False) + "\n"
    (folder / "summary.json").write_text(text, encoding="utf-8")
    rows = table_rows(walk, options.input)
    if rows["frame"]:
        tables.write(folder / "joints.csv", rows)
    motion.write_motion(walk, options.input, options.output.formats, folder)
    if walk.best.found is None or summary["verdict"] == "not_a_walk":
        return
    if options.output.picture:
        draw_keypoint_walk(folder / "picture.png", _picture(walk, options.input))
    if options.output.recording:
        recording.write_recording(walk, walk.best, words.as_markdown(summary), folder)


def _picture(walk: Walk, given: Input) -> WalkPicture:
    stretch = walk.best
    found = stretch.found
    assert found is not None
    T = len(stretch.pixels)
    chosen = np.unique(np.linspace(0, T - 1, PICTURED).round().astype(int))
    keypoints = np.where(found.keypoints.weights[..., None] > 0, found.keypoints.pixels, np.nan)
    points = found.fit.objective.camera_points(found.fit.x)
    reprojected = walk.focal_px * points[..., :2] / points[..., 2:]
    knees = [ANGLES.index("left_knee"), ANGLES.index("right_knee")]
    half = angle_half_widths(walk.calibration, found.posterior.angles_sd_rad, LEVEL_95) * walk.bars_factor
    heading = float(found.fit.x[HEADING])
    return WalkPicture(
        keypoints=keypoints[chosen] + walk.centre_px,
        reprojected=reprojected[chosen] + walk.centre_px,
        frames=chosen + stretch.first_frame,
        headings_deg=np.degrees(found.starts.headings_rad),
        heading_cost=found.starts.heading_cost,
        heading_deg=float(np.degrees(heading)),
        times_s=(stretch.first_frame + np.arange(T)) / walk.frame_rate_hz,
        angles_deg=np.degrees(found.posterior.angles_rad[:, knees]),
        half_deg=np.degrees(half[:, knees]),
        angle_names=["left knee", "right knee"],
        positions_mm=found.posterior.positions_mm[chosen],
        title=f"{Path(given.path).name}: {stretch.judgement.verdict}, {heading_words(heading)}",
    )
