"""Tests of the similarity of two recordings: high for a modified copy, low for two people."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.core.likeness import Likeness, likeness, limb_differences, posture_difference_mm
from pipeline.skeleton import WALKER15
from pipeline.synthetic.walkers import walking_population

HZ = 60.0
ARMS = slice(0, 8)


@functools.cache
def people() -> np.ndarray:
    return walking_population(
        np.random.default_rng(5), male=6, female=6, duration_s=4.0, frame_rate_hz=HZ
    ).positions_mm


def shown(positions: np.ndarray, frame_rate_hz: float = HZ, *, hidden: slice = slice(0)) -> Likeness:
    valid = np.ones(positions.shape[:2], dtype=bool)
    valid[:, hidden] = False
    return likeness(positions, valid, frame_rate_hz)


def differences(one: Likeness, other: Likeness) -> tuple[float, float]:
    limbs = float(limb_differences(one.limbs_mm, other.limbs_mm[None])[0])
    return limbs, posture_difference_mm(one.postures_mm, other.postures_mm)


@given(
    turn=st.floats(-np.pi, np.pi),
    away=st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4), st.floats(-1e3, 1e3)),
    size=st.floats(0.7, 1.4),
    mirrored=st.booleans(),
)
def test_place_heading_size_and_side_do_not_matter(
    turn: float, away: tuple[float, float, float], size: float, mirrored: bool
) -> None:
    walk = people()[0, :90]
    copy = walk[:, WALKER15.mirror] * [-1.0, 1.0, 1.0] if mirrored else walk
    about = np.array([[np.cos(turn), np.sin(turn), 0.0], [-np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])
    limbs, postures = differences(shown(walk), shown(size * copy @ about + np.array(away)))
    assert limbs < 1e-8
    assert postures < 1e-8


def test_people_differ_more_than_disguised_copies() -> None:
    rng = np.random.default_rng(1)
    kinds = [shown(walk) for walk in people()]
    pairs = [differences(kinds[i], kinds[j]) for i in range(12) for j in range(i)]
    assert min(postures for _, postures in pairs) > 22.0
    for walk in people()[:4]:
        noisy = walk + rng.normal(0.0, 5.0, walk.shape)
        for copy, rate in (
            (walk[40:200], HZ),
            (walk[::3], HZ / 3),
            (noisy[::-1], HZ),
            (1.1 * noisy[30:], HZ),
        ):
            limbs, postures = differences(shown(walk), shown(copy, rate))
            assert limbs < 0.7
            assert postures < 8.0


def test_legs_alone_tell_nobody_apart() -> None:
    legs = [shown(walk, hidden=ARMS) for walk in people()[:2]]
    limbs, postures = differences(*legs)
    assert np.isnan(limbs)
    assert np.isfinite(postures)


def test_recordings_without_whole_postures_are_infinitely_far() -> None:
    walk = people()[0]
    nothing = shown(walk, hidden=slice(0, 15))
    limbs, postures = differences(shown(walk), nothing)
    assert np.isnan(limbs)
    assert postures == np.inf
    assert posture_difference_mm(shown(walk[:8]).postures_mm, shown(walk).postures_mm) == np.inf


def test_limbs_are_compared_by_their_logarithms() -> None:
    first = np.full(8, 300.0)
    other = first * np.array([1.1, 1.0, 1.0, 1.0] * 2)
    off = np.log(1.1) * np.array([0.75, -0.25, -0.25, -0.25] * 2)
    assert limb_differences(first, other[None])[0] == pytest.approx(100.0 * np.sqrt(np.mean(off**2)))
