"""Tests of the anatomical check of mappings: wrong rules are reported, and the package's mappings are correct."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import pipeline
from pipeline import mappings
from pipeline.cli.inspect import inspect
from pipeline.clips.kinds import VARIED, WALKS
from pipeline.clips.options import Skeleton
from pipeline.formats.points import trc
from pipeline.ingestion.data import FolderData
from pipeline.skeleton import WALKER15
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import Rule, SourceMapping
from pipeline.synthetic.walkers import walking_population

XSENS = ["pHipOrigin", "pSacrum"] + [
    f"p{side}{part}"
    for side in ("Right", "Left")
    for part in (
        "ASI", "GreaterTrochanter", "KneeLatEpicondyle", "KneeMedEpicondyle", "LatMalleolus", "MedMalleolus",
    )
]  # fmt: skip
LEGS: dict[str, Rule] = {
    f"{side}_{part}": {f"p{side.title()}Lat{end}" if part == "ankle" else f"p{side.title()}{end}": 1.0}
    for side in ("left", "right")
    for part, end in (("hip", "GreaterTrochanter"), ("knee", "KneeLatEpicondyle"), ("ankle", "Malleolus"))
}


def named(names: list[str]) -> MotionCapture:
    """Return a recording of named points whose coordinates are all zero."""
    return MotionCapture(
        tuple(names), np.zeros((2, len(names), 3)), np.ones((2, len(names)), bool), 100.0, "mm"
    )


def codes_and_joints(names: list[str], **rules: Rule) -> list[tuple[str, tuple[str, ...]]]:
    """Return code and joints of each complaint about a mapping, with legs by trochanters unless a rule differs."""
    mapping = SourceMapping(name="lab", joints=LEGS | rules)
    return [(complaint.code, complaint.where) for complaint in mappings.check(named(names), mapping)]


def test_legs_by_the_same_rule_on_both_sides_are_right() -> None:
    assert codes_and_joints(XSENS) == []
    middle: dict[str, Rule] = {
        f"{side}_knee": {f"p{side.title()}Knee{at}Epicondyle": 0.5 for at in ("Lat", "Med")}
        for side in ("left", "right")
    }
    assert codes_and_joints(XSENS, **middle) == []


@pytest.mark.parametrize(
    ("rules", "complaints"),
    [
        ({"left_knee": {"pLeftKneeMedEpicondyle": 1.0}}, [("side_rules", ("left_knee", "right_knee"))]),
        (
            {"left_knee": {"pLeftKneeMedEpicondyle": 0.5, "pLeftKneeLatEpicondyle": 0.5}},
            [("side_rules", ("left_knee", "right_knee"))],
        ),
        (
            {"left_hip": {"pHipOrigin": 1.0}},
            [("side_rules", ("left_hip", "right_hip")), ("centre_hip", ("left_hip",))],
        ),
        (
            {
                side: {"pLeftGreaterTrochanter": 0.5, "pRightGreaterTrochanter": 0.5}
                for side in ("left_hip", "right_hip")
            },
            [
                ("centre_hip", ("left_hip",)),
                ("centre_hip", ("right_hip",)),
                ("shared_point", ("left_hip", "right_hip")),
            ],
        ),
        (
            {"left_hip": {"pLeftASI": 1.0}, "right_hip": {"pRightASI": 1.0}},
            [("asis_hip", ("left_hip",)), ("asis_hip", ("right_hip",))],
        ),
        (
            {"left_ankle": {"pRightLatMalleolus": 1.0}},
            [("side_rules", ("left_ankle", "right_ankle")), ("shared_point", ("left_ankle", "right_ankle"))],
        ),
        (
            {"right_ankle": {"pLeftKneeLatEpicondyle": 1.0}},
            [("side_rules", ("left_ankle", "right_ankle")), ("shared_point", ("left_knee", "right_ankle"))],
        ),
    ],
)
def test_rules_that_no_person_fits_are_named(
    rules: dict[str, Rule], complaints: list[tuple[str, tuple[str, ...]]]
) -> None:
    assert codes_and_joints(XSENS, **rules) == complaints


def test_a_marker_of_the_pelvis_is_a_hip_where_no_regression_is_possible() -> None:
    without = [name for name in XSENS if name != "pSacrum"]
    asis: dict[str, Rule] = {"left_hip": {"pLeftASI": 1.0}, "right_hip": {"pRightASI": 1.0}}
    assert codes_and_joints(without, **asis) == []
    assert codes_and_joints([*without, "pLeftPSI", "pRightPSI"], **asis) != []


def test_a_sentence_names_joint_and_rule_and_is_short() -> None:
    mapping = SourceMapping(name="lab", joints=LEGS | {"left_knee": {"pLeftKneeMedEpicondyle": 1.0}})
    (complaint,) = mappings.check(named(XSENS), mapping)
    assert complaint.sentence == (
        "left_knee (1 pLeftKneeMedEpicondyle) and right_knee (1 pRightKneeLatEpicondyle) follow different rules:"
        " map both alike"
    )
    assert not complaint.rejects


def test_a_users_mapping_gets_a_remark_wherever_it_is_used(tmp_path: Path) -> None:
    person = walking_population(
        np.random.default_rng(3), male=1, female=0, duration_s=4.0, frame_rate_hz=60.0
    )
    joints = np.asarray(person.positions_mm[0])
    medial = joints[:, [WALKER15.index("left_knee")]] + [5.0, 0.0, 0.0]
    trc.write(
        tmp_path / "a.trc",
        [*WALKER15.joints, "left_knee_medial"],
        np.concatenate([joints, medial], axis=1),
        60.0,
    )
    reference = {joint: {joint: 1.0} for joint in WALKER15.joints} | {"left_knee": {"left_knee_medial": 1.0}}
    lines = [f"  {joint}: {{{point}: 1.0}}" for joint, rule in reference.items() for point in rule]
    (tmp_path / "lab.yaml").write_text("joints:\n" + "\n".join(lines) + "\n", "utf-8")
    remark = (
        "left_knee (1 left_knee_medial) and right_knee (1 right_knee) follow different rules: map both alike"
    )
    skeleton = str(tmp_path / "lab.yaml")
    with pytest.warns(UserWarning, match=re.escape(remark)):
        pipeline.represent(tmp_path / "a.trc", skeleton)
    with pytest.warns(UserWarning, match=re.escape(remark)):
        pipeline.joints(pipeline.read(tmp_path / "a.trc"), skeleton)
    (result,) = inspect([str(tmp_path / "a.trc"), f"skeleton={skeleton}"])
    assert remark in result.lines
    data = FolderData(name="folder", path=str(tmp_path), pattern="*.trc")
    for corpus in (WALKS, VARIED):
        (row,) = data.request(corpus, Skeleton(mapping=skeleton), 1, 1).make().report
        assert remark in row["reason"]


def test_points_whose_names_tell_no_side_are_compared_by_weights_alone() -> None:
    names = [f"M{k}" for k in range(15)]
    joints: dict[str, Rule] = {joint: {name: 1.0} for joint, name in zip(WALKER15.joints, names, strict=True)}
    numbered = SourceMapping(name="lab", joints=joints)
    assert mappings.check(named(names), numbered) == []
    numbered.joints = joints | {"left_knee": {"M1": 0.5, "M10": 0.5}}
    assert [complaint.code for complaint in mappings.check(named(names), numbered)] == ["side_rules"]


@pytest.mark.parametrize("family", sorted(mappings.shipped()))
def test_mappings_that_ship_fit_a_person(family: str) -> None:
    mapping = mappings.shipped()[family]
    points = {
        point: None
        for joint in WALKER15.joints
        for rule, lowering in mapping.rules(joint)
        for point in (*rule, *(lowering.between if lowering else ()))
    }
    assert mappings.check(named([*points]), mapping) == []
