"""Tests of synthetic bending: rigid limbs, balance, feet that do not move, hands at the floor, and known phase."""

from __future__ import annotations

from contextlib import AbstractContextManager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.core import linear_model, posture
from pipeline.skeleton import POSTURE12, WALKER15
from pipeline.synthetic.bending import BendingPerformances, bending_performances, correspondence, time_warps
from pipeline.synthetic.bending.manner import draw_manner
from tests.rejects import rejects
from tests.strategies import seeds


@pytest.fixture(scope="module")
def bends() -> BendingPerformances:
    return bending_performances(np.random.default_rng(2006))


@pytest.fixture(scope="module")
def clean() -> BendingPerformances:
    """Forty bending performances by twenty people, without marker noise."""
    return bending_performances(
        np.random.default_rng(2006), performances=40, subjects=20, marker_noise_mm=0.0
    )


def joint(positions: np.ndarray, name: str) -> np.ndarray:
    return positions[:, WALKER15.index(name)]


def angle_deg(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    norms = np.linalg.norm(one, axis=-1) * np.linalg.norm(other, axis=-1)
    return np.degrees(np.arccos(np.clip((one * other).sum(axis=-1) / norms, -1.0, 1.0)))


# --- what is given ----------------------------------------------------------------------------------------


def test_forty_performances_of_about_a_hundred_frames(bends: BendingPerformances) -> None:
    frames = np.array([len(p) for p in bends.positions_mm])
    assert len(frames) == 40
    assert 88 < frames.mean() < 112
    assert frames.std() > 8
    assert len(set(frames)) > 20
    for positions, phase in zip(bends.positions_mm, bends.phase, strict=True):
        assert positions.shape == (len(phase), 15, 3)
        assert positions.dtype == np.float64
        assert np.isfinite(positions).all()
        assert phase[0] == 0.0
        assert phase[-1] == 1.0
        assert (np.diff(phase) > 0).all()
    np.testing.assert_array_equal(bends.subject, np.arange(40) % 5)


def test_the_seed_decides_everything() -> None:
    first, again, other = (
        bending_performances(np.random.default_rng(s), performances=4, subjects=2) for s in (1, 1, 2)
    )
    for single, two in zip(first.positions_mm, again.positions_mm, strict=True):
        np.testing.assert_array_equal(single, two)
    assert not np.isclose(first.positions_mm[0][0], other.positions_mm[0][0]).any()


def test_the_first_performances_stay_when_more_are_asked_for(bends: BendingPerformances) -> None:
    few = bending_performances(np.random.default_rng(2006), performances=7)
    for n in range(7):
        np.testing.assert_array_equal(few.positions_mm[n], bends.positions_mm[n])
        np.testing.assert_array_equal(few.phase[n], bends.phase[n])


def test_only_one_number_is_drawn_from_the_given_generator() -> None:
    generators = [np.random.default_rng(5) for _ in range(2)]
    bending_performances(generators[0], performances=1, subjects=1)
    bending_performances(generators[1], performances=9, subjects=3)
    assert generators[0].random() == generators[1].random()


def test_marker_noise_is_white_and_as_large_as_said() -> None:
    loud, silent = (
        bending_performances(np.random.default_rng(4), performances=6, subjects=2, marker_noise_mm=n)
        for n in (2.0, 0.0)
    )
    noise = np.concatenate([a - b for a, b in zip(loud.positions_mm, silent.positions_mm, strict=True)])
    assert noise.std() == pytest.approx(2.0, rel=0.02)
    assert abs(np.corrcoef(noise[:-1].ravel(), noise[1:].ravel())[0, 1]) < 0.02


# --- people who bend --------------------------------------------------------------------------------------


def test_limbs_are_rigid_and_feet_stay_where_they_stand(clean: BendingPerformances) -> None:
    for positions in clean.positions_mm:
        for start, end in POSTURE12.ends:
            assert np.ptp(np.linalg.norm(positions[:, end] - positions[:, start], axis=-1)) < 1e-6
        for side in ("left", "right"):
            assert np.ptp(joint(positions, f"{side}_ankle"), axis=0).max() < 1e-6


def test_bodies_have_human_sizes_and_are_the_same_in_all_of_a_person_s_performances(
    clean: BendingPerformances,
) -> None:
    lengths = np.array([posture.limb_lengths(p).limbs_mm for p in clean.positions_mm])
    for subject in range(20):
        assert np.ptp(lengths[clean.subject == subject], axis=0).max() < 1e-6
    assert (np.ptp(lengths, axis=0) > 10.0).all()
    assert all(abs(person.body.stature - 1700) < 300 for person in clean.people)
    ankle = [joint(p, "left_ankle")[0, 2] for p in clean.positions_mm[:20]]
    legs = lengths[:20, [4, 5, 6, 7]].sum(axis=1) / 2 + ankle
    np.testing.assert_allclose(legs, [person.body.leg_length for person in clean.people], rtol=1e-9)


def test_everybody_stands_bends_to_the_floor_and_stands_again(clean: BendingPerformances) -> None:
    for positions, phase, subject in zip(clean.positions_mm, clean.phase, clean.subject, strict=True):
        stature = clean.people[subject].body.stature
        heads = joint(positions, "head")[:, 2]
        wrists = np.minimum(joint(positions, "left_wrist")[:, 2], joint(positions, "right_wrist")[:, 2])
        ends = (phase < 0.03) | (phase > 0.97)
        assert (heads[ends] > 0.84 * stature).all()
        assert (wrists[ends] > 0.38 * stature).all()
        assert wrists.min() < 0.2 * stature
        assert wrists.min() > 0.0
        assert 0.35 < phase[wrists.argmin()] < 0.65
        assert positions[..., 2].min() > 0.0  # no joint is under the floor


def test_joints_keep_to_anatomy(clean: BendingPerformances) -> None:
    for positions in clean.positions_mm:
        hips, shoulders = (
            joint(positions, f"right_{j}") - joint(positions, f"left_{j}") for j in ("hip", "shoulder")
        )
        assert angle_deg(hips, shoulders).max() < 50  # twisted
        ahead = np.cross([0.0, 0.0, 1.0], hips)
        for side in ("left", "right"):
            hip, knee, ankle, shoulder, elbow, wrist = (
                joint(positions, f"{side}_{name}")
                for name in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
            )
            flexion = angle_deg(knee - hip, ankle - knee)
            assert flexion.min() > 1.0
            assert flexion.max() < 150
            # Knees bend forwards, out of the line from hip to ankle.
            line = (ankle - hip) / np.linalg.norm(ankle - hip, axis=-1, keepdims=True)
            out = (knee - hip) - ((knee - hip) * line).sum(axis=-1, keepdims=True) * line
            assert ((out * ahead).sum(axis=-1) > 0).all()
            assert angle_deg(elbow - shoulder, wrist - elbow).max() < 120


def test_the_centre_of_mass_stays_over_the_feet(clean: BendingPerformances) -> None:
    """The centre of mass, computed with the masses of Winter 2009, stays over the feet."""
    for positions, subject in zip(clean.positions_mm, clean.subject, strict=True):
        both = {
            name: (joint(positions, f"left_{name}") + joint(positions, f"right_{name}")) / 2
            for name in ("hip", "knee", "ankle")
        }
        trunk = joint(positions, "sternum") - joint(positions, "pelvis")
        mass = (
            0.093 * (both["ankle"] + 0.567 * (both["knee"] - both["ankle"]))
            + 0.2 * (both["knee"] + 0.567 * (both["hip"] - both["knee"]))
            + 0.678 * (both["hip"] + 0.626 * trunk)
        ) / 0.971
        across = joint(positions, "right_hip")[0] - joint(positions, "left_hip")[0]
        ahead = np.array([-across[1], across[0]]) / np.hypot(*across[:2])
        reach = (mass - both["ankle"])[:, :2] @ ahead / clean.people[subject].body.stature
        # From the heel to the ball of the foot.
        assert reach.min() > -0.04
        assert reach.max() < 0.12


def test_people_differ_more_than_their_performances(clean: BendingPerformances) -> None:
    depth = np.array([posture.postures(p)[:, 0].min() for p in clean.positions_mm])
    reference = np.array([depth[clean.subject == s] for s in range(20)])
    assert reference.mean(axis=1).std() > 2.0 * reference.std(axis=1).mean()
    assert (np.ptp(reference, axis=1) > 0).all()
    assert depth.min() < 0.6  # squats
    assert depth.max() > 0.85  # stoops


def test_everybody_faces_somewhere_else_and_postures_do_not_know_it(clean: BendingPerformances) -> None:
    across = np.array([joint(p, "right_hip")[0] - joint(p, "left_hip")[0] for p in clean.positions_mm])
    facing = np.arctan2(across[:20, 1], across[:20, 0])
    assert np.abs(np.exp(1j * facing).mean()) < 0.6
    assert all(np.abs(posture.postures(p)[0, 2]) < 1e-9 for p in clean.positions_mm)


def test_no_linear_model_is_behind_it(clean: BendingPerformances) -> None:
    """The joints vary in at least 30 dimensions, even without marker noise."""
    samples = np.concatenate([p.reshape(len(p), 45) - np.tile(p[:, 8], 15) for p in clean.positions_mm])
    model = linear_model.fit(samples, 45)
    assert (model.eigenvalues[:30] > 1e-6 * model.total_variance).all()


@pytest.mark.parametrize(("subjects", "expected"), [(1, (2, 2)), (5, (4, 5)), (20, (5, 6))])
def test_the_aspace_has_a_few_dimensions(subjects: int, expected: tuple[int, int]) -> None:
    """The posture space needs 2 to 6 dimensions for 95 % of the variance; the paper needs 16, recorded people 12."""
    bends = bending_performances(np.random.default_rng(0), subjects=subjects)
    model = linear_model.fit(np.concatenate([posture.postures(p) for p in bends.positions_mm]), 37)
    b = int(np.searchsorted(np.cumsum(model.eigenvalues) / model.total_variance, 0.95)) + 1
    assert expected[0] <= b <= expected[1]


# --- timing -----------------------------------------------------------------------------------------------


def test_a_performance_corresponds_to_itself_and_back(bends: BendingPerformances) -> None:
    for n, m in ((0, 0), (3, 3)):
        np.testing.assert_allclose(
            correspondence(bends.phase[n], bends.phase[m]), np.arange(len(bends.phase[n])), atol=1e-9
        )
    for n, m in ((0, 1), (5, 17), (30, 2)):
        moved, back = (
            correspondence(bends.phase[n], bends.phase[m]),
            correspondence(bends.phase[m], bends.phase[n]),
        )
        assert moved.shape == (len(bends.phase[n]),)
        assert moved[0] == 0
        assert moved[-1] == len(bends.phase[m]) - 1
        assert (np.diff(moved) > 0).all()
        again = np.interp(moved, np.arange(len(back)), back)
        np.testing.assert_allclose(again, np.arange(len(moved)), atol=0.02)


def test_the_true_warp_brings_one_person_s_performances_together() -> None:
    alike = bending_performances(np.random.default_rng(9), performances=8, subjects=1, rate_spread=0.5)
    described = [posture.postures(p) for p in alike.positions_mm]

    def difference(frames: np.ndarray, m: int) -> float:
        at = np.stack(
            [np.interp(frames, np.arange(len(described[m])), column) for column in described[m].T], axis=1
        )
        return float(np.sqrt(((at - described[0]) ** 2).sum(axis=1).mean()))

    truth = [difference(correspondence(alike.phase[0], alike.phase[m]), m) for m in range(1, 8)]
    linear = [difference(np.linspace(0, len(described[m]) - 1, len(described[0])), m) for m in range(1, 8)]
    assert np.mean(truth) < 0.6 * np.mean(linear)


def test_without_a_spread_of_rates_all_warps_are_linear() -> None:
    steady = bending_performances(np.random.default_rng(3), performances=4, subjects=2, rate_spread=0.0)
    for phase in steady.phase:
        np.testing.assert_allclose(phase, np.linspace(0, 1, len(phase)), atol=1e-12)


def test_people_stand_still_at_both_ends() -> None:
    bends = bending_performances(np.random.default_rng(3), performances=10, marker_noise_mm=0.0)
    for positions, phase in zip(bends.positions_mm, bends.phase, strict=True):
        speed = np.linalg.norm(np.diff(joint(positions, "sternum"), axis=0), axis=1)
        resting = (phase[1:] < 0.05) | (phase[1:] > 0.95)
        assert resting.any()
        assert speed[resting].max() < 0.2 * speed.max()


@given(seeds, st.floats(0.0, 1.5), st.integers(2, 300))
def test_warps_are_monotone_and_keep_both_ends(seed: int, spread: float, frames: int) -> None:
    phase = time_warps.warp(time_warps.draw_waves(np.random.default_rng(seed), spread), frames)
    assert phase.shape == (frames,)
    assert (phase[0], phase[-1]) == (0.0, 1.0)
    assert (np.diff(phase) > 0).all()


def test_the_spread_of_rates_is_what_was_asked_for() -> None:
    generator = np.random.default_rng(1)
    logs = np.log(
        np.diff([time_warps.warp(time_warps.draw_waves(generator, 0.3), 400) for _ in range(400)]) * 399
    )
    # The part that all of a performance shares is gone with its duration.
    assert 0.22 < logs.std() < 0.3
    # Smooth: the rate changes by little from frame to frame.
    assert np.abs(np.diff(logs, axis=1)).max() < 0.1


def test_progress_goes_from_standing_to_the_deepest_and_back() -> None:
    manner = draw_manner(np.random.default_rng(1))
    phase = np.linspace(0, 1, 501)
    for name in ("knee", "hip", "arms"):
        gone = manner.progress(name, phase)
        np.testing.assert_allclose(gone[[0, -1]], 0.0, atol=1e-12)
        assert gone[250] == pytest.approx(1.0)
        assert gone.min() >= 0.0
        assert (np.diff(gone[:250]) >= -1e-12).all()
        assert (np.diff(gone[250:]) <= 1e-12).all()
        assert np.abs(np.diff(gone, n=2)).max() < 5e-3  # without corners


# --- bad input --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wrong", "rejection"),
    [
        ({"performances": 0}, rejects("out_of_range", "performances", value=0)),
        ({"subjects": 0}, rejects("out_of_range", "subjects", value=0)),
        ({"frames_mean": 5.0}, rejects("out_of_range", "frames_mean", value=5.0)),
        ({"frame_rate_hz": 0.0}, rejects("out_of_range", "frame_rate_hz", value=0.0)),
        ({"rate_spread": -0.1}, rejects("out_of_range", "rate_spread", value=-0.1)),
        ({"marker_noise_mm": np.nan}, rejects("out_of_range", "marker_noise_mm")),
    ],
)
def test_what_cannot_be_is_refused(wrong: dict[str, float], rejection: AbstractContextManager) -> None:
    with rejection:
        bending_performances(np.random.default_rng(0), **wrong)  # type: ignore[arg-type]
