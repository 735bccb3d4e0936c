"""Tests of the signed joint angles in the plane of progression: postures with known angles, and derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.skeleton import WALKER15
from walk3d.film.walk.sagittal_angles import ANGLES, sagittal_angles, sagittal_slopes


def standing() -> np.ndarray:
    """Return the joints (15, 3) of a person who stands straight with hanging arms."""
    at = np.zeros((15, 3))
    heights = {"head": 700, "sternum": 500, "shoulder": 450, "elbow": 150, "wrist": -100, "hip": -20, "knee": -450,
               "ankle": -850, "pelvis": 0}  # fmt: skip
    for j, joint in enumerate(WALKER15.joints):
        side, _, part = joint.rpartition("_")
        at[j] = {"left": -150, "right": 150}.get(side, 0), 0, heights[part]
    return at


def turned(at: np.ndarray, centre: str, joints: tuple[str, ...], degrees: float) -> np.ndarray:
    """Return the posture after a rotation of some joints about another joint, with the lower parts moved forwards."""
    result, c, s = at.copy(), np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    for joint in joints:
        _, y, z = at[WALKER15.index(joint)] - at[WALKER15.index(centre)]
        result[WALKER15.index(joint), 1:] = at[WALKER15.index(centre), 1:] + [c * y - s * z, s * y + c * z]
    return result


def angles_of(at: np.ndarray) -> dict[str, float]:
    """Return the joint angles that are not zero, degrees, by name."""
    result = zip(ANGLES, np.degrees(sagittal_angles(at)).round(6).tolist(), strict=True)
    return {name: angle for name, angle in result if angle}


def test_flexion_is_positive_and_extension_negative() -> None:
    straight = standing()
    assert angles_of(straight) == {}
    assert angles_of(turned(straight, "left_hip", ("left_knee", "left_ankle"), 30)) == {
        "left_hip": 30,
        "left_shank": -30,
    }
    assert angles_of(turned(straight, "left_hip", ("left_knee", "left_ankle"), -20)) == {
        "left_hip": -20,
        "left_shank": 20,
    }
    assert angles_of(turned(straight, "right_knee", ("right_ankle",), -60)) == {
        "right_knee": 60,
        "right_shank": 60,
    }
    assert angles_of(turned(straight, "right_knee", ("right_ankle",), 5)) == {
        "right_knee": -5,
        "right_shank": -5,
    }
    assert angles_of(turned(straight, "left_elbow", ("left_wrist",), 40)) == {"left_elbow": 40}
    assert angles_of(turned(straight, "right_shoulder", ("right_elbow", "right_wrist"), 25)) == {
        "right_shoulder": 25
    }
    upper = tuple(j for j in WALKER15.joints if j in ("head", "sternum") or "shoulder" in j)
    leaning = angles_of(
        turned(straight, "pelvis", (*upper, *(j for j in WALKER15.joints if "elb" in j or "wri" in j)), -10)
    )
    assert leaning == {"left_hip": 10, "right_hip": 10, "trunk": 10}


def test_what_is_beside_the_plane_does_not_count() -> None:
    aside = standing()
    aside[WALKER15.index("left_elbow"), 0] -= 100
    aside[WALKER15.index("right_knee"), 0] += 80
    assert angles_of(aside) == {}


@given(seed=st.integers(0, 2**32 - 1))
def test_derivatives_are_those_of_the_angles(seed: int) -> None:
    rng = np.random.default_rng(seed)
    at = standing() + rng.normal(size=(15, 3)) * 60
    step = rng.normal(size=(15, 3))
    expected = np.einsum("ajx,jx->a", sagittal_slopes(at), step)
    result = (sagittal_angles(at + 1e-4 * step) - sagittal_angles(at - 1e-4 * step)) / 2e-4
    np.testing.assert_allclose(result, expected, rtol=1e-4, atol=1e-8)


def test_angles_go_around_the_circle() -> None:
    raised = turned(standing(), "left_shoulder", ("left_elbow", "left_wrist"), 179)
    leant = turned(raised, "pelvis", ("sternum",), 10)
    assert angles_of(leant)["left_shoulder"] == pytest.approx(169)
