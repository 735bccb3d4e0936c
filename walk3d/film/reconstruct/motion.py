"""Reconstructed walk as 3D points, for motion files and recordings."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path

import numpy as np

from pipeline.core.fourier import cycle_basis
from pipeline.skeleton import ANKLES, PELVIS, WALKER15
from walk3d.export import motion
from walk3d.export.bvh import Names
from walk3d.film.reconstruct.clip import Walk
from walk3d.film.reconstruct.cycle import scale_mm
from walk3d.film.reconstruct.summary import observed, units, world_mm
from walk3d.film.walk import Reconstruction
from walk3d.film.walk.film import Stretch
from walk3d.film.walk.objective import HEADING
from walk3d.film.walk.training import BLOCKS
from walk3d.film.walk.view import level_axes


class Format(StrEnum):
    """File formats of 3D motion."""

    c3d = "c3d"
    trc = "trc"
    bvh = "bvh"
    csv = "csv"
    """CSV file with one row for each joint and frame."""
    csv_wide = "csv_wide"
    """CSV file with one row for each frame, and one column for each coordinate."""


def keypoints_px(reconstruction: Reconstruction) -> np.ndarray:
    """Return the keypoints (T, 15, 2) used in the fit, px relative to the principal point, NaN where missing."""
    return np.where(reconstruction.keypoints.weights[..., None] > 0, reconstruction.filmed_px, np.nan)


def upright(level: np.ndarray) -> np.ndarray:
    """Convert vectors from level camera axes (right, down, away) to axes (right, away, up)."""
    return np.stack([level[..., 0], level[..., 2], -level[..., 1]], axis=-1)


def in_walkers_axes(reconstruction: Reconstruction) -> np.ndarray:
    """Return positions (T, 15, 3), mm for a walker of the model's height: x to the right, y forwards, z upwards.

    The directions are those of the walker, and z is 0 at the lowest ankle.

    The heading in the middle of the stretch defines the axes; there the pelvis is at x = y = 0.  The path is included.
    """
    walked = world_mm(reconstruction) @ level_axes(reconstruction.fit.x[HEADING])
    walked[..., 2] -= walked[:, ANKLES, 2].min()
    return walked


def usable_stretches(walk: Walk) -> list[Stretch]:
    """Return the stretches that are a walk or a doubtful walk, the best stretch first.

    The remaining stretches are sorted by length.
    """
    usable = [s for s in walk.stretches if s.walks]
    return sorted(usable, key=lambda s: s is not walk.best)


def to_motion(walk: Walk, stretch: Stretch, names: Names, *, in_place: bool) -> motion.Motion:
    """Convert a reconstructed stretch of a film to a motion for export.

    The arguments `names` and `in_place` only matter for BVH.
    """
    positions = in_walkers_axes(stretch.fitted) * scale_mm(walk)
    if in_place:
        pelvis = positions[:, PELVIS, None, :2]
        positions[..., :2] -= pelvis - pelvis.mean(axis=0)
    return motion.Motion(WALKER15.joints, positions, walk.frame_rate_hz, WALKER15.parents, character=names)


def one_cycle(walk: Walk, stretch: Stretch, names: Names, *, in_place: bool) -> motion.Motion:
    """Return one gait cycle of a reconstructed walk, from left foot contact to the next, for playback in a loop.

    The frame rate is about that of the video.

    The frame rate is about that of the video.

    The last frame repeats the first, one stride ahead unless in place, so that the motion loops.
    """
    reconstruction = stretch.fitted
    frequency = reconstruction.fit.frequency_hz
    frames = max(round(walk.frame_rate_hz / frequency), 8)
    share = np.arange(frames + 1) / frames
    basis = cycle_basis(reconstruction.cycle.phases[0, 0] + 2.0 * np.pi * share, BLOCKS)
    basis[-1] = basis[0]
    positions = np.moveaxis(reconstruction.posterior.walker @ basis.T, -1, 0)
    positions[..., 2] -= positions[:, ANKLES, 2].min()
    if not in_place:
        stride = (
            2.0 * np.pi * (reconstruction.fit.objective.prior.belt @ reconstruction.posterior.walker.ravel())
        )
        positions[..., 1] += stride * share[:, None]
    return motion.Motion(
        WALKER15.joints, positions * scale_mm(walk), frames * frequency, WALKER15.parents, character=names
    )


ABOUT = """\
Joints that were never seen and are estimated from the others: {unseen}.
Feet, hands, spine and collars of a BVH follow their limbs: they were not observed.
BVH: centimetres, y up, z forwards, {moving}, names of {names}, a T-pose at rest, rotations only below one root.
Limbs of a BVH have their mean lengths, so its joints are some centimetres off those of the other files.
walk_cycle.bvh: one exact cycle from the left foot's contact to its next; the last frame repeats the first{ahead}.
TRC: millimetres, y up, x forwards (OpenSim). C3D and CSV: millimetres, x to the right, y along the walk, z up.
Lengths are in {units}.
"""
"""Return the text of ``motion.txt``: conventions and limits of the motion files."""


def write_motion(walk: Walk, formats: list[Format], folder: Path, names: Names, *, in_place: bool) -> None:
    """Write each reconstructed stretch as a motion file in each format, and the description ``motion.txt``.

    ``walk.c3d`` contains the best stretch, ``walk_2.c3d`` the next.
    """
    stretches = usable_stretches(walk) if formats else []
    for number, stretch in enumerate(stretches, start=1):
        stem = "walk" if number == 1 else f"walk_{number}"
        for kind in dict.fromkeys(formats):
            wide = kind == Format.csv_wide
            name = f"{stem}_wide.csv" if wide else f"{stem}.{kind}"
            still = in_place and kind == Format.bvh
            motion.write(folder / name, to_motion(walk, stretch, names, in_place=still), wide=wide)
        if Format.bvh in formats:
            cycle = one_cycle(walk, stretch, names, in_place=in_place)
            motion.write(folder / f"{stem}_cycle.bvh", cycle)
    if stretches:
        visible = observed(stretches[0].fitted)
        text = ABOUT.format(
            unseen=", ".join(
                joint
                for joint, joint_visible in zip(WALKER15.joints, visible, strict=True)
                if not joint_visible
            )
            or "none",
            moving="in place" if in_place else "moving forwards",
            names=names,
            ahead="" if in_place else ", a stride ahead",
            units=units(walk),
        )
        (folder / "motion.txt").write_text(text, "utf-8")
