"""Tests of the body check with synthetic people who have one fault each, and with altered recordings of real people."""

from __future__ import annotations

import csv
import os
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pipeline import formats, mappings
from pipeline.core import walking
from pipeline.ingestion.joints import joints_of
from pipeline.skeleton import WALKER15
from pipeline.skeleton.body import accepted, check
from pipeline.skeleton.complaint import Complaint
from pipeline.skeleton.source_mapping import UpAxis
from pipeline.skeleton.upright import axis_up
from pipeline.synthetic.bending import bending_performances
from pipeline.validation import InvalidInput
from tests.core.walks import RATE_HZ, STRIDE_HZ, overground
from tests.rejects import rejects

ROOT = Path(__file__).resolve().parent.parent
MIRROR = os.environ.get("MOCAP_MIRROR", "")
HIPS, KNEES, ANKLES, SHOULDERS, ELBOWS = (
    [WALKER15.index(f"{side}_{part}") for side in ("left", "right")]
    for part in ("hip", "knee", "ankle", "shoulder", "elbow")
)
PELVIS = WALKER15.index("pelvis")


def of(
    positions: np.ndarray, rate_hz: float = RATE_HZ, *, walk: bool = True, **options: UpAxis
) -> list[Complaint]:
    """Return the complaints of the body check about joints, where NaN marks joints that were not measured."""
    return check(positions, np.isfinite(positions).all(axis=-1), rate_hz, walk=walk, **options)


def accept(positions: np.ndarray) -> None:
    """Raise the error with which the body check rejects the joints of an action."""
    accepted(positions, np.isfinite(positions).all(axis=-1), RATE_HZ, walk=False)


def codes(complaints: list[Complaint]) -> dict[str, bool]:
    """Return the codes of complaints, each with True if the complaint rejects the recording."""
    return {complaint.code: complaint.rejects for complaint in complaints}


def standing(hip_width: float = 160.0) -> np.ndarray:
    """Return a person in a constant posture, (9, 15, 3) mm, with simple sizes such as thighs of 400 mm."""
    heights = {"head": 1500, "sternum": 1300, "shoulder": 1300, "elbow": 1000, "wrist": 750, "pelvis": 900}
    heights |= {"hip": 900, "knee": 500, "ankle": 100}
    sides = {"shoulder": 180.0, "elbow": 200.0, "wrist": 220.0}
    body = np.zeros((9, 15, 3))
    for j, name in enumerate(WALKER15.joints):
        side, _, part = name.rpartition("_")
        body[:, j, 2] = heights[part]
        body[:, j, 0] = {"left": -1, "right": 1, "": 0}[side] * sides.get(part, hip_width / 2)
    body[:, :, 1] = 2.0 * np.arange(9)[:, None]
    body[:, SHOULDERS, 1] += 20.0
    return body


# Sizes


@pytest.mark.parametrize(
    ("mm_to_unit", "unit", "factor"),
    [
        (1e-3, "m", 1000.0),
        (0.1, "cm", 10.0),
        (1 / 25.4, "in", 25.4),
        (1 / 304.8, "ft", 304.8),
        (10.0, "", 0.1),
        (50.0, "", 0.01),
        (1e-6, "", 1e6),
    ],
)
def test_other_units_are_refused_by_name(mm_to_unit: float, unit: str, factor: float) -> None:
    positions = overground(0).positions
    accept(positions)
    with rejects("unit", unit=unit, factor=pytest.approx(factor)):
        accept(positions * mm_to_unit)


def test_legs_of_36_are_inches_rather_than_the_centimetres_of_a_small_child() -> None:
    positions = overground(0).positions
    with rejects("unit", unit="in", leg_mm=pytest.approx(36.0)):
        accept(positions * 36.0 / walking.leg_length(positions))


def test_a_small_child_has_legs_of_310_mm_and_no_person_of_290() -> None:
    positions = overground(0).positions
    accept(positions * 310.0 / walking.leg_length(positions))
    with rejects("unit", unit=""):
        accept(positions * 290.0 / walking.leg_length(positions))


def test_velocities_are_no_positions() -> None:
    clip = overground(0)
    velocity = np.gradient(clip.positions, 1.0 / 100.0, axis=0)
    velocity *= 800.0 / walking.leg_length(velocity)
    with rejects("changing"):
        accept(velocity)


@pytest.mark.parametrize("hidden", ["left_knee", "right_ankle"])
def test_legs_that_were_never_seen_whole_are_refused(hidden: str) -> None:
    positions = overground(0).positions.copy()
    positions[:, WALKER15.index(hidden)] = np.nan
    with rejects("legs_unseen"):
        accept(positions)


@pytest.mark.parametrize("axis", [0, 1])
def test_joints_of_a_film_have_no_depth(axis: int) -> None:
    positions = overground(0).positions.copy()
    positions[..., axis] = 7.0
    with rejects("plane"):
        accept(positions)


@pytest.mark.parametrize("where", [0.2, 0.75, 0.95])
def test_a_marker_of_thigh_or_shank_is_no_knee(where: float) -> None:
    positions = overground(0).positions.copy()
    hip, knee, ankle = (WALKER15.index(f"left_{part}") for part in ("hip", "knee", "ankle"))
    mirror = list(WALKER15.mirror)
    for a, b, c in ((hip, knee, ankle), (mirror[hip], mirror[knee], mirror[ankle])):
        positions[:, b] = (1.0 - where) * positions[:, a] + where * positions[:, c]
    with rejects("thigh", share=pytest.approx(where)):
        accept(positions)


_ARM = ["shoulder", "elbow", "wrist"]


@pytest.mark.parametrize(
    "parts", [["ankle"], ["knee"], ["knee", "ankle"], ["hip"], ["wrist"], ["shoulder"], _ARM]
)
def test_points_of_the_other_side_are_refused(parts: list[str]) -> None:
    positions = overground(0).positions.copy()
    positions[:3, WALKER15.index("left_elbow")] = np.nan
    pairs = [[WALKER15.index(f"{side}_{part}") for side in ("left", "right")] for part in parts]
    for left, right in pairs:
        positions[:, [left, right]] = positions[:, [right, left]]
    with rejects("exchanged"):
        accept(positions)


def test_legs_that_scissor_and_shanks_that_cross_are_not_exchanged() -> None:
    walk = overground(0).positions
    hips, knees, ankles = (
        [WALKER15.index(f"{side}_{part}") for side in ("left", "right")] for part in ("hip", "knee", "ankle")
    )
    inwards = np.diff(walk[:, hips], axis=1) * [[1.0], [-1.0]]
    scissoring = walk.copy()
    scissoring[:, knees] += 0.6 * inwards
    scissoring[:, ankles] += 0.6 * inwards
    accept(scissoring)
    sitting = np.repeat(walk[:1], 100, axis=0)
    sitting[:, ankles] += 0.9 * inwards[:1]
    accept(sitting)
    accept(sitting + np.random.default_rng(1).normal(size=sitting.shape))


def test_no_size_at_all_is_refused() -> None:
    with rejects("unit", unit=""):
        accept(np.zeros((9, 15, 3)))


def test_a_length_just_beyond_the_bound_does_not_print_alike() -> None:
    clip = overground(2).positions.copy()
    clip *= 1300.4 / walking.leg_length(clip)
    with pytest.raises(InvalidInput, match=r"expected legs of 300 to 1300 mm, found 1300\.4 mm"):
        accept(clip)


# Axis


@pytest.mark.parametrize("up", ["x", "y", "z", "-x", "-y", "-z"])
def test_the_data_decide_along_which_axis_a_person_stands_and_a_fixed_axis_breaks_ties(up: str) -> None:
    axis, sign = "xyz".index(up[-1]), -1.0 if up[0] == "-" else 1.0
    turned = np.roll(standing(), axis - 2, axis=-1)
    turned[..., axis] *= sign
    assert axis_up(turned) == (UpAxis(up), True)
    assert all(axis_up(turned, other) == (UpAxis(up), True) for other in UpAxis)
    tie = turned.copy()
    tie[..., axis - 1] = turned[..., axis]  # as high along the next axis
    assert axis_up(tie, UpAxis("xyz"[axis - 1] if sign > 0 else "-" + "xyz"[axis - 1])) == (
        UpAxis(("-" if sign < 0 else "") + "xyz"[axis - 1]),
        True,
    )
    assert axis_up(tie, UpAxis(up)) == (UpAxis(up), True)
    stooped = turned.copy()
    stooped[:, WALKER15.index("head")] = turned[:, WALKER15.index("left_ankle")]
    assert axis_up(stooped) == (UpAxis(up), False)
    assert axis_up(stooped, UpAxis.y) == (UpAxis.y, False)


def test_a_person_who_lies_is_rejected_as_a_walk_and_remarked_as_an_action_or_along_a_stated_axis() -> None:
    lying = np.roll(standing(), 1, axis=-1)
    assert codes(of(lying)) == {"axis": True}
    assert codes(of(lying, walk=False)) == {"axis": False}
    assert codes(of(lying, up=UpAxis.y)) == {"axis": False}
    assert "stands along x" in of(lying)[0].sentence
    assert of(standing()) == []


# Proportions


@pytest.mark.parametrize(
    ("hip_width", "expected"),
    [
        (44.0, {"hip_width": True}),  # of a leg of 800 mm
        (72.0, {"hip_width": False}),
        (88.0, {}),
        (232.0, {}),
        (248.0, {"hip_width": False}),
        (352.0, {"hip_width": False}),
        (368.0, {"hip_width": True}),
    ],
)
def test_hips_are_as_far_apart_as_people_have_them(hip_width: float, expected: dict[str, bool]) -> None:
    body = standing(hip_width)
    body[:, KNEES + ANKLES] = standing()[:, KNEES + ANKLES]
    body[:, HIPS, 2] = body[:, KNEES, 2] + np.sqrt(400.0**2 - (body[:, HIPS, 0] - body[:, KNEES, 0]) ** 2)
    complaints = of(body, walk=False)
    assert codes(complaints) == expected
    for complaint in complaints:
        assert complaint.where == ("left_hip", "right_hip")
        assert complaint.values["share"] == pytest.approx(hip_width / 800.0)
        assert ("map them as trochanters" in complaint.sentence) is (hip_width > 240.0)
        assert len(complaint.sentence) <= 300


@pytest.mark.parametrize(
    ("share", "rejects"),
    [
        (0.11, True),
        (0.13, False),
        (0.19, False),
        (0.21, None),
        (0.69, None),
        (0.71, False),
        (0.99, False),
        (1.01, True),
    ],
)
def test_shoulders_are_as_far_apart_as_people_have_them(share: float, rejects: bool | None) -> None:
    body = standing()
    body[:, SHOULDERS, 0] = 400.0 * share * np.array([-1.0, 1.0])  # legs of 800 mm
    assert codes(of(body, walk=False)) == ({} if rejects is None else {"shoulder_width": rejects})


@pytest.mark.parametrize(
    ("share", "rejects"),
    [
        (0.34, True),
        (0.36, False),
        (0.54, False),
        (0.56, None),
        (1.19, None),
        (1.21, False),
        (1.59, False),
        (1.61, True),
    ],
)
def test_the_head_is_as_far_from_the_pelvis_as_people_have_it(share: float, rejects: bool | None) -> None:
    body = standing()
    body[:, 0, 2] = 900.0 + 800.0 * share
    body[:, SHOULDERS, 2] = 910.0  # below the head
    assert codes(of(body, walk=False)) == ({} if rejects is None else {"pelvis_to_head": rejects})


@pytest.mark.parametrize(
    ("share", "rejects"),
    [(0.29, True), (0.31, False), (0.39, False), (0.41, None), (0.61, False), (0.71, True)],
)
def test_thighs_are_as_long_as_people_have_them(share: float, rejects: bool | None) -> None:
    body = standing()
    body[:, KNEES, 2] = 900.0 - 800.0 * share
    assert codes(of(body, walk=False)) == ({} if rejects is None else {"thigh": rejects})


def test_a_hip_at_the_centre_of_the_pelvis_is_rejected_by_name() -> None:
    body = overground(0).positions.copy()
    body[:, HIPS[0]] = body[:, PELVIS]
    with rejects("hip_at_pelvis", joints=["left_hip"], distance_mm=0.0):
        accept(body)


@pytest.mark.parametrize("limb", ["thigh", "shank", "upper arm", "forearm"])
@pytest.mark.parametrize(("longer", "rejects"), [(1.14, None), (1.16, False), (1.34, False), (1.36, True)])
def test_limbs_that_are_longer_on_one_side_are_remarked_or_rejected(
    limb: str, longer: float, rejects: bool | None
) -> None:
    part = {"thigh": (9, 10), "shank": (10, 11), "upper arm": (2, 3), "forearm": (3, 4)}[limb]
    body = standing()
    upper, lower = part
    body[:, lower:] = np.where(
        (np.arange(lower, 15) <= (11 if lower > 8 else 4))[:, None],
        body[:, lower:] + (longer - 1.0) * (body[:, [lower]] - body[:, [upper]]),
        body[:, lower:],
    )
    described = [complaint for complaint in of(body, walk=False) if complaint.code == "uneven"]
    assert [complaint.rejects for complaint in described] == ([] if rejects is None else [rejects])
    for complaint in described:
        assert complaint.sentence.startswith(f"the left {limb} is ")
        assert complaint.values["share"] == pytest.approx(longer - 1.0)
    body[:, lower] = np.nan  # not measured on one side
    assert "uneven" not in codes(of(body, walk=False))


def test_a_joint_that_jumps_is_a_remark_as_walks_estimate_it() -> None:
    body = overground(0).positions.copy()
    body[:, 7] += np.random.default_rng(1).normal(scale=300.0, size=(len(body), 3))
    assert codes(of(body)) == {"uneven": False}


# Posture and rate


def test_a_crouched_walker_gets_a_remark_with_the_number() -> None:
    """A walker with the hips 647 mm above the ankles and legs of 821 mm gets a remark with the ratio."""
    body, half, thigh = standing(), 647.0 / 2.0, 821.0 / 2.0
    upper = [j for j in range(15) if j not in (*KNEES, *ANKLES)]
    body[:, upper, 2] += 100.0 + 647.0 - 900.0
    body[:, KNEES, 2] = 100.0 + half
    body[:, KNEES, 1] += np.sqrt(thigh**2 - half**2)
    (complaint,) = of(body)
    assert (complaint.code, complaint.rejects) == ("crouched", False)
    assert complaint.values["share"] == pytest.approx(647.0 / 821.0, abs=1e-3)
    assert of(body, walk=False) == []


@pytest.mark.parametrize("factor", [1.0, 2.5, 4.0])
def test_more_strides_a_second_than_people_make_are_a_remark_with_the_rate_that_gives_one(
    factor: float,
) -> None:
    clip = overground(0)
    described = of(clip.positions, factor * RATE_HZ)
    assert codes(described) == ({} if factor == 1.0 else {"rate": False})
    for complaint in described:
        strides = complaint.values["strides_hz"] / factor
        assert strides == pytest.approx(STRIDE_HZ, rel=0.02)
        assert f"At {RATE_HZ / strides:.0f} Hz" in complaint.sentence


def test_left_and_right_exchanged_bend_the_knees_backwards() -> None:
    mirrored = overground(0).positions[:, list(WALKER15.mirror)]
    assert codes(of(mirrored)) == {"mirrored": True}
    assert codes(of(mirrored, walk=False)) == {"mirrored": False}
    bent = bending_performances(np.random.default_rng(1), performances=1, subjects=1).positions_mm[0]
    assert codes(of(bent, 30.0, walk=False)) == {}
    assert codes(of(bent[:, list(WALKER15.mirror)], 30.0, walk=False)) == {"mirrored": False}


def test_the_gravest_comes_first() -> None:
    body = standing(88.0 - 20.0)
    body[:, HIPS[0]] = body[:, PELVIS]
    assert [complaint.rejects for complaint in of(body)] == sorted(
        (complaint.rejects for complaint in of(body)), reverse=True
    )
    assert len(of(body)) > 1


# Real recordings


def exchanged(first: list[int], second: list[int]) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function that exchanges each joint of one list with the corresponding joint of another list."""
    order = list(range(15))
    for single, other in zip(first, second, strict=True):
        order[single], order[other] = order[other], order[single]
    return lambda body: body[:, order]


def with_hips_at_pelvis(body: np.ndarray) -> np.ndarray:
    """Return joint positions with the left hip moved to the centre of the pelvis."""
    spoilt = body.copy()
    spoilt[:, HIPS[0]] = spoilt[:, PELVIS]
    return spoilt


def with_hips_at_asis(body: np.ndarray) -> np.ndarray:
    """Return joints with the hips moved to the anterior superior iliac spines (ASIS) of the pelvis."""
    right = body[:, HIPS[1]] - body[:, HIPS[0]]
    forward = np.cross([0.0, 0.0, 1.0], right)
    forward /= np.linalg.norm(forward, axis=-1, keepdims=True)
    width = right / 0.72
    up = 0.345 * np.linalg.norm(width, axis=-1)[:, None] * [0.0, 0.0, 1.0]
    spoilt = body.copy()
    for hip, side in zip(HIPS, (-1.0, 1.0), strict=True):
        spoilt[:, hip] += side * 0.14 * width + up + 48.0 * forward
    return spoilt


SPOILT: dict[str, tuple[Callable[[np.ndarray], np.ndarray], float, int, int]] = {
    "axes cycled": (lambda body: np.roll(body, 1, axis=-1), 1.0, 60, 20),
    "axes cycled back": (lambda body: np.roll(body, 2, axis=-1), 1.0, 60, 20),
    "left and right exchanged": (lambda body: body[:, list(WALKER15.mirror)], 1.0, 60, 0),
    "hip = centre of the pelvis": (with_hips_at_pelvis, 1.0, 60, 20),
    "unit x 10": (lambda body: 10.0 * body, 1.0, 60, 20),
    "unit x 1000": (lambda body: 1000.0 * body, 1.0, 60, 20),
    "knees and ankles exchanged": (exchanged(KNEES, ANKLES), 1.0, 60, 20),
    "rate x 4": (lambda body: body, 4.0, 55, 0),
    "rate x 2": (lambda body: body, 2.0, 0, 0),
    "hip = ASIS": (with_hips_at_asis, 1.0, 0, 0),
}
"""Alterations of joints and frame rate, and the numbers of 60 walks and 20 actions in which each must be noticed."""


def recorded(kind: str, limit: int) -> list[tuple[str, np.ndarray, np.ndarray, float]]:
    """Return joints of up to `limit` public recordings of walks or other actions, alternating between people."""
    with (ROOT / "data" / "sources.csv").open(newline="") as stream:
        listed = [
            row for row in csv.DictReader(stream) if row["skeleton"] in mappings.shipped() and row["trial"]
        ]
    rows = [
        row
        for row in listed
        if (row["action"] == "walk") is (kind == "walk") and row["source"] != "kinectgait"
    ]
    folders = [Path(folder) for folder in MIRROR.split(os.pathsep)]
    turn: Counter[str] = Counter()
    ordered = []
    for row in rows:
        turn[row["subject"]] += 1
        ordered.append((turn[row["subject"]], row["path"], row))
    result: list[tuple[str, np.ndarray, np.ndarray, float]] = []
    for _, path, row in sorted(ordered, key=lambda item: item[:2]):
        file = next((folder / path for folder in folders if (folder / path).is_file()), None)
        if file and len(result) < limit:
            motion = formats.read(file, frame_rate_hz=float(row["frame_rate_hz"]))
            motion, positions, valid = joints_of(motion, mappings.shipped()[row["skeleton"]])
            assert motion.complaints == (), path
            result.append((path, positions, valid, motion.frame_rate_hz))
    return result


@pytest.mark.thorough
@pytest.mark.skipif(not MIRROR, reason="needs the recordings: set MOCAP_MIRROR")
def test_recordings_that_were_spoilt_are_noticed_and_others_are_not() -> None:
    clips = {"walk": recorded("walk", 60), "action": recorded("action", 20)}
    assert [len(of_kind) for of_kind in clips.values()] == [60, 20]
    lines = []
    for name, (spoil, factor, *targets) in {"unspoilt": (lambda body: body, 1.0, 0, 0), **SPOILT}.items():
        counts = []
        for kind, of_kind in clips.items():
            counts.append(
                sum(
                    bool(
                        check(
                            spoil(body),
                            np.isfinite(spoil(body)).all(axis=-1),
                            factor * rate,
                            walk=kind == "walk",
                        )
                    )
                    for _, body, _, rate in of_kind
                )
            )
        lines.append(f"{name:28s} {counts[0]:3d} of 60 walks, {counts[1]:3d} of 20 actions")
        assert counts[0] >= targets[0], lines[-1]
        assert counts[1] >= targets[1], lines[-1]
        if name == "unspoilt":
            assert sum(counts) <= 1
    print("\n".join(lines))
