"""Tests of the joints, of the mapping from recorded points to joints, and of its error messages."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pipeline.skeleton import WALKER15
from pipeline.skeleton.mapped_joints import LOWER_BODY, MappedPoints, map_joints
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import Lowering, SourceMapping, UpAxis
from tests.rejects import rejects

PAIR = ("pelvis", "left_knee")


def motion(names: tuple[str, ...], positions: object) -> MotionCapture:
    array = np.asarray(positions, dtype=float)
    return MotionCapture(
        names=names,
        positions_mm=array,
        valid=np.isfinite(array).all(axis=-1),
        frame_rate_hz=100.0,
        units="mm",
    )


def mapped(source: MotionCapture, rules: SourceMapping, *names: str) -> tuple[np.ndarray, np.ndarray]:
    """Return some joints and the frames in which they are valid; further leg joints are mapped to an unseen point."""
    unseen = np.full((len(source.valid), 1, 3), np.nan)
    whole = motion((*source.names, "REST"), np.concatenate([source.positions_mm, unseen], axis=1))
    rest = {joint: {"REST": 1.0} for joint in LOWER_BODY if joint not in names}
    positions, valid = map_joints(whole, dataclasses.replace(rules, joints={**rest, **rules.joints}))
    chosen = list(map(WALKER15.index, names))
    return positions[:, chosen], valid[:, chosen]


ONE_FRAME = motion(("A", "B"), [[[0.0, 0.0, 10.0], [2.0, 4.0, 30.0]]])
RULES = SourceMapping(name="test", joints={"pelvis": {"A": 1.0}, "left_knee": {"A": 0.5, "B": 0.5}})


def test_walker15_is_a_tree_whose_mirror_is_an_involution() -> None:
    assert len(WALKER15.joints) == 15
    assert [WALKER15.mirror[m] for m in WALKER15.mirror] == list(range(15))
    for joint, image in zip(WALKER15.joints, WALKER15.mirror, strict=True):
        swapped = joint.replace("left", "*").replace("right", "left").replace("*", "right")
        assert WALKER15.joints[image] == swapped
    for joint in range(15):  # every joint reaches the root, so there is no loop
        steps = 0
        while WALKER15.parents[joint] >= 0:
            joint, steps = WALKER15.parents[joint], steps + 1
            assert steps < 15
    assert len(WALKER15.bones) == 14


def test_weights_make_joints() -> None:
    positions, valid = mapped(ONE_FRAME, RULES, *PAIR)
    np.testing.assert_array_equal(positions[0], [[0, 0, 10], [1, 2, 20]])
    assert valid.all()


THREE = {"head": {"A": 1.0}, "left_wrist": {"B": 1.0}, "right_wrist": {"C": 1.0}}


@pytest.mark.parametrize(("up", "expected"), [("z", [1, 2, 3]), ("y", [3, 1, 2]), ("x", [2, 3, 1])])
def test_the_named_axis_comes_to_z_without_mirroring(up: str, expected: list[float]) -> None:
    source = motion(("A",), [[[1.0, 2.0, 3.0]]])
    positions, _ = mapped(
        source, SourceMapping(name="t", up=UpAxis(up), joints={"pelvis": {"A": 1.0}}), "pelvis"
    )
    np.testing.assert_array_equal(positions[0, 0], expected)
    axes = motion(("A", "B", "C"), np.eye(3)[None])
    rules = SourceMapping(name="t", up=UpAxis(up), joints=THREE)
    turned, _ = mapped(axes, rules, *THREE)
    assert np.linalg.det(turned[0]) == pytest.approx(1.0)


def test_the_fallback_rule_is_lowered_and_the_first_rule_is_not() -> None:
    rules = SourceMapping(
        name="t",
        joints={"pelvis": {"ORIGIN": 1.0}, "left_knee": {"A": 1.0}},
        otherwise={"pelvis": {"A": 1.0}},
        lowered={"pelvis": Lowering(by=0.5, between=["A", "B"])},
    )
    distance = np.sqrt(2.0**2 + 4.0**2 + 20.0**2)
    positions, _ = mapped(ONE_FRAME, rules, *PAIR)
    assert positions[0, 0, 2] == pytest.approx(10.0 - 0.5 * distance)
    with_origin = motion(("A", "B", "ORIGIN"), [[[0.0, 0, 10], [2.0, 4, 30], [7.0, 8, 9]]])
    positions, _ = mapped(with_origin, rules, *PAIR)
    np.testing.assert_array_equal(positions[0, 0], [7, 8, 9])


def test_a_joint_whose_lowering_lacks_a_point_is_missing() -> None:
    rules = SourceMapping(
        name="t",
        joints={"pelvis": {"A": 1.0}},
        otherwise={"left_knee": {"B": 1.0}},
        lowered={"left_knee": Lowering(by=0.5, between=["B", "C"])},
    )
    assert MappedPoints(ONE_FRAME, rules).rule_of("left_knee") is None
    with rejects("missing_point", joint="left_knee", point="C"):
        mapped(ONE_FRAME, rules, *PAIR)


def test_a_missing_sample_makes_its_joints_invalid_and_no_others() -> None:
    holed = motion(("A", "B"), [[[0.0, 0, 0], [np.nan, 1, 1]]])
    _, valid = mapped(holed, RULES, *PAIR)
    assert valid.tolist() == [[True, False]]


def test_names_match_without_case_and_without_a_subject_prefix() -> None:
    prefixed = motion(("anna:a", "anna:b"), ONE_FRAME.positions_mm)
    positions, _ = mapped(prefixed, RULES, *PAIR)
    np.testing.assert_array_equal(positions[0, 1], [1, 2, 20])


@pytest.mark.parametrize(
    ("source", "rules", "code", "values"),
    [
        (
            motion(("anna:A", "ben:A", "anna:B"), np.zeros((1, 3, 3))),
            RULES,
            "point_twice",
            {"point": "A", "count": 2},
        ),
        (
            motion(("A",), np.zeros((1, 1, 3))),
            RULES,
            "missing_point",
            {"joint": "left_knee", "point": "B"},
        ),
        (
            ONE_FRAME,
            dataclasses.replace(RULES, joints={"pelvis": {"A": 1.0}}),
            "no_rule",
            {"joint": "left_knee"},
        ),
    ],
)
def test_bad_mappings_are_refused_in_one_sentence(
    source: MotionCapture, rules: SourceMapping, code: str, values: dict[str, object]
) -> None:
    with rejects(code, **values) as caught:
        mapped(source, rules, *PAIR)
    assert "\n" not in str(caught.value)


def test_an_unknown_joint_is_refused_with_the_names_that_exist() -> None:
    with rejects("unknown_choice", "a joint of WALKER15", value="tail"):
        WALKER15.index("tail")


@pytest.mark.parametrize("up", ["x", "y", "z", "-x", "-y", "-z"])
def test_the_axis_from_ankles_to_hips_points_up_unless_the_mapping_says_which(up: str) -> None:
    standing = np.zeros((2, 7, 3))
    standing[:, :, "xyz".index(up[-1])] = [900, 900, 450, 50, 900, 450, 50]
    standing[:, 4:, "yzx".index(up[-1])] = 200
    source = motion(LOWER_BODY, -standing if up[0] == "-" else standing)
    rules = SourceMapping(name="t", joints={joint: {joint: 1.0} for joint in LOWER_BODY})
    positions, _ = mapped(source, rules, *LOWER_BODY)
    np.testing.assert_allclose(positions[0, :, 2], [900, 900, 450, 50, 900, 450, 50])
    message, _ = mapped(source, dataclasses.replace(rules, up=UpAxis(up)), *LOWER_BODY)
    np.testing.assert_array_equal(message, positions)
    axes = motion((*LOWER_BODY, "A", "B", "C"), np.concatenate([source.positions_mm[0], np.eye(3)])[None])
    turned, _ = mapped(axes, dataclasses.replace(rules, joints={**rules.joints, **THREE}), *THREE)
    assert np.linalg.det(turned[0]) == pytest.approx(1.0)  # turned, not mirrored


@pytest.mark.parametrize(
    "spelling",
    [
        "LANK",
        "lank",
        "L_ANK",
        "L.ANK",
        "l ank",
        "ANK_L",
        "anna:LANK",
        "anna:l-ank",
        "LeftANK",
        "Left Ank",
        "ankLeft",
    ],
)
def test_a_side_case_separators_and_prefix_do_not_matter(spelling: str) -> None:
    rules = SourceMapping(name="t", joints={"left_ankle": {"LANK": 1.0}})
    source = motion((spelling, "RANK", "BLANK"), np.arange(9.0).reshape(1, 3, 3))
    np.testing.assert_array_equal(mapped(source, rules, "left_ankle")[0][0, 0], [0, 1, 2])


@pytest.mark.parametrize("spelled", ["mixamorig{}", "CC_Base_{}", "x_{}", "{}_JNT", "{}-Joint-Posi"])
def test_a_beginning_or_end_that_most_points_share_does_not_matter(spelled: str) -> None:
    words = ("Hips", "Spine", "Neck", "LeftUpLeg", "LeftLeg", "LeftFoot", "Head")
    names = ("Armature", *map(spelled.format, words))
    rules = SourceMapping(name="t", joints={"pelvis": {"LeftUpLeg": 1.0}})
    positions, _ = mapped(motion(names, np.arange(24.0).reshape(1, 8, 3)), rules, "pelvis")
    np.testing.assert_array_equal(positions[0, 0], [12, 13, 14])


def test_of_doubled_labels_the_one_that_was_seen_counts_and_two_people_are_refused() -> None:
    rules = SourceMapping(name="t", joints={"pelvis": {"A": 1.0}})
    unseen = motion(("A", "A"), [[[np.nan] * 3, [1.0, 2, 3]]])
    np.testing.assert_array_equal(mapped(unseen, rules, "pelvis")[0][0, 0], [1, 2, 3])
    twice = motion(("A", "A"), [[[1.0, 2, 3], [1.0, 2, 3]]])
    np.testing.assert_array_equal(mapped(twice, rules, "pelvis")[0][0, 0], [1, 2, 3])
    with rejects("point_twice", point="A", count=2):
        mapped(motion(("A", "A"), [[[1.0, 2, 3], [9.0, 2, 3]]]), rules, "pelvis")


def test_the_first_rule_whose_points_were_seen_is_used() -> None:
    rules = SourceMapping(name="t", joints={"pelvis": [{"A": 1.0}, {"B": 1.0}]}, points={"B": ["HIP_B"]})
    source = motion(("A", "hip b"), [[[np.nan] * 3, [1.0, 2, 3]]])
    np.testing.assert_array_equal(mapped(source, rules, "pelvis")[0][0, 0], [1, 2, 3])


def test_joints_above_the_legs_may_be_missing() -> None:
    rules = SourceMapping(name="t", joints={joint: {joint: 1.0} for joint in WALKER15.joints})
    names = tuple(joint for joint in WALKER15.joints if joint != "head")
    source = motion(names, np.ones((2, 14, 3)))
    positions, valid = map_joints(source, rules)
    assert not valid[:, 0].any()
    assert valid[:, 1:].all()
    assert np.isnan(positions[:, 0]).all()
    legless = motion(names[:-1], np.ones((2, 13, 3)))
    with rejects("missing_point", joint="right_ankle"):
        map_joints(legless, rules)
