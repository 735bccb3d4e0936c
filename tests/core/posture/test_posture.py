"""Tests of postures as 37 numbers: invariance to position, size and heading, and exact conversion back to joints."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pipeline.core import linear_model
from pipeline.core.posture import (
    FRAMES,
    HEADINGS,
    PARAMETERS,
    LimbLengths,
    joints,
    joints_where_defined,
    limb_lengths,
    postures,
)
from pipeline.core.posture.frames import ARMS, FOREARMS, HIP, LEGS, NECK, REST, SHOULDER, THIGHS, TORSO
from pipeline.formats import acclaim
from pipeline.skeleton import POSTURE12, WALKER15
from pipeline.skeleton.mapped_joints import map_joints
from pipeline.skeleton.source_mapping import SourceMapping
from tests.rejects import rejects
from tests.strategies import seeds

UP, AHEAD, RIGHT = np.eye(3)[[2, 1, 0]]
SOMEWHERE = np.array([300.0, -2000.0, 55.0])
BODY = LimbLengths(
    np.array([180.0, 520.0, 350.0, 190.0, 430.0, 425.0, 410.0, 415.0, 320.0, 318.0, 250.0, 252.0]),
    pelvis_mm=np.array([2.0, -5.0, 12.0]),
    shoulders_mm=np.array([4.0, -20.0, -30.0]),
)


def body(directions: dict[str, np.ndarray], lengths: LimbLengths = BODY) -> np.ndarray:
    """Return joint positions (1, 15, 3) of limbs with given directions in world coordinates."""
    ends = {name: POSTURE12.ends[k] for k, name in enumerate(POSTURE12.limbs)}
    at = np.zeros((15, 3))
    for limb in POSTURE12.limbs:
        start, end = ends[limb]
        span = lengths.limbs_mm[POSTURE12.limbs.index(limb)] * directions[limb]
        if limb in ("hip", "shoulder"):
            middle = at[WALKER15.index("pelvis" if limb == "hip" else "sternum")]
            at[start], at[end] = middle - span / 2, middle + span / 2
        else:
            at[end] = at[start] + span
    return at[None]


def standing(**other: np.ndarray) -> np.ndarray:
    """Return an upright body that faces +y with hanging arms; some limbs may have other directions."""
    upright = dict.fromkeys(POSTURE12.limbs, -UP)
    return body({**upright, "hip": RIGHT, "torso": UP, "shoulder": RIGHT, "neck": UP, **other})


def cosines(posture: np.ndarray) -> np.ndarray:
    return posture[..., 1:].reshape(*posture.shape[:-1], 12, 3)


def moving(generator: np.random.Generator, frames: int, *, at_random: bool = False) -> np.ndarray:
    """Return a random clip (T, 15, 3) of a body with constant limb lengths."""
    means = np.array([RIGHT, UP, RIGHT, UP, *[-UP] * 8])
    wander = np.cumsum(generator.standard_normal((frames, 12, 3)), axis=0) / np.sqrt(frames)
    start = generator.standard_normal((12, 3))
    limbs = means + (0.5 * start + 0.3 * wander) * (3.0 if at_random else 1.0)
    limbs /= np.linalg.norm(limbs, axis=-1, keepdims=True)
    posture = np.concatenate([generator.uniform(0.3, 1.1, (frames, 1)), limbs.reshape(frames, 36)], axis=1)
    return joints(posture, BODY) + SOMEWHERE


def turned(positions: np.ndarray, angle: float) -> np.ndarray:
    return positions @ Rotation.from_euler("z", angle).as_matrix().T


def mirrored(positions: np.ndarray) -> np.ndarray:
    return positions[:, list(WALKER15.mirror)] * [-1.0, 1.0, 1.0]


# --- what the numbers are ---------------------------------------------------------------------------------


def test_twelve_limbs_cover_fifteen_joints_and_hang_together() -> None:
    assert len(POSTURE12.limbs) == 12
    assert PARAMETERS == 37
    assert {joint for pair in POSTURE12.ends for joint in pair} == set(range(15))
    for k, limb in enumerate(POSTURE12.limbs):
        if limb not in ("hip", "torso", "shoulder"):  # an axis is in the middle of what it carries
            assert any(POSTURE12.ends[k][0] in ends for ends in POSTURE12.ends[:k])


def test_a_standing_person_has_cosines_of_zero_and_one() -> None:
    posture = postures(standing())[0]
    assert posture[0] == pytest.approx(1.0, abs=0.02)  # 840 mm of legs, one longer than the other by 5
    described = cosines(posture)
    np.testing.assert_allclose(described[[HIP, SHOULDER]], [RIGHT, RIGHT], atol=1e-12)
    np.testing.assert_allclose(described[[TORSO, NECK]], [UP, UP], atol=1e-12)
    np.testing.assert_allclose(described[[*THIGHS, *ARMS]], [-UP] * 4, atol=1e-12)


def test_a_bow_is_a_torso_ahead_and_flexed_hips() -> None:
    described = cosines(postures(standing(torso=AHEAD, neck=AHEAD))[0])
    np.testing.assert_allclose(described[TORSO], AHEAD, atol=1e-12)
    np.testing.assert_allclose(described[NECK], UP, atol=1e-12)  # in line with the torso
    np.testing.assert_allclose(described[list(THIGHS)], [AHEAD] * 2, atol=1e-12)  # ahead of the trunk: flexed
    np.testing.assert_allclose(described[list(ARMS)], [AHEAD] * 2, atol=1e-12)


def test_a_turn_of_the_shoulders_is_told_in_the_torso_s_frame() -> None:
    shoulders = np.cos(0.4) * RIGHT + np.sin(0.4) * AHEAD
    described = cosines(postures(standing(shoulder=shoulders))[0])
    np.testing.assert_allclose(described[SHOULDER], [np.cos(0.4), np.sin(0.4), 0.0], atol=1e-12)
    np.testing.assert_allclose(described[list(ARMS)], [-UP] * 2, atol=1e-12)


@given(seeds)
def test_legs_and_forearms_are_told_in_a_frame_that_goes_with_their_parent(seed: int) -> None:
    """Directions of lower leg and forearm are relative to the parent limb, so they give the angle of knee and elbow."""
    clip = moving(np.random.default_rng(seed), 5)
    described = cosines(postures(clip))
    for limb, over in zip((*LEGS, *FOREARMS), (*THIGHS, *ARMS), strict=True):
        above, below = (np.diff(clip[:, POSTURE12.ends[k]], axis=1)[:, 0] for k in (over, limb))
        angle = (above * below).sum(axis=1) / (BODY.limbs_mm[over] * BODY.limbs_mm[limb])
        np.testing.assert_allclose((described[:, limb] * REST[over]).sum(axis=1), angle, atol=1e-9)


@given(seeds)
def test_the_smallest_rotation_is_that_of_an_independent_library(seed: int) -> None:
    clip = moving(np.random.default_rng(seed), 3)
    near, far = cosines(postures(clip)), cosines(postures(clip, frame="hip"))
    for leg, thigh in zip(LEGS, THIGHS, strict=True):
        for direction, in_hip, in_thigh in zip(near[:, thigh], far[:, leg], near[:, leg], strict=True):
            axis = np.cross(REST[thigh], direction)
            angle = np.arctan2(np.linalg.norm(axis), REST[thigh] @ direction)
            rotation = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
            np.testing.assert_allclose(rotation.apply(in_thigh), in_hip, atol=1e-9)


def test_in_the_hip_frame_every_limb_but_the_torso_is_told_against_the_same_axes() -> None:
    clip = moving(np.random.default_rng(3), 4)
    described = cosines(postures(clip, frame="hip"))
    rest = [k for k in range(12) if k not in (HIP, TORSO)]
    limbs = np.stack([np.diff(clip[:, POSTURE12.ends[k]], axis=1)[:, 0] for k in rest], axis=1)
    limbs /= np.linalg.norm(limbs, axis=-1, keepdims=True)
    # One rotation per frame, so all angles between limbs stay.
    np.testing.assert_allclose(
        np.einsum("tai,tbi->tab", described[:, rest], described[:, rest]),
        np.einsum("tai,tbi->tab", limbs, limbs),
        atol=1e-12,
    )


# --- what they do not know --------------------------------------------------------------------------------


@given(seeds, st.sampled_from(FRAMES), st.sampled_from(HEADINGS), st.floats(-7.0, 7.0))
def test_place_and_heading_are_taken_out(seed: int, frame: str, heading: str, angle: float) -> None:
    clip = moving(np.random.default_rng(seed), 6)
    plain = postures(clip, frame=frame, heading=heading)
    moved = postures(turned(clip, angle) + SOMEWHERE, frame=frame, heading=heading)
    same = slice(None) if heading != "none" else [0, *range(4, 37)]
    np.testing.assert_allclose(moved[:, same], plain[:, same], atol=1e-9)
    if heading == "none":
        np.testing.assert_allclose(cosines(moved)[:, HIP], turned(cosines(plain)[:, HIP], angle), atol=1e-9)


def test_the_first_frame_s_heading_keeps_a_turn_and_every_frame_s_removes_it() -> None:
    yaw = np.linspace(0.3, 3.9, 30)  # past 180 degrees, where the hip axis looks the other way
    clip = np.concatenate([turned(standing(), angle) for angle in yaw])
    first, every = (cosines(postures(clip, heading=h))[:, HIP] for h in ("first", "every"))
    np.testing.assert_allclose(
        first, np.stack([np.cos(yaw - 0.3), np.sin(yaw - 0.3), 0 * yaw], 1), atol=1e-12
    )
    np.testing.assert_allclose(every, [RIGHT] * 30, atol=1e-12)
    others = postures(clip)[:, 4:]
    np.testing.assert_allclose(others, others[:1].repeat(30, axis=0), atol=1e-12)


@given(seeds, st.floats(0.5, 2.0), st.sampled_from(FRAMES))
def test_size_is_taken_out(seed: int, scale: float, frame: str) -> None:
    clip = moving(np.random.default_rng(seed), 4)
    np.testing.assert_allclose(postures(scale * clip, frame=frame), postures(clip, frame=frame), atol=1e-9)
    assert limb_lengths(scale * clip).leg_length_mm == pytest.approx(scale * BODY.leg_length_mm)


@given(seeds, st.sampled_from(FRAMES))
def test_a_mirror_image_swaps_the_sides_and_x(seed: int, frame: str) -> None:
    clip = moving(np.random.default_rng(seed), 4)
    described, image = (postures(c, frame=frame, heading="every") for c in (clip, mirrored(clip)))
    np.testing.assert_allclose(image[:, 0], described[:, 0], atol=1e-12)
    other = [
        limb.replace("left", "*").replace("right", "left").replace("*", "right") for limb in POSTURE12.limbs
    ]
    image_of = list(map(POSTURE12.limbs.index, other))
    swapped = cosines(described)[:, image_of] * [-1.0, 1.0, 1.0]
    swapped[:, [HIP, SHOULDER]] *= -1.0  # the axes run from left to right again
    np.testing.assert_allclose(cosines(image), swapped, atol=1e-9)


@given(seeds, st.sampled_from(FRAMES))
def test_cosines_are_unit_vectors_and_inputs_are_left_alone(seed: int, frame: str) -> None:
    clip = moving(np.random.default_rng(seed), 4)
    before = clip.copy()
    described = cosines(postures(clip, frame=frame))
    np.testing.assert_allclose(np.linalg.norm(described, axis=-1), 1.0, atol=1e-12)
    np.testing.assert_array_equal(clip, before)


# --- the way back -----------------------------------------------------------------------------------------


@given(seeds, st.sampled_from(FRAMES), st.sampled_from(HEADINGS), st.booleans())
def test_joints_come_back_exactly(seed: int, frame: str, heading: str, at_random: bool) -> None:
    clip = moving(np.random.default_rng(seed), 8, at_random=at_random)
    floor = 40.0
    posture = postures(clip, frame=frame, heading=heading, floor_mm=floor)
    back = joints(posture, limb_lengths(clip), frame=frame)
    pelvis = clip[:, WALKER15.index("pelvis")]
    across = clip[:, WALKER15.index("right_hip")] - clip[:, WALKER15.index("left_hip")]
    yaw = np.arctan2(across[:, 1], across[:, 0])
    yaw = {"first": np.full(8, yaw[0]), "every": yaw, "none": np.zeros(8)}[heading]
    moved = clip - np.where([True, True, False], pelvis, floor)[:, None]
    for frame_there, frame_back, angle in zip(moved, back, yaw, strict=True):
        np.testing.assert_allclose(frame_back, turned(frame_there, -angle), atol=1e-9 * 3000.0)


@given(seeds, st.sampled_from(FRAMES))
def test_postures_come_back_exactly(seed: int, frame: str) -> None:
    generator = np.random.default_rng(seed)
    clip = moving(generator, 5)
    posture = postures(clip, frame=frame, heading="none", floor_mm=0.0)
    back = joints(posture, limb_lengths(clip), frame=frame)
    np.testing.assert_allclose(postures(back, frame=frame, heading="none", floor_mm=0.0), posture, atol=1e-9)


def test_limb_lengths_are_those_of_the_body() -> None:
    result = limb_lengths(moving(np.random.default_rng(5), 20))
    np.testing.assert_allclose(result.limbs_mm, BODY.limbs_mm, atol=1e-9)
    np.testing.assert_allclose(result.pelvis_mm, BODY.pelvis_mm, atol=1e-9)
    np.testing.assert_allclose(result.shoulders_mm, BODY.shoulders_mm, atol=1e-9)
    assert result.leg_length_mm == pytest.approx((430 + 425 + 410 + 415) / 2)


@pytest.mark.parametrize("frame", FRAMES)
def test_a_blend_of_postures_is_drawn_with_limbs_of_full_length(frame: str) -> None:
    clip = moving(np.random.default_rng(8), 40)
    blend = postures(clip, frame=frame).mean(axis=0)
    assert np.linalg.norm(cosines(blend), axis=-1).min() < 0.98
    drawn = joints(blend, BODY, frame=frame)
    assert drawn.shape == (15, 3)
    np.testing.assert_allclose(limb_lengths(drawn[None]).limbs_mm, BODY.limbs_mm, atol=1e-9)
    shrunk = blend * np.r_[1.0, np.full(36, 0.3)]
    np.testing.assert_allclose(joints(shrunk, BODY, frame=frame), drawn, atol=1e-9)


def test_any_leading_axes_are_kept() -> None:
    posture = postures(moving(np.random.default_rng(9), 6))
    many = joints(posture.reshape(2, 3, 37), BODY)
    assert many.shape == (2, 3, 15, 3)
    np.testing.assert_array_equal(many.reshape(6, 15, 3), joints(posture, BODY))
    np.testing.assert_array_equal(joints(posture[4], BODY), many[1, 1])


# --- the floor --------------------------------------------------------------------------------------------


def test_the_floor_is_the_level_of_the_standing_ankle() -> None:
    clip = standing().repeat(100, axis=0)
    clip[:, :, 2] += 500.0
    clip[40:60, :, 2] += 300.0  # a jump, and one frame in which an ankle is lost to below
    clip[70, WALKER15.index("left_ankle"), 2] -= 200.0
    u = postures(clip)[:, 0]
    assert u[0] == pytest.approx(1.0, abs=0.02)
    assert u[50] - u[0] == pytest.approx(300.0 / 840.0, rel=0.01)
    given_floor = postures(clip, floor_mm=0.0)[:, 0]
    np.testing.assert_allclose(given_floor * limb_lengths(clip).leg_length_mm, clip[:, 8, 2])


# --- no discontinuities -----------------------------------------------------------------------------------


@pytest.mark.parametrize("frame", FRAMES)
def test_a_deep_squat_is_smooth_where_angles_would_jump(frame: str) -> None:
    """The posture numbers vary smoothly in a deep squat, where thighs move from hanging to beyond the trunk."""
    flexion = np.radians(np.concatenate([np.linspace(-20, 225, 120), np.linspace(225, -20, 120)]))
    clip = []
    for angle in flexion:
        thigh = {
            side: np.array([0.6 * x * np.sin(angle / 2.2) ** 2, np.sin(angle), -np.cos(angle)])
            for side, x in (("left", -1.0), ("right", 1.0))
        }
        thigh = {side: v / np.linalg.norm(v) for side, v in thigh.items()}
        clip.append(standing(left_thigh=thigh["left"], right_thigh=thigh["right"])[0])
    steps = np.abs(np.diff(postures(np.array(clip), frame=frame)[:, 1:], axis=0)).max(axis=1)
    assert steps.max() < 4.0 * np.radians(245 / 120)


# --- bad input --------------------------------------------------------------------------------------------


def test_a_missing_joint_is_refused_by_frame_and_name() -> None:
    clip = moving(np.random.default_rng(2), 9)
    clip[4, WALKER15.index("left_knee"), 1] = np.nan
    clip[6, WALKER15.index("head")] = np.inf
    for use in (postures, limb_lengths):
        with rejects("missing_joint", "frame 4", joint="left_knee"):
            use(clip)


@pytest.mark.parametrize("shape", [(15, 3), (4, 14, 3), (4, 15, 2)])
def test_what_is_no_clip_is_refused(shape: tuple[int, ...]) -> None:
    with rejects("wrong_shape", "positions", shape=shape):
        postures(np.zeros(shape))
    with rejects("out_of_range", "frames", value=0):
        postures(np.zeros((0, 15, 3)))


def test_what_makes_no_frame_is_refused_by_frame() -> None:
    good = standing()
    for limbs, rejection in (
        ({"hip": UP, "torso": AHEAD}, rejects("hip_upright", "frame 1")),
        ({"torso": -RIGHT}, rejects("torso_along_hip", "frame 1")),
        ({"shoulder": UP}, rejects("shoulder_along_torso", "frame 1")),
        ({"right_thigh": -REST[5]}, rejects("against_rest", "frame 1", limb="right_thigh")),
    ):
        with rejection:
            postures(np.concatenate([good, standing(**limbs)]))


def test_near_the_singular_directions_the_way_back_is_still_exact() -> None:
    for tilt in (2e-3, 1e-2):
        away = REST[4] + tilt * np.cross(REST[4], UP)
        clip = standing(left_thigh=-away / np.linalg.norm(away))
        back = joints(postures(clip, heading="none", floor_mm=0.0), limb_lengths(clip))
        np.testing.assert_allclose(back, clip, atol=1e-6)


def test_a_limb_without_length_is_refused() -> None:
    clip = moving(np.random.default_rng(2), 3)
    clip[2, WALKER15.index("right_wrist")] = clip[2, WALKER15.index("right_elbow")]
    with rejects("zero_length", "frame 2, right_forearm"):
        postures(clip)


def test_unknown_choices_and_floors_are_refused() -> None:
    clip = standing()
    with rejects("unknown_choice", "frame", value="world"):
        postures(clip, frame="world")
    with rejects("unknown_choice", "frame", value="world"):
        joints(np.ones(37), BODY, frame="world")
    with rejects("unknown_choice", "heading", value="last"):
        postures(clip, heading="last")
    with rejects("out_of_range", "floor_mm"):
        postures(clip, floor_mm=np.nan)


def test_what_is_no_posture_is_refused() -> None:
    posture = postures(moving(np.random.default_rng(2), 3))
    with rejects("wrong_shape", shape=(3, 36)):
        joints(posture[:, 1:], BODY)
    missing = posture.copy()
    missing[1, 20] = np.nan
    with rejects("not_finite", "frame 1"):
        joints(missing, BODY)
    missing[1, 1 + 3 * NECK : 4 + 3 * NECK] = 0.0
    missing[1, 20] = 0.5
    with rejects("zero_length", "frame 1, neck"):
        joints(missing, BODY)


# --- the compiled way back --------------------------------------------------------------------------------


def limb_by_limb(posture: np.ndarray, body: LimbLengths, frame: str) -> np.ndarray:
    """Return joint positions (15, 3) of one posture (37,), computed limb by limb from the definition with SciPy's
    rotations.
    """

    def frame_of(x: np.ndarray, upward: np.ndarray) -> np.ndarray:
        z = upward - (upward @ x) * x
        z /= np.linalg.norm(z)
        return np.array([x, np.cross(z, x), z])

    described = cosines(posture)
    described = described / np.linalg.norm(described, axis=1, keepdims=True)
    h = described[HIP]
    t = described[TORSO] @ frame_of(h, UP)
    hip = frame_of(h, t)
    torso = np.array([np.cross(hip[1], t), hip[1], t])
    s = described[SHOULDER] @ (torso if frame == "parent" else hip)
    shoulder = frame_of(s, t)
    directions = {HIP: h, TORSO: t, SHOULDER: s}
    parents = (
        {NECK: torso} | dict.fromkeys((*THIGHS, *LEGS), hip) | dict.fromkeys((*ARMS, *FOREARMS), shoulder)
    )
    over = dict(zip((*LEGS, *FOREARMS), (*THIGHS, *ARMS), strict=True))
    for limb, parent in parents.items():
        reference = described[limb]
        if frame == "parent" and limb in over:
            rest, to = REST[over[limb]], described[over[limb]]
            axis = np.cross(rest, to)
            angle = np.arctan2(np.linalg.norm(axis), rest @ to)
            reference = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).apply(reference)
        directions[limb] = reference @ (parent if frame == "parent" else hip)
    at = np.zeros((15, 3))
    pelvis, sternum = WALKER15.index("pelvis"), WALKER15.index("sternum")
    at[pelvis, 2] = posture[0] * body.leg_length_mm
    at[sternum] = at[pelvis] + body.limbs_mm[TORSO] * t
    middles = {HIP: at[pelvis] - body.pelvis_mm @ hip, SHOULDER: at[sternum] + body.shoulders_mm @ shoulder}
    for limb, direction in directions.items():
        start, end = POSTURE12.ends[limb]
        if limb in middles:
            at[start], at[end] = (
                middles[limb] + side * body.limbs_mm[limb] * direction for side in (-0.5, 0.5)
            )
        elif limb != TORSO:
            at[end] = at[start] + body.limbs_mm[limb] * direction
    return at


@given(seed=seeds, frame=st.sampled_from(FRAMES))
@settings(max_examples=30, deadline=None)
def test_the_compiled_way_back_is_the_plain_one_posture_by_posture(seed: int, frame: str) -> None:
    generator = np.random.default_rng(seed)
    inputs = generator.standard_normal((7, 37))
    expected = [limb_by_limb(posture, BODY, frame) for posture in inputs]
    np.testing.assert_allclose(
        joints(inputs, BODY, frame=frame), expected, rtol=0, atol=1e-6
    )  # 1e-9 of a body
    # Nor does it matter in which company a posture comes.
    np.testing.assert_array_equal(joints(inputs[3], BODY, frame=frame), joints(inputs, BODY, frame=frame)[3])


def test_a_posture_without_joints_is_refused_alone() -> None:
    good = postures(standing())[0]
    codes = ("not_finite", "zero_length", "hip_upright", "against_rest", "shoulder_along_torso")
    wrong = {code: good.copy() for code in codes}
    wrong["not_finite"][20] = np.inf
    for code, limb, direction in (
        ("zero_length", NECK, 0.0 * UP),
        ("hip_upright", HIP, -UP),
        ("against_rest", ARMS[1], -REST[ARMS[1]]),
        ("shoulder_along_torso", SHOULDER, UP),
    ):
        cosines(wrong[code])[limb] = direction
    among = np.stack([good, *wrong.values(), good])
    result = joints_where_defined(among, BODY)
    assert np.isnan(result).all(axis=(1, 2)).tolist() == [False, *[True] * len(wrong), False]
    np.testing.assert_array_equal(result[[0, -1]], joints(among[[0, -1]], BODY))
    for code, posture in wrong.items():
        with rejects(code, "frame 0"):
            joints(posture, BODY)


# --- real performances ------------------------------------------------------------------------------------


needs_recordings = pytest.mark.skipif(
    not os.environ.get("MOCAP_MIRROR"), reason="needs the recordings: set MOCAP_MIRROR"
)


def recordings(action: str) -> list[np.ndarray]:
    """Return the joint positions of all performances of one action in HDM05."""
    folder = Path(os.environ["MOCAP_MIRROR"]) / "hdm05"
    points = {
        "head": "head",
        "sternum": "lowerneck",
        **{f"{side}_shoulder": f"{side[0]}clavicle" for side in ("left", "right")},
        **{f"{side}_elbow": f"{side[0]}humerus" for side in ("left", "right")},
        **{f"{side}_wrist": f"{side[0]}wrist" for side in ("left", "right")},
        **{f"{side}_hip": f"{side[0]}hipjoint" for side in ("left", "right")},
        **{f"{side}_knee": f"{side[0]}femur" for side in ("left", "right")},
        **{f"{side}_ankle": f"{side[0]}tibia" for side in ("left", "right")},
    }
    rules = {joint: {point: 1.0} for joint, point in points.items()}
    rules["pelvis"] = {"lhipjoint": 0.5, "rhipjoint": 0.5}
    mapping = SourceMapping(name="hdm05", up="y", joints=rules)
    return [map_joints(acclaim.read(path), mapping)[0] for path in sorted((folder / action).glob("*.amc"))]


def dimensions(samples: np.ndarray) -> int:
    """Return the smallest number of eigenvectors that explains 95 % of the variance [mozerov2006 4]."""
    model = linear_model.fit(samples, 37)
    return int(np.searchsorted(np.cumsum(model.eigenvalues) / model.total_variance, 0.95)) + 1


@needs_recordings
@pytest.mark.parametrize(
    ("action", "count", "expected"),
    [
        ("squat1Reps", 52, {"parent": (6, 6, 6), "hip": (8, 8, 8)}),
        ("depositFloorR", 32, {"parent": (12, 11, 11), "hip": (12, 12, 12)}),
    ],
)
def test_real_actions_need_a_third_of_the_dimensions_at_most(
    action: str, count: int, expected: dict[str, tuple[int, ...]]
) -> None:
    clips = recordings(action)
    assert len(clips) == count
    result = {
        frame: tuple(
            dimensions(np.concatenate([postures(c, frame=frame, heading=h) for c in clips])) for h in HEADINGS
        )
        for frame in FRAMES
    }
    assert result == expected
    for clip in clips:
        described = postures(clip)
        assert 0.85 < described[0, 0] < 1.12  # stands at the start
        assert described[:, 0].min() < 0.9  # goes down
        for limb in (*THIGHS, *ARMS):
            assert (
                cosines(described)[:, limb] @ REST[limb]
            ).min() > -0.5  # 60 degrees from where it has no frame
        assert np.abs(np.diff(described[:, 1:], axis=0)).max() < 0.25  # no discontinuity at 120 Hz


@needs_recordings
def test_real_bodies_come_back_to_within_the_play_of_their_shoulders() -> None:
    for clip in recordings("squat1Reps")[::10]:
        back = joints(postures(clip, heading="none"), limb_lengths(clip))
        difference = (back - back[:, 8:9]) - (clip - clip[:, 8:9])
        assert np.sqrt((difference**2).sum(axis=-1).mean()) < 25.0
