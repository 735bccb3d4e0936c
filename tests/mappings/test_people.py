"""Tests of several people in one recording: they are separated by name, and one of them is selected."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from pipeline import formats
from pipeline.formats.points import csv, trc
from pipeline.ingestion.joints import joints_of
from pipeline.mappings import of_one_person, people, shipped
from pipeline.skeleton import WALKER15
from pipeline.skeleton.recorded import MotionCapture
from tests.formats.contract import check_contract, recording
from tests.rejects import rejects
from walk3d.export.bvh import write as write_bvh
from walk3d.export.c3d import write as write_c3d

JOINTS = WALKER15.joints
STANDING = np.array(
    [
        [0, 0, 1600], [0, 0, 1400], [-200, 0, 1400], [-220, 0, 1100], [-230, 0, 850], [200, 0, 1400], [220, 0, 1100],
        [230, 0, 850], [0, 0, 950], [-100, 0, 900], [-100, 0, 500], [-100, 0, 100], [100, 0, 900], [100, 0, 500],
        [100, 0, 100],
    ],
    dtype=float,
)  # fmt: skip
FIRST = STANDING + np.arange(4)[:, None, None] * [0, 10, 0]
SECOND = FIRST + np.array([1000.0, 0, 0])
BOTH = np.concatenate([FIRST, SECOND], axis=1)


def two(named: Callable[[str, str], str], who: Sequence[str] = ("anna", "ben")) -> MotionCapture:
    """Return a recording of two people next to each other, with point names from a function."""
    return recording(tuple(named(first, joint) for first in who for joint in JOINTS), BOTH)


@pytest.mark.parametrize(
    "named",
    [
        lambda who, joint: f"{who}:{joint}",
        lambda who, joint: f"{who}_{joint}",
        lambda who, joint: f"{who}.{joint}",
        lambda who, joint: f"{who} {joint}",
        lambda who, joint: f"subject {who}:{joint}",
    ],
)
def test_people_are_told_apart_by_what_names_begin_with(named: Callable[[str, str], str]) -> None:
    motion = two(named)
    first, second = people(motion, shipped().values())
    assert (first.split()[-1], second.split()[-1]) == ("anna", "ben")
    with rejects("several_people", people=[first, second], subject=""):
        joints_of(motion, None)
    with rejects("several_people", subject="carla"):
        joints_of(motion, None, "carla")
    for chosen, expected in ((first, FIRST), (second.upper(), SECOND), ("2", SECOND)):
        read, positions, _ = joints_of(motion, None, chosen)
        np.testing.assert_array_equal(positions, expected)
        assert any("2 people" in note for note in read.notes)
        check_contract(of_one_person(motion, shipped().values(), chosen))


def test_somebody_without_a_beginning_beside_somebody_with_one() -> None:
    motion = two(lambda who, joint: joint if who == "anna" else f"B_{joint}")
    assert list(people(motion, shipped().values())) == ["B", "unnamed"]
    np.testing.assert_array_equal(joints_of(motion, None, "unnamed")[1], FIRST)


@pytest.mark.parametrize("ending", ["_2", "2", "-2", " (2)", ".2"])
def test_somebody_whose_names_end_with_a_number(ending: str) -> None:
    motion = two(lambda who, joint: joint if who == "anna" else joint + ending)
    assert list(people(motion, shipped().values())) == ["2", "unnamed"]
    np.testing.assert_array_equal(joints_of(motion, None, "unnamed")[1], FIRST)
    np.testing.assert_array_equal(joints_of(motion, None, "2")[1], SECOND)


def test_people_whose_names_end_with_theirs() -> None:
    motion = two(lambda who, joint: f"{joint}_{who}")
    assert list(people(motion, shipped().values())) == ["anna", "ben"]
    np.testing.assert_array_equal(joints_of(motion, None, "ben")[1], SECOND)


def test_raw_and_filtered_points_are_one_person() -> None:
    names = (*JOINTS, *(f"{joint}_raw" for joint in JOINTS))
    motion = recording(names, np.concatenate([FIRST, FIRST + 3.0], axis=1))
    assert people(motion, shipped().values()) == {}


def test_names_that_stand_once_for_each_person() -> None:
    motion = two(lambda _, joint: joint)
    np.testing.assert_array_equal(joints_of(motion, None, "2")[1], SECOND)
    with rejects("several_people", people=["1", "2"]):
        joints_of(motion, None)


@pytest.mark.parametrize(
    "named", [lambda joint: joint, lambda joint: f"anna:{joint}", lambda joint: joint.replace("left", "L")]
)
def test_one_person_is_one_person(named: Callable[[str], str]) -> None:
    motion = recording(tuple(map(named, JOINTS)), FIRST)
    assert people(motion, shipped().values()) == {}
    read, positions, _ = joints_of(motion, None, "anna")
    np.testing.assert_array_equal(positions, FIRST)
    assert any("has one person" in note for note in read.notes)


def test_objects_beside_a_person_are_nobody() -> None:
    names = (*(f"anna:{joint}" for joint in JOINTS), *(f"ball:{k}" for k in range(15)))
    assert people(recording(names, BOTH), shipped().values()) == {}


def test_nothing_measured_is_said() -> None:
    with rejects("nothing_measured"):
        joints_of(recording(JOINTS, np.full_like(FIRST, np.nan)), None)


@pytest.mark.parametrize(
    "name", ["a.c3d", "a.trc", "a.bvh", "a.csv", "wide.csv", "person.csv", "same.bvh", "a.mvnx"]
)
def test_files_of_two_people(name: str, tmp_path: Path) -> None:
    path, who = tmp_path / name, ("anna", "ben")
    names = [f"{first}:{joint}" for first in who for joint in JOINTS]
    parents = [parent + shift if parent >= 0 else -1 for shift in (0, 15) for parent in WALKER15.parents]
    if name == "a.c3d":
        write_c3d(path, names, BOTH, 50.0)
    elif name == "a.trc":
        trc.write(path, names, BOTH, 50.0)
    elif name == "wide.csv":
        csv.write(path, names, BOTH, 50.0, wide=True)
    elif name.endswith(".bvh"):
        write_bvh(path, names, BOTH, 50.0, parents)
        if name == "same.bvh":
            path.write_text(path.read_text().replace("anna:", "").replace("ben:", ""))
            who = ("1", "2")
    elif name == "a.mvnx":
        path.write_text(xsens(who))
    else:
        csv.write(path, names, BOTH, 50.0)
        if name == "person.csv":
            text = path.read_text().replace("joint,", "person,joint,")
            path.write_text(text.replace("anna:", "anna,").replace("ben:", "ben,"))
    motion = formats.read(path)
    check_contract(motion)
    assert tuple(people(motion, shipped().values())) == who
    positions = joints_of(motion, None, who[1])[1]
    expected = SECOND if name != "a.mvnx" else SECOND[:, 9:]
    np.testing.assert_allclose(positions[:, 15 - expected.shape[1] :], expected, atol=1e-3)


def xsens(who: Sequence[str]) -> str:
    """Return the text of an MVNX file of two subjects, with legs and two vertebrae."""
    segments = {
        "LeftUpperLeg": 9, "LeftLowerLeg": 10, "LeftFoot": 11, "RightUpperLeg": 12, "RightLowerLeg": 13,
        "RightFoot": 14, "Pelvis": 8, "L5": 8, "T8": 1,
    }  # fmt: skip
    subjects = ""
    for first, positions in zip(who, (FIRST, SECOND), strict=True):
        listed = "".join(f'<segment label="{name}"/>' for name in segments)
        frames = "".join(
            f'<frame type="normal"><position>{" ".join(map(str, posture.ravel()))}</position></frame>'
            for posture in positions[:, list(segments.values())] / 1000
        )
        inside = f"<segments>{listed}</segments><frames>{frames}</frames>"
        subjects += f'<subject label="{first}" frameRate="50">{inside}</subject>'
    return f"<mvnx>{subjects}</mvnx>"


def test_keypoints_and_markers_of_one_person_are_one() -> None:
    keypoints = ("RHip", "RKnee", "RAnkle", "LHip", "LKnee", "LAnkle", "Neck")
    markers = [
        side + f"{point}_study"
        for side in ("r", "L")
        for point in (".ASIS", ".PSIS", "_knee", "_mknee", "_ankle", "_mankle")
    ]
    places = FIRST[:, [12, 13, 14, 9, 10, 11, 1, 12, 12, 13, 13, 14, 14, 9, 9, 10, 10, 11, 11]]
    motion = recording((*keypoints, *markers), places + np.arange(19)[:, None] * [0, 0, 1.0])
    assert people(motion, shipped().values()) == {}
    distance = places + 1000.0 * (np.arange(19) >= 7)[:, None]
    assert len(people(recording(motion.names, distance), shipped().values())) == 2
