"""Tests of proposed mappings, which find joints by the positions of points if their names do not help."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline import mappings
from pipeline.core import walking
from pipeline.ingestion.nearest_joints import propose
from pipeline.skeleton import WALKER15
from pipeline.skeleton.mapped_joints import map_joints
from pipeline.skeleton.recorded import MotionCapture
from pipeline.synthetic import walkers

HZ = 40.0
LIMBS = [joint for joint in WALKER15.joints if "_" in joint]


@pytest.fixture(scope="module")
def people() -> np.ndarray:
    """Walks (4, T, 15, 3), mm, of people who do not contribute to the average walker."""
    output = walkers.walking_population(
        np.random.default_rng(5), male=2, female=2, duration_s=3.0, frame_rate_hz=HZ
    )
    return np.asarray(output.positions_mm)


def recorded(names: list[str], positions: np.ndarray) -> MotionCapture:
    valid = np.isfinite(positions).all(axis=-1)
    return MotionCapture(tuple(names), positions, valid, HZ, "mm")


def found(motion: MotionCapture) -> dict[str, list[str]]:
    """Return the points of each joint in the proposed mapping."""
    mapping = propose(motion, "my_lab")
    assert set(mapping.guessed) == set(mapping.joints)
    return {joint: list(rule) for joint, rule in mapping.joints.items()}


@settings(max_examples=4, deadline=None)
@given(
    person=st.integers(0, 3),
    order=st.permutations(range(15)),
    turn=st.floats(-np.pi, np.pi),
    size=st.floats(0.5, 1.3),
    up=st.integers(0, 2),
)
def test_points_without_names_in_any_order_are_told_by_where_they_are(
    people: np.ndarray, person: int, order: list[int], turn: float, size: float, up: int
) -> None:
    positions = size * walking.turn_about_vertical(people[person], turn)[:, order]
    motion = recorded([f"M{k}" for k in range(15)], np.roll(positions, up + 1, axis=-1))
    reference = {joint: [f"M{order.index(j)}"] for j, joint in enumerate(WALKER15.joints)}
    described = found(motion)
    assert {joint: described.get(joint) for joint in LIMBS} == {joint: reference[joint] for joint in LIMBS}
    assert described["head"] == reference["head"]


@settings(max_examples=4, deadline=None)
@given(person=st.integers(0, 3), order=st.permutations(range(15)), turn=st.floats(-np.pi, np.pi))
def test_sides_alone_are_enough(people: np.ndarray, person: int, order: list[int], turn: float) -> None:
    numbers = {
        joint.partition("_")[2]: k for k, joint in enumerate(reversed(WALKER15.joints)) if "_" in joint
    }
    renamed = {
        joint: f"{joint[0].upper()}.{numbers[joint.partition('_')[2]]}" if "_" in joint else f"M{k}"
        for k, joint in enumerate(WALKER15.joints)
    }
    positions = walking.turn_about_vertical(people[person], turn)[:, order]
    described = found(recorded([renamed[WALKER15.joints[j]] for j in order], positions))
    assert {joint: described.get(joint) for joint in LIMBS} == {joint: [renamed[joint]] for joint in LIMBS}


def test_legs_alone_are_not_taken_for_a_whole_body(people: np.ndarray) -> None:
    """In a recording of the legs only, the hips are not proposed as the head, although they are the highest points."""
    legs = range(8, 15)
    names = ["M", "L_a", "L_b", "L_c", "R_a", "R_b", "R_c"]
    described = found(recorded(names, people[0][:, list(legs)]))
    assert {joint: points for joint, points in described.items() if "_" in joint} == {
        WALKER15.joints[j]: [name] for j, name in list(zip(legs, names, strict=True))[1:]
    }


def test_a_marker_that_is_called_after_a_segment_is_a_joint_at_its_upper_end_alone(
    people: np.ndarray,
) -> None:
    """A marker named after the shank but placed at mid-shank is not proposed as the knee."""
    names = [joint.replace("knee", "m") for joint in WALKER15.joints]
    shanks = (people[1][:, [10, 13]] + people[1][:, [11, 14]]) / 2
    motion = recorded([*names, "left_shank", "right_shank"], np.concatenate([people[1], shanks], axis=1))
    described = found(motion)
    assert (described["left_knee"], described["right_knee"]) == (["left_m"], ["right_m"])


def test_a_name_that_lies_far_from_its_joint_is_not_believed(people: np.ndarray) -> None:
    """A point named as a knee but far in front of the body is not proposed as the knee."""
    names = [joint.replace("knee", "m") for joint in WALKER15.joints]
    astray = np.stack([people[1][:, 8] + [side, 900.0, 100.0] for side in (-100.0, 100.0)], axis=1)
    motion = recorded([*names, "left_knee", "right_knee"], np.concatenate([people[1], astray], axis=1))
    described = found(motion)
    assert (described["left_knee"], described["right_knee"]) == (["left_m"], ["right_m"])
    assert described["left_hip"] == ["left_hip"]


def xsens(person: np.ndarray, *more: str) -> MotionCapture:
    """Return the bony landmarks of an Xsens C3D file for the joints (T, 15, 3) of a walker who faces +y."""
    right, forward, up = np.eye(3)
    joints = dict(zip(WALKER15.joints, np.moveaxis(person, 1, 0), strict=True))
    points = {"pHipOrigin": joints["pelvis"]}
    for side, out in (("Right", right), ("Left", -right)):
        hip, knee, ankle = (joints[f"{side.lower()}_{part}"] for part in ("hip", "knee", "ankle"))
        points[f"p{side}ASI"] = joints["pelvis"] + 120.0 * out + 60.0 * forward + 80.0 * up
        points[f"p{side}GreaterTrochanter"] = hip + 70.0 * out
        points[f"p{side}KneeLatEpicondyle"] = knee + 50.0 * out
        points[f"p{side}KneeMedEpicondyle"] = knee - 50.0 * out
        points[f"p{side}LatMalleolus"] = ankle + 35.0 * out
        points[f"p{side}MedMalleolus"] = ankle - 35.0 * out
        points[f"p{side}PSI"] = joints["pelvis"] + 50.0 * out - 100.0 * forward + 80.0 * up
    points["pSacrum"] = joints["pelvis"] - 100.0 * forward + 80.0 * up
    names = [name for name in points if not name.endswith(("PSI", "Sacrum")) or name in more]
    return recorded(names, np.stack([points[name] for name in names], axis=1))


TROCHANTERS = {"pLeftGreaterTrochanter": 0.75, "pRightGreaterTrochanter": 0.25}


@pytest.mark.parametrize(
    ("more", "left_hip", "lowered"),
    [
        ((), TROCHANTERS, 0.0),
        (("pLeftPSI",), TROCHANTERS, 0.0),
        (("pSacrum",), {"pLeftASI": 0.71, "pRightASI": -0.01, "pSacrum": 0.3}, 0.345),
        (
            ("pLeftPSI", "pRightPSI"),
            {"pLeftASI": 0.71, "pRightASI": -0.01, "pLeftPSI": 0.15, "pRightPSI": 0.15},
            0.345,
        ),
    ],
)
def test_bony_landmarks_become_the_middles_of_joints_and_hips_by_a_regression(
    people: np.ndarray, tmp_path: Path, more: tuple[str, ...], left_hip: dict[str, float], lowered: float
) -> None:
    person = people[1]
    motion = xsens(person, *more)
    path = tmp_path / "my_lab.yaml"
    path.write_text(mappings.written(propose(motion, "my_lab"), motion), "utf-8")
    mapping = mappings.load(path)
    assert mapping.rules("left_hip")[0][0] == left_hip
    assert mapping.lowered["left_hip"].by == lowered
    assert mappings.check(motion, mapping) == []
    assert set(mapping.guessed) == {joint for joint in WALKER15.joints if mapping.rules(joint)}
    positions, _ = map_joints(motion, mapping)
    legs = [joint for joint in LIMBS if joint.endswith(("knee", "ankle"))]
    for joint in legs:
        np.testing.assert_allclose(
            positions[:, WALKER15.index(joint)], person[:, WALKER15.index(joint)], atol=1e-9
        )
    pelvis = person[:, WALKER15.index("pelvis")]
    for side, sign in (("left", -1.0), ("right", 1.0)):
        hip = positions[:, WALKER15.index(f"{side}_hip")]
        if (
            lowered
        ):  # 240 mm between the ASIS: .72 of half of it out, 34.5 % of it below, 30 % of 160 mm behind
            np.testing.assert_allclose(
                hip - pelvis, np.tile([sign * 86.4, 12.0, 80.0 - 82.8], (len(hip), 1)), atol=1e-9
            )
        else:
            wide = person[:, [9, 12], 0].mean(axis=1)
            half = (np.diff(person[:, [9, 12], 0])[:, 0] / 2.0 + 70.0) / 2.0
            np.testing.assert_allclose(hip[:, 0], wide + sign * half, atol=1e-9)


def test_no_hip_is_proposed_from_the_centre_of_the_pelvis_alone(people: np.ndarray) -> None:
    motion = xsens(people[0])
    retained = [k for k, name in enumerate(motion.names) if "Trochanter" not in name and "ASI" not in name]
    names = [motion.names[k] for k in retained] + ["pTop", "pIJ"]
    more = [people[0][:, [j]] for j in (0, 1)]
    motion = recorded(names, np.concatenate([motion.positions_mm[:, retained], *more], axis=1))
    mapping = propose(motion, "my_lab")
    assert mappings.check(motion, mapping) == []
    assert not {"left_hip", "right_hip"} & mapping.joints.keys()
