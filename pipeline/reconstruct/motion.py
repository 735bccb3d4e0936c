"""The reconstructed walk as points in space, for files of motion and for recordings."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path

import numpy as np

from pipeline.core.anatomical.stance import ANKLES
from pipeline.core.keypoint_walk import Reconstruction
from pipeline.core.keypoint_walk.objective import HEADING
from pipeline.core.keypoint_walk.training import SIZE
from pipeline.core.keypoint_walk.verdict import Verdict
from pipeline.core.keypoint_walk.view import level_axes
from pipeline.formats import motion
from pipeline.reconstruct.clip import Input, Stretch, Walk
from pipeline.reconstruct.cycle import scale_mm
from pipeline.reconstruct.summary import observed
from pipeline.skeleton import WALKER15


class Format(StrEnum):
    """File formats of 3D motion."""

    c3d = "c3d"
    trc = "trc"
    bvh = "bvh"
    csv = "csv"
    """One row for each joint and frame."""
    csv_wide = "csv_wide"
    """One column for each coordinate."""


def keypoints_px(found: Reconstruction) -> np.ndarray:
    """Keypoints (T, 15, 2) as used, relative to the principal point; NaN where missing."""
    return np.where(found.keypoints.weights[..., None] > 0, found.keypoints.pixels, np.nan)


def upright(level: np.ndarray) -> np.ndarray:
    """Level camera axes (right, down, away) as right, away, up."""
    return np.stack([level[..., 0], level[..., 2], -level[..., 1]], axis=-1)


def in_walkers_axes(found: Reconstruction) -> np.ndarray:
    """Positions (T, 15, 3): x to the walker's right, y along the walk, z up from the lowest ankle, mm of the model.

    The axes are those of the heading in the middle of the stretch, where the pelvis is at x = y = 0; the path is
    included.
    """
    x, objective = found.fit.x, found.fit.objective
    own = x.copy()
    own[:SIZE] = found.posterior.walker.ravel()
    walked = objective.level_points(own) @ level_axes(float(x[HEADING]))
    walked = walked - walked[len(walked) // 2, WALKER15.index("pelvis")]
    walked[..., 2] -= walked[:, list(ANKLES), 2].min()
    return np.asarray(walked)


def written(walk: Walk) -> list[Stretch]:
    """Stretches that are, or may be, a walk: the best first, then by length."""
    usable = [s for s in walk.stretches if s.found and s.judgement.verdict != Verdict.not_a_walk]
    return sorted(usable, key=lambda s: s is not walk.best)


def to_motion(walk: Walk, stretch: Stretch, given: Input) -> motion.Motion:
    """Points of a stretch; the name of a joint that was never observed ends in ``_estimated``."""
    assert stretch.found is not None
    marks = ["" if seen else "_estimated" for seen in observed(stretch.found)]
    names = tuple(joint + mark for joint, mark in zip(WALKER15.joints, marks, strict=True))
    positions = in_walkers_axes(stretch.found) * scale_mm(given)
    return motion.Motion(names, positions, walk.frame_rate_hz, WALKER15.parents)


def write_motion(walk: Walk, given: Input, formats: list[Format], folder: Path) -> list[str]:
    """Write every stretch in every format, ``walk.c3d`` the best and ``walk_2.c3d`` the next; return the names."""
    files = []
    for number, stretch in enumerate(written(walk), start=1):
        points = to_motion(walk, stretch, given)
        stem = "walk" if number == 1 else f"walk_{number}"
        for kind in dict.fromkeys(formats):
            wide = kind == Format.csv_wide
            name = f"{stem}_wide.csv" if wide else f"{stem}.{kind}"
            motion.write(folder / name, points, wide=wide)
            files.append(name)
    return files
