"""Tests of gait events and gait-cycle numbers of constructed walkers, their derivatives, and their times in a clip."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.skeleton import WALKER15
from tests.walk3d.film.walk.walkers import clip, prior, walks
from walk3d.anatomy.prior import mirror_image, stance_rows
from walk3d.film.walk import Fitting, TrainingWalk, errors, reconstruct
from walk3d.film.walk.cycle import (
    EVENT_DELAYS,
    NUMBERS,
    GaitCycle,
    angle_curves,
    deviations,
    event_times,
    gait_cycle,
)
from walk3d.film.walk.objective import LOG_F, PHASE
from walk3d.film.walk.sagittal_angles import ANGLES

ANKLES = WALKER15.index("left_ankle"), WALKER15.index("right_ankle")


def of(walk: TrainingWalk) -> GaitCycle:
    """Return the gait cycle of a training walk, with the speed of the ground in this walk."""
    return gait_cycle(walk.walker, walk.frequency_hz, stance_rows(walk.walker)[1])


def numbers(cycle: GaitCycle) -> dict[tuple[str, str], float]:
    """Return the gait-cycle numbers by kind and side."""
    return dict(zip(NUMBERS, cycle.values.tolist(), strict=True))


def test_a_walker_whose_events_are_known() -> None:
    """Ankles that swing as sine curves have gait events a quarter of a cycle after zero, plus the delay of the event.

    The right ankle swings half a cycle later.
    """
    walker = np.zeros((15, 3, 9))
    walker[ANKLES[0], 1, 0] = 40.0  # set down farther in front
    for sign, ankle in zip((1.0, -1.0), ANKLES, strict=True):
        walker[ankle, 1, 1] = sign * 300.0  # sine
        walker[ankle, 0, 0] = -sign * 60.0
        walker[ankle, 2, 0] = -800.0
    belt = np.zeros(405)
    belt[(3 * ANKLES[0] + 1) * 9 + 1] = 1.0  # 300 mm a radian
    result = gait_cycle(walker, 0.8, belt)
    contact, toe_off = 2 * np.pi * np.array(EVENT_DELAYS)
    np.testing.assert_allclose(result.phases[0], [np.pi / 2 + contact, 3 * np.pi / 2 + contact])
    np.testing.assert_allclose(result.phases[1], [3 * np.pi / 2 + toe_off, np.pi / 2 + toe_off])
    message = numbers(result)
    assert message["stride_time", ""] == pytest.approx(1.25)
    assert message["step_time", "left"] == message["step_time", "right"] == pytest.approx(0.625)
    assert message["stance", "left"] == pytest.approx(0.5 + EVENT_DELAYS[1] - EVENT_DELAYS[0])
    assert message["double_support", ""] == pytest.approx(2 * (EVENT_DELAYS[1] - EVENT_DELAYS[0]))
    assert message["stride_length", ""] == pytest.approx(2 * np.pi * 300)
    assert message["step_width", ""] == pytest.approx(120)
    steps = message["step_length", "left"], message["step_length", "right"]
    assert sum(steps) == pytest.approx(message["stride_length", ""])
    assert steps[0] == pytest.approx(300 * np.pi + 40)


def test_both_steps_make_a_stride_of_everybody() -> None:
    for walk in walks():
        message = numbers(of(walk))
        for kind, whole in (("step_time", "stride_time"), ("step_length", "stride_length")):
            assert message[kind, "left"] + message[kind, "right"] == pytest.approx(message[whole, ""])
        assert message["stance", "left"] + message["stance", "right"] == pytest.approx(
            1 + message["double_support", ""]
        )
        assert 0.45 < message["stance", "left"] < 0.75


def test_a_mirrored_walker_has_left_and_right_exchanged() -> None:
    walk = walks()[0]
    other = TrainingWalk(
        mirror_image(walk.walker), walk.frequency_hz, walk.aperiodic_variance, walk.height_mm
    )
    first, mirrored = numbers(of(walk)), numbers(of(other))
    for kind, side in NUMBERS:
        if side == "difference":
            assert mirrored[kind, side] == pytest.approx(-first[kind, side], abs=1e-6)
        elif side:
            assert mirrored[kind, {"left": "right", "right": "left"}[side]] == pytest.approx(
                first[kind, side]
            )
        else:
            assert mirrored[kind, side] == pytest.approx(first[kind, side])


def test_derivatives_are_those_of_the_numbers() -> None:
    walk = walks()[1]
    belt, rng = stance_rows(walk.walker)[1], np.random.default_rng(0)
    result = gait_cycle(walk.walker, walk.frequency_hz, belt)

    def moved(step: np.ndarray) -> GaitCycle:
        return gait_cycle(
            walk.walker + step[:405].reshape(15, 3, 9), walk.frequency_hz * np.exp(step[406]), belt
        )

    for _ in range(3):
        step = 1e-3 * rng.normal(size=407)
        step[406] *= 1e-3
        ahead, back = moved(step), moved(-step)
        np.testing.assert_allclose(
            result.slopes @ step, (ahead.values - back.values) / 2, rtol=1e-3, atol=1e-9
        )
        turned = (ahead.phases - back.phases) / 2
        np.testing.assert_allclose(result.phase_slopes @ step, turned, rtol=1e-3, atol=1e-9)


def test_events_come_once_a_stride_in_a_clip() -> None:
    walk = walks()[0]
    result, times = of(walk), np.linspace(-1.3, 1.3, 79)
    covariance = np.diag(np.r_[np.zeros(405), 0.01, 0.0])
    for phases, of_event in zip(
        result.phases, event_times(result, covariance, 0.4, walk.frequency_hz, times), strict=True
    ):
        for psi, (at, sd) in zip(phases, of_event, strict=True):
            assert abs(len(at) - 2.6 * walk.frequency_hz) < 1
            np.testing.assert_allclose(np.cos(2 * np.pi * walk.frequency_hz * at + 0.4 - psi), 1.0)
            # Known but for the phase: 0.1 rad of a cycle.
            np.testing.assert_allclose(sd, 0.1 / (2 * np.pi * walk.frequency_hz))


def test_curves_begin_and_end_at_the_same_contact() -> None:
    walk = walks()[2]
    angles, sd = angle_curves(walk.walker, np.zeros((407, 407)), of(walk), 41)
    assert angles.shape == sd.shape == (2, 41, len(ANGLES))
    np.testing.assert_allclose(angles[:, 0], angles[:, -1], atol=1e-9)
    np.testing.assert_allclose(np.degrees(sd), 2.0)  # the floor
    message, knee = numbers(of(walk)), ANGLES.index("left_knee")
    assert angles[0, :, knee].max() == pytest.approx(message["knee_most", "left"], abs=0.02)


def test_a_reconstructed_walk_has_the_events_of_the_recorded_one() -> None:
    sim, walk = clip(40.0), walks()[0]
    observed = np.ones(sim.pixels.shape[:2])
    result = reconstruct(
        sim.pixels,
        observed,
        sim.frame_rate_hz,
        sim.focal_px,
        prior(),
        Fitting(both_labellings=False, max_starts=1),
    )
    contacts, toe_offs = errors.event_errors(result, sim.positions_mm, sim.heading_rad)
    assert len(contacts) >= 3
    assert np.median(np.abs(contacts[:, 0])) < 0.025
    assert np.median(np.abs(toe_offs[:, 0])) < 0.025
    sd = deviations(result.cycle.slopes, result.posterior.covariance)
    off = errors.number_errors(result, walk) * sd
    by_name = dict(zip(NUMBERS, np.abs(off).tolist(), strict=True))
    assert by_name["stance", "left"] < 0.05
    assert by_name["knee_most", "right"] < np.radians(12)
    late = event_times(result.cycle, result.posterior.covariance, float(result.fit.x[PHASE]) + 0.3,
                       float(np.exp(result.fit.x[LOG_F])), result.fit.objective.setting.times)  # fmt: skip
    assert late[0][0][0][0] != pytest.approx(contacts[0, 0])
