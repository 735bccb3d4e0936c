"""Tests of the point sets of other programs: the points from which each joint is computed."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline import mappings
from pipeline.skeleton.mapped_joints import MappedPoints, bare_names
from pipeline.skeleton.recorded import MotionCapture

_XSENS_64 = """\
pHipOrigin pRightASI pLeftASI pRightCSI pLeftCSI pRightIschialTub pLeftIschialTub pSacrum pL5SpinalProcess
pL3SpinalProcess pT12SpinalProcess pPX pIJ pT4SpinalProcess pT8SpinalProcess pC7SpinalProcess pTopOfHead
pRightAuricularis pLeftAuricularis pBackOfHead pRightAcromion pLeftAcromion pRightArmLatEpicondyle
pRightArmMedEpicondyle pLeftArmLatEpicondyle pLeftArmMedEpicondyle pRightUlnarStyloid pRightRadialStyloid
pRightOlecranon pLeftUlnarStyloid pLeftRadialStyloid pLeftOlecranon pRightTopOfHand pRightPinky pRightBallHand
pLeftTopOfHand pLeftPinky pLeftBallHand pRightGreaterTrochanter pRightKneeLatEpicondyle pRightKneeMedEpicondyle
pRightMiddleKneeCap pLeftGreaterTrochanter pLeftKneeLatEpicondyle pLeftKneeMedEpicondyle pLeftMiddleKneeCap
pRightLatMalleolus pRightMedMalleolus pRightTibialTub pLeftLatMalleolus pLeftMedMalleolus pLeftTibialTub
pRightHeelFoot pRightFirstMetatarsal pRightFifthMetatarsal pRightPivotFoot pRightHeelCenter pRightToe pLeftHeelFoot
pLeftFirstMetatarsal pLeftFifthMetatarsal pLeftPivotFoot pLeftHeelCenter pLeftToe"""
_XSENS_34 = """\
pHipOrigin pRightASI pLeftASI pSacrum pPX pIJ pC7SpinalProcess pTopOfHead pRightAuricularis pLeftAuricularis
pRightAcromion pLeftAcromion pRightArmLateralEpicondyle pRightArmMedialEpicondyle pLeftArmLateralEpicondyle
pLeftArmMedialEpicondyle pRightWristLateral pRightWristMedial pLeftWristLateral pLeftWristMedial
pRightGreaterTrochanter pRightKneeLatEpicondyle pRightKneeMedEpicondyle pLeftGreaterTrochanter
pLeftKneeLatEpicondyle pLeftKneeMedEpicondyle pRightLatMalleolus pRightMedMalleolus pLeftLatMalleolus
pLeftMedMalleolus pRightHeelFoot pRightToe pLeftHeelFoot pLeftToe"""
_MOCAP_TOOLBOX = """\
Head_FL Head_FR Head_BL Head_BR Shoulder_L Shoulder_R Spine_upper Sternum Elbow_L Elbow_R Wrist_L Wrist_R Finger_L
Finger_R Hip_FL Hip_FR Hip_BL Hip_BR Knee_L Knee_R Ankle_L Ankle_R Heel_L Heel_R Toe_L Toe_R"""
_HUMAN_IK = """\
Spine Spine1 Neck Head LeftShoulder LeftArm LeftForeArm LeftHand RightShoulder RightArm RightForeArm RightHand
LeftUpLeg LeftLeg LeftFoot RightUpLeg RightLeg RightFoot"""
_XSENS, _FEWER, _TOOLBOX, _BODY = (
    names.split() for names in (_XSENS_64, _XSENS_34, _MOCAP_TOOLBOX, _HUMAN_IK)
)
_CENTRES = [f"{side}{joint}" for joint in ("FEP", "FEO", "TIO", "CLO", "HUO", "RAO") for side in "LR"]


def behind(names: list[str], joint: str) -> set[str]:
    """Return the names of the points that define a joint in the best mapping of the package."""
    positions = np.random.default_rng(1).normal(0.0, 300.0, (2, len(names), 3))
    motion = MotionCapture(tuple(names), positions, np.ones(positions.shape[:2], bool), 100.0, "mm")
    fit = mappings.suggest(motion, list(mappings.shipped().values()))
    assert fit.usable, f"{fit.mapping.name} lacks {fit.lacking}"
    return {names[k] for k in MappedPoints(motion, fit.mapping).weights(joint)}


@pytest.mark.parametrize(
    ("names", "joint", "points"),
    [
        (_XSENS, "left_knee", "pLeftKneeLatEpicondyle pLeftKneeMedEpicondyle"),
        (_XSENS, "right_ankle", "pRightLatMalleolus pRightMedMalleolus"),
        (_XSENS, "left_hip", "pLeftASI pRightASI pSacrum"),
        (_XSENS, "right_elbow", "pRightArmLatEpicondyle pRightArmMedEpicondyle"),
        (_XSENS, "left_wrist", "pLeftRadialStyloid pLeftUlnarStyloid"),
        (_XSENS, "head", "pLeftAuricularis pRightAuricularis"),
        (_XSENS, "sternum", "pIJ pC7SpinalProcess"),
        (_FEWER, "left_elbow", "pLeftArmLateralEpicondyle pLeftArmMedialEpicondyle"),
        (_FEWER, "right_wrist", "pRightWristLateral pRightWristMedial"),
        (_FEWER, "right_knee", "pRightKneeLatEpicondyle pRightKneeMedEpicondyle"),
        (_TOOLBOX, "pelvis", "Hip_FL Hip_FR Hip_BL Hip_BR"),
        (_TOOLBOX, "left_hip", "Hip_FL Hip_FR Hip_BL Hip_BR"),
        (_TOOLBOX, "head", "Head_FL Head_FR Head_BL Head_BR"),
        (_TOOLBOX, "right_knee", "Knee_R Hip_FL Hip_FR"),
        (_TOOLBOX, "left_shoulder", "Shoulder_L"),
        (_CENTRES, "pelvis", "LFEP RFEP"),
        (_CENTRES, "left_ankle", "LTIO"),
        (["Hips", *(f"Character1_{name}" for name in _BODY)], "left_knee", "Character1_LeftLeg"),
        (
            [f"prop{k}" for k in range(20)] + [f"Character1_{name}" for name in ("Hips", *_BODY)],
            "right_hip",
            "Character1_RightUpLeg",
        ),
    ],
)
def test_joints_come_from_these_points(names: list[str], joint: str, points: str) -> None:
    assert behind(names, joint) == set(points.split())


def test_a_side_is_not_a_prefix() -> None:
    names = [f"{side}_{part}" for side in ("Left", "Right") for part in "abcdefghij"]
    assert bare_names(names) == names
