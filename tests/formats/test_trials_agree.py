"""Tests that trials available as markers (C3D) and as a fitted skeleton (ASF/AMC) give the same walker.

The laboratory fitted the skeleton to these very markers, so the joints that our two mappings derive from
either must lie within a hand's breadth, and nearer where the mapping does more than take a marker as it is.
A wrong unit, axis, hand or rate in either reader would show as metres, or as left for right.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.formats import acclaim, c3d
from pipeline.skeleton import WALKER15
from pipeline.skeleton.mapped_joints import map_joints
from tests.formats.contract import source_mapping

MAPPINGS = ("plugin_gait", "cmu_41_markers", "walker15")

# Median distance over the frames in mm: what was measured (the worse side), plus a margin of about a quarter.
# Of the third such trial, 05_13, the mirror holds the markers only.
JOINTS = ("head", "sternum", "shoulder", "elbow", "wrist", "pelvis", "hip", "knee", "ankle")
MEASURED_MM = {
    "02_01": dict(zip(JOINTS, (43, 22, 32, 61, 52, 16, 19, 26, 11), strict=True)),
    "49_04": dict(zip(JOINTS, (56, 28, 20, 73, 66, 38, 41, 52, 46), strict=True)),
}


def turned_onto(moved: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, float]:
    """Return `moved` (T, J, 3) aligned with `target` by yaw and translation, and the yaw angle, radians."""
    observed = np.isfinite(moved).all(axis=-1) & np.isfinite(target).all(axis=-1)
    centre_m, centre_t = moved[observed].mean(axis=0), target[observed].mean(axis=0)
    m, t = (moved - centre_m)[observed][:, :2], (target - centre_t)[observed][:, :2]
    yaw = float(np.arctan2((m[:, 0] * t[:, 1] - m[:, 1] * t[:, 0]).sum(), (m * t).sum()))
    cos, sin = np.cos(yaw), np.sin(yaw)
    rotation = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    return (moved - centre_m) @ rotation.T + centre_t, yaw


def test_yaw_and_translation_are_found() -> None:
    points = np.random.default_rng(0).normal(size=(5, 4, 3))
    cos, sin = np.cos(0.7), np.sin(0.7)
    moved = points @ np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]).T + [5, -3, 2]
    points[1, 2] = np.nan
    turned, yaw = turned_onto(moved, points)
    np.testing.assert_allclose(yaw, -0.7)
    np.testing.assert_allclose(turned[2:], points[2:], atol=1e-12)


@pytest.mark.skipif(not os.environ.get("MOCAP_MIRROR"), reason="needs the recordings: set MOCAP_MIRROR")
@pytest.mark.parametrize("trial", MEASURED_MM)
def test_markers_and_skeleton_agree(trial: str) -> None:
    folder = Path(os.environ["MOCAP_MIRROR"]) / "cmu"
    markers = c3d.read(folder / "c3d" / f"{trial}.c3d")
    skeleton = acclaim.read(folder / trial[:2] / f"{trial}.amc")
    assert markers.frame_rate_hz == skeleton.frame_rate_hz == 120.0
    from_markers, _ = map_joints(markers, source_mapping("cmu_41_markers"))
    from_skeleton, _ = map_joints(skeleton, source_mapping("cmu_asf"))
    assert from_markers.shape == from_skeleton.shape  # frame by frame, nothing resampled
    turned, yaw = turned_onto(from_skeleton, from_markers)
    assert abs(np.degrees(yaw)) < 1.0  # both have the laboratory's axes
    residual = np.nanmedian(np.linalg.norm(turned - from_markers, axis=-1), axis=0)
    print(f"\n{trial}: yaw {np.degrees(yaw):.2f} deg, median residual in mm")
    for joint, value in zip(WALKER15.joints, residual, strict=True):
        print(f"  {joint:15s} {value:5.0f}")
        assert value < 1.25 * MEASURED_MM[trial][joint.split("_")[-1]] + 3, joint


@pytest.mark.parametrize("name", MAPPINGS)
def test_the_mappings_are_symmetric_and_complete(name: str) -> None:
    """Every mapping treats left and right alike, and gives every joint a rule with weights that sum to one."""
    mapping = source_mapping(name)
    assert mapping.name == name
    other = {joint: WALKER15.joints[m] for joint, m in zip(WALKER15.joints, WALKER15.mirror, strict=True)}

    def mirrored(point: str) -> str:
        swap = {"L": "R", "R": "L"}
        if name == "walker15":
            return other[point]
        return point if point in ("CLAV", "C7", "PELO", "HEDO", "SACR") else swap[point[0]] + point[1:]

    def ways(rules: Mapping[str, Any], joint: str) -> list[dict[str, float]]:
        """Return the alternative rules of a joint in their order of preference."""
        result = rules.get(joint, [])
        return [result] if isinstance(result, dict) else list(result)

    for joint in WALKER15.joints:
        result = [rule for rules in (mapping.joints, mapping.otherwise) for rule in ways(rules, joint)]
        assert result, joint
        for rule in result:
            assert sum(rule.values()) == pytest.approx(1)
    for rules in (mapping.joints, mapping.otherwise):
        for joint in rules:
            swapped = [
                {mirrored(point): weight for point, weight in rule.items()} for rule in ways(rules, joint)
            ]
            assert ways(rules, other[joint]) == swapped
    for joint, lowering in mapping.lowered.items():
        assert mapping.lowered[other[joint]] == lowering
        assert joint in mapping.otherwise


@pytest.mark.skipif(not os.environ.get("MOCAP_MIRROR"), reason="needs the recordings: set MOCAP_MIRROR")
def test_plug_in_gait_recordings_become_children() -> None:
    paths = sorted((Path(os.environ["MOCAP_MIRROR"]) / "biomechzoo").glob("*.c3d"))
    assert len(paths) == 16
    for path in paths:
        positions, valid = map_joints(c3d.read(path), source_mapping("plugin_gait"))
        assert valid.mean() > 0.95, path
        height = dict(zip(WALKER15.joints, np.nanmedian(positions[..., 2], axis=0), strict=True))
        assert 950 < height["head"] < 1700, path
        assert (
            height["head"] > height["sternum"] > height["pelvis"] > height["left_knee"] > height["left_ankle"]
        )
        for side in ("left", "right"):
            knee, hip, ankle = (WALKER15.index(f"{side}_{joint}") for joint in ("knee", "hip", "ankle"))
            for end in (hip, ankle):
                length = np.linalg.norm(positions[:, knee] - positions[:, end], axis=-1)
                assert 250 < np.nanmedian(length) < 450, path
                assert np.nanstd(length) < 15, path


@pytest.mark.skipif(not os.environ.get("MOCAP_MIRROR"), reason="needs the recordings: set MOCAP_MIRROR")
def test_the_markers_alone_come_near_the_model() -> None:
    """Joints from the fallback rules of plugin_gait lie at the documented distances from its model's joint centres."""
    mapping = source_mapping("plugin_gait")
    markers_only = source_mapping("plugin_gait")
    markers_only.joints = {joint: mapping.joints[joint] for joint in ("head", "sternum")}
    distances = []
    for path in sorted((Path(os.environ["MOCAP_MIRROR"]) / "biomechzoo").glob("*.c3d")):
        motion = c3d.read(path)
        # These children wear one marker on the sacrum in place of two on the PSIS.
        names = tuple({"SACR": "LPSI", "T2": "RPSI"}.get(name, name) for name in motion.names)
        positions = motion.positions_mm.copy()
        positions[:, names.index("RPSI")] = positions[:, names.index("LPSI")]
        both = type(motion)(**{**vars(motion), "names": names, "positions_mm": positions})
        distance = map_joints(both, markers_only)[0] - map_joints(motion, mapping)[0]
        distances.append(np.nanmedian(np.linalg.norm(distance, axis=-1), axis=0))
    median = dict(zip(WALKER15.joints, np.median(distances, axis=0), strict=True))
    stated = {"hip": 21, "knee": 9, "ankle": 10, "shoulder": 15, "elbow": 43, "wrist": 32}
    for joint, value in stated.items():
        for side in ("left", "right"):
            assert median[f"{side}_{joint}"] == pytest.approx(value, abs=1.6), joint
