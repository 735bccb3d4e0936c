"""Joints from the points of a recording, with z up."""

from __future__ import annotations

import numpy as np

from pipeline.skeleton.joints import WALKER15
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import Lowering, Rule, SourceMapping, UpAxis
from pipeline.skeleton.source_points import SourcePoints
from pipeline.skeleton.upright import axis_up

_TO_Z_UP = {
    UpAxis.x: np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    UpAxis.y: np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]),
    UpAxis.z: np.eye(3),
    UpAxis("-x"): np.array([[0.0, 1, 0], [0, 0, -1], [-1, 0, 0]]),
    UpAxis("-y"): np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]]),
    UpAxis("-z"): np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]),
}
"""Rotations (which keep handedness) that bring the named axis to z."""

LOWER_BODY = ("pelvis", "left_hip", "left_knee", "left_ankle", "right_hip", "right_knee", "right_ankle")
"""Joints without which there is no walk: they are never estimated."""


def map_joints(motion: MotionCapture, mapping: SourceMapping) -> tuple[np.ndarray, np.ndarray]:
    """Compute joint positions from source points, with z up.

    Joints other than legs and pelvis may be missing: they are NaN and not valid throughout.

    Parameters
    ----------
    motion : MotionCapture
        Positions (T, P, 3) in mm in the file's axes.
    mapping : SourceMapping
        As `pipeline.mappings` reads or proposes it: weights of a joint of WALKER15 sum to one.

    Returns
    -------
    positions : (T, 15, 3) float64
        Millimetres, z up, NaN where a source point is missing.
    valid : (T, 15) bool

    Raises
    ------
    InvalidInput
        If a joint of legs or pelvis has no rule or its rules name points that the file lacks, or a point stands
        twice in the file (two people).
    """
    points, found, positions = _in_own_axes(motion, mapping)
    positions = with_z_up(positions, _up_of(positions, motion, mapping))
    for j, (joint, rule) in enumerate(found.items()):
        if rule is not None and rule[1] is not None:
            positions[:, j, 2] -= rule[1].by * points.distance(joint, rule[1], mapping)
    return positions, np.all(np.isfinite(positions), axis=-1)


def with_z_up(positions: np.ndarray, up: UpAxis) -> np.ndarray:
    """Return positions (…, 3), turned so that the axis that pointed up is z."""
    return positions @ _TO_Z_UP[up].T


def up_axis(motion: MotionCapture, mapping: SourceMapping) -> UpAxis:
    """Return the axis of a file that points up: the one stated, or the one along which its joints stand.

    Raises
    ------
    InvalidInput
        As `map_joints`.
    """
    return _up_of(_in_own_axes(motion, mapping)[2], motion, mapping)


def _in_own_axes(
    motion: MotionCapture, mapping: SourceMapping
) -> tuple[SourcePoints, dict[str, tuple[Rule, Lowering | None] | None], np.ndarray]:
    """The points by name, the rule of each joint, and joints (T, 15, 3), mm, in the file's axes, none lowered."""
    points = SourcePoints(motion, mapping.points)
    found = {joint: points.rule_of(joint, mapping) for joint in WALKER15.joints}
    for joint, rule in found.items():
        if rule is None and joint in LOWER_BODY:
            raise points.lacking(joint, mapping)
    positions = np.full((len(motion.positions_mm), len(found), 3), np.nan)
    for j, rule in enumerate(found.values()):
        if rule is not None:
            weights = np.array(list(rule[0].values()), float)
            source = motion.positions_mm[:, [points.index(point) for point in rule[0]]]
            positions[:, j] = np.einsum("tpk,p->tk", source, weights)
    return points, found, positions


def _up_of(positions: np.ndarray, motion: MotionCapture, mapping: SourceMapping) -> UpAxis:
    """The axis that the caller stated, or along which joints (T, 15, 3) stand; a mapping's own breaks ties."""
    return axis_up(positions, mapping.up)[0] if motion.up == UpAxis.auto else motion.up
