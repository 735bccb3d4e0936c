"""Joints from the points of a recording, with z up."""

from __future__ import annotations

import numpy as np

from pipeline.skeleton.joints import WALKER15, Skeleton
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import Lowering, Rule, SourceMapping, UpAxis
from pipeline.skeleton.source_points import SourcePoints
from pipeline.validation import InvalidInput, require_choice

_TO_Z_UP = {
    UpAxis.x: np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    UpAxis.y: np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]),
    UpAxis.z: np.eye(3),
    UpAxis.minus_x: np.array([[0.0, 1, 0], [0, 0, -1], [-1, 0, 0]]),
    UpAxis.minus_y: np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]]),
    UpAxis.minus_z: np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]),
}
"""Rotations (which keep handedness) that bring the named axis to z."""

LOWER_BODY = ("pelvis", "left_hip", "left_knee", "left_ankle", "right_hip", "right_knee", "right_ankle")
"""Joints without which there is no walk: they are never estimated."""


def map_joints(
    motion: MotionCapture, mapping: SourceMapping, skeleton: Skeleton = WALKER15
) -> tuple[np.ndarray, np.ndarray]:
    """Compute joint positions from source points, with z up.

    Joints other than legs and pelvis may be missing: they are NaN and not valid throughout.

    Parameters
    ----------
    motion : MotionCapture
        Positions (T, P, 3) in mm in the file's axes.
    mapping : SourceMapping
    skeleton : Skeleton

    Returns
    -------
    positions : (T, J, 3) float64
        Millimetres, z up, NaN where a source point is missing.
    valid : (T, J) bool

    Raises
    ------
    InvalidInput
        If a joint of legs or pelvis has no rule or its rules name points that the file lacks, weights do
        not sum to one, or a point stands twice in the file (two people).
    """
    points, found, positions = _in_own_axes(motion, mapping, skeleton)
    positions = with_z_up(positions, _up_of(positions, mapping, skeleton))
    for j, joint in enumerate(skeleton.joints):
        if (rule := found[joint]) is not None and rule[1] is not None:
            positions[:, j, 2] -= rule[1].by * points.distance(joint, rule[1], mapping)
    return positions, np.all(np.isfinite(positions), axis=-1)


def with_z_up(positions: np.ndarray, up: UpAxis) -> np.ndarray:
    """Return positions (…, 3), turned so that the axis that pointed up is z."""
    return positions @ _TO_Z_UP[up].T


def up_axis(motion: MotionCapture, mapping: SourceMapping, skeleton: Skeleton = WALKER15) -> UpAxis:
    """Return the axis of a file that points up: as its mapping says, or along which the hips are above the ankles.

    Raises
    ------
    InvalidInput
        As `map_joints`.
    """
    return _up_of(_in_own_axes(motion, mapping, skeleton)[2], mapping, skeleton)


def _in_own_axes(
    motion: MotionCapture, mapping: SourceMapping, skeleton: Skeleton
) -> tuple[SourcePoints, dict[str, tuple[Rule, Lowering | None] | None], np.ndarray]:
    """The points by name, the rule of each joint, and joints (T, J, 3), mm, in the file's axes, none lowered."""
    require_choice(f"{mapping.name}.up", mapping.up, UpAxis)
    for joint in (*mapping.joints, *mapping.otherwise, *mapping.lowered):
        require_choice(f"{mapping.name}.joints", joint, skeleton.joints)
    points = SourcePoints(motion, mapping.points)
    found = {joint: points.rule_of(joint, mapping) for joint in skeleton.joints}
    for joint, rule in found.items():
        if rule is None and joint in LOWER_BODY:
            raise points.lacking(joint, mapping)
    positions = np.full((len(motion.positions_mm), len(skeleton.joints), 3), np.nan)
    for j, joint in enumerate(skeleton.joints):
        if (rule := found[joint]) is not None:
            weights = np.array(list(rule[0].values()), float)
            if abs(weights.sum() - 1.0) > 1e-6:
                raise InvalidInput(
                    f"the weights of {joint!r} do not sum to one",
                    mapping.name,
                    received=f"{weights.sum():g}",
                )
            source = motion.positions_mm[:, [points.index(point) for point in rule[0]]]
            positions[:, j] = np.einsum("tpk,p->tk", source, weights)
    return points, found, positions


def _up_of(positions: np.ndarray, mapping: SourceMapping, skeleton: Skeleton) -> UpAxis:
    """The axis that a mapping says, or the signed one along which hips are above ankles, all over the clip."""
    hips, ankles = (
        [k for k, joint in enumerate(skeleton.joints) if joint.endswith(part)] for part in ("hip", "ankle")
    )
    if mapping.up != UpAxis.auto or not hips or not ankles:
        return UpAxis.z if mapping.up == UpAxis.auto else UpAxis(mapping.up)
    legs = (positions[:, hips] - positions[:, ankles]).reshape(-1, 3)
    legs = legs[np.isfinite(legs).all(axis=1)]
    if not len(legs):
        return UpAxis.z
    mean = legs.mean(axis=0)
    axis = int(np.abs(mean).argmax())
    return UpAxis(("-" if mean[axis] < 0 else "") + "xyz"[axis])
