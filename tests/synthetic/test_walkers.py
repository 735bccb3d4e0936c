"""Tests of the synthetic walkers: bodies, feet, rhythm, and variance that no small linear model explains.

Fourier claims are measured by a regression written here, not by `pipeline.core.fourier`.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from operator import attrgetter

import numpy as np
import pytest
from scipy.ndimage import minimum_filter1d
from scipy.optimize import minimize_scalar

from pipeline.core import anthropometry
from pipeline.skeleton import WALKER15
from pipeline.synthetic.walkers import WalkingPopulation, normative_gait, walking_population
from pipeline.synthetic.walkers.normative_gait import CURVES
from pipeline.synthetic.walkers.person import draw_person
from tests.rejects import rejects

NOISE_MM = 0.5


@pytest.fixture(scope="module")
def walkers() -> WalkingPopulation:
    return walking_population(np.random.default_rng(2007))


@pytest.fixture(scope="module")
def clean() -> WalkingPopulation:
    """Synthetic population of thirty walkers without marker noise."""
    return walking_population(np.random.default_rng(2007), male=12, female=18, marker_noise_mm=0.0)


def each(population: WalkingPopulation, name: str) -> np.ndarray:
    """Return an attribute of every person as an array."""
    return np.array([attrgetter(name)(person) for person in population.people])


def joint(population: WalkingPopulation, name: str) -> np.ndarray:
    return population.positions_mm[:, :, WALKER15.index(name)]


def regression(times: np.ndarray, frequency: float, harmonics: int) -> np.ndarray:
    angles = 2 * np.pi * frequency * np.outer(times, np.arange(1, harmonics + 1))
    return np.hstack([np.ones((times.size, 1)), np.sin(angles), np.cos(angles)])


def harmonic_shares(population: WalkingPopulation, harmonics: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Return the best stride frequency (R,) and the share of variance of each harmonic (R, harmonics)."""
    frames = population.positions_mm.shape[1]
    times = np.arange(frames) / population.frame_rate_hz
    drift = np.vander(np.linspace(-1, 1, frames), 4)
    frequencies, shares = [], []
    for walk, guess in zip(population.positions_mm, each(population, "frequency"), strict=True):
        moving = walk.copy()
        path = walk[:, WALKER15.index("pelvis"), :2]
        moving[:, :, :2] -= (drift @ np.linalg.lstsq(drift, path)[0])[:, None]
        flat = moving.reshape(frames, -1)
        flat = flat - flat.mean(axis=0)

        def left_over(frequency: float, count: int, flat: np.ndarray = flat) -> float:
            basis, _ = np.linalg.qr(regression(times, frequency, count))
            return float((flat**2).sum() - ((basis.T @ flat) ** 2).sum())

        best = minimize_scalar(
            lambda f, rest=left_over: rest(f, 2), bounds=(0.85 * guess, 1.15 * guess), method="bounded"
        ).x
        left = [(flat**2).sum()] + [left_over(best, h) for h in range(1, harmonics + 1)]
        frequencies.append(best)
        shares.append(-np.diff(left) / left[0])
    return np.array(frequencies), np.array(shares)


def test_eighty_walkers_of_fifteen_joints_at_120_hz(walkers: WalkingPopulation) -> None:
    assert walkers.positions_mm.shape == (80, 960, 15, 3)
    assert walkers.positions_mm.dtype == np.float64
    assert np.isfinite(walkers.positions_mm).all()
    assert walkers.frame_rate_hz == 120.0
    assert walkers.male.sum() == 32
    assert (~walkers.male).sum() == 48
    assert len(walkers.people) == 80


def test_ages_and_statures_are_those_of_the_people_they_stand_for(walkers: WalkingPopulation) -> None:
    assert each(walkers, "age_years").min() >= 13
    assert each(walkers, "age_years").max() <= 59
    assert each(walkers, "age_years").mean() == pytest.approx(26, abs=3)
    grown = each(walkers, "age_years") >= 18
    for is_male, mean in ((True, 1755.8), (False, 1629.4)):
        statures = each(walkers, "body.stature")[grown & (walkers.male == is_male)]
        assert statures.mean() == pytest.approx(mean, abs=3.5 * 66 / np.sqrt(statures.size))
        assert 40 < statures.std() < 90
    assert np.all(np.abs(each(walkers, "body.leg_length") / each(walkers, "body.stature") - 0.53) < 0.06)


def test_bones_keep_their_length(clean: WalkingPopulation, walkers: WalkingPopulation) -> None:
    for parent, child in WALKER15.bones:
        for population, tolerance in ((clean, 1e-9), (walkers, 4 * np.sqrt(2) * NOISE_MM / np.sqrt(900))):
            bone = population.positions_mm[:, :, child] - population.positions_mm[:, :, parent]
            lengths = np.linalg.norm(bone, axis=-1)
            spread = lengths.std(axis=1)
            expected = 0.0 if population is clean else np.sqrt(2) * NOISE_MM
            assert np.all(np.abs(spread - expected) < tolerance + 0.02 * expected)


def test_right_is_to_the_right_and_the_head_is_up(walkers: WalkingPopulation) -> None:
    for part in ("shoulder", "hip"):
        assert np.all((joint(walkers, f"right_{part}") - joint(walkers, f"left_{part}"))[..., 0] > 100)
    order = ["head", "sternum", "pelvis", "left_knee"]
    heights = np.array([joint(walkers, name)[..., 2].mean(axis=1) for name in order])
    assert np.all(np.diff(heights, axis=0) < 0)
    assert np.allclose(heights[0] / each(walkers, "body.stature"), 0.93, atol=0.06)


def test_walkers_stay_on_the_belt(walkers: WalkingPopulation) -> None:
    assert np.abs(joint(walkers, "pelvis")[..., :2]).max() < 200


def test_the_walk_goes_forward(walkers: WalkingPopulation) -> None:
    # Against a belt that runs towards -y, a foot in the air moves towards +y.
    ankle = joint(walkers, "right_ankle")
    lifted = ankle[:, 1:, 2] > ankle[:, :, 2].mean(axis=1, keepdims=True) + 50
    steps = np.diff(ankle[..., 1], axis=1)
    assert all(step[high].mean() > 0 for step, high in zip(steps, lifted, strict=True))


def test_feet_take_turns(walkers: WalkingPopulation) -> None:
    distance = (joint(walkers, "left_ankle") - joint(walkers, "right_ankle"))[..., 1]
    frequencies, _ = harmonic_shares(walkers)
    crossings = (np.diff(np.sign(distance), axis=1) != 0).sum(axis=1)
    # Twice a stride, nothing in between; the ends may cut one off.
    assert np.all(np.abs(crossings - 2 * 8.0 * frequencies) < 2)
    assert np.all(np.abs(distance.max(axis=1) / -distance.min(axis=1) - 1) < 0.25)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_flat_foot_rides_on_the_belt(clean: WalkingPopulation, side: str) -> None:
    """An ankle at the height of a flat foot moves at the speed of the belt within 4 %, with a median of 2 %.

    What slip there is makes good the walker's drift along the belt.
    """
    ankle = joint(clean, f"{side}_ankle")
    velocity = np.diff(ankle[..., 1], axis=1) * clean.frame_rate_hz
    height = anthropometry.SEGMENTS["ankle_height"] * each(clean, "body.stature")[:, None]
    backward = velocity < -0.5 * each(clean, "speed")[:, None]
    low = (np.abs(ankle[:, 1:, 2] - height) < 4.0) & backward
    # The foot is flat in the middle of such a stretch; at its ends it still or already rolls.
    flat = minimum_filter1d(low, 11, axis=1)
    assert np.all(flat.mean(axis=1) > 0.08)
    for speed, frames, belt in zip(velocity, flat, each(clean, "speed"), strict=True):
        slip = np.abs(speed[frames] / belt + 1)
        assert np.median(slip) < 0.02
        assert np.quantile(slip, 0.95) < 0.04


def test_no_ankle_sinks_into_the_floor(clean: WalkingPopulation) -> None:
    for side in ("left", "right"):
        lowest = joint(clean, f"{side}_ankle")[..., 2].min(axis=1)
        assert np.all(lowest > anthropometry.SEGMENTS["ankle_height"] * each(clean, "body.stature") - 15)


@pytest.mark.parametrize("side", ["left", "right"])
def test_knees_bend_backwards_and_never_much_the_other_way(clean: WalkingPopulation, side: str) -> None:
    hip, knee, ankle = (joint(clean, f"{side}_{part}") for part in ("hip", "knee", "ankle"))
    thigh, shank = knee - hip, ankle - knee
    flexion = np.arctan2(thigh[..., 1], -thigh[..., 2]) - np.arctan2(shank[..., 1], -shank[..., 2])
    assert np.degrees(flexion).min() > -3
    swing = np.degrees(flexion).max(axis=1)
    assert np.all((swing > 45) & (swing < 80))
    assert swing.mean() == pytest.approx(61, abs=4)


@pytest.mark.parametrize("side", ["left", "right"])
def test_an_arm_swings_against_its_leg(walkers: WalkingPopulation, side: str) -> None:
    arm = (joint(walkers, f"{side}_wrist") - joint(walkers, "pelvis"))[..., 1]
    leg = (joint(walkers, f"{side}_ankle") - joint(walkers, "pelvis"))[..., 1]
    together = [np.corrcoef(a, b)[0, 1] for a, b in zip(arm, leg, strict=True)]
    assert np.max(together) < -0.6


def test_the_pelvis_sways_once_and_bobs_twice_a_stride(walkers: WalkingPopulation) -> None:
    times = np.arange(960) / 120
    for walk, frequency in zip(joint(walkers, "pelvis"), harmonic_shares(walkers)[0], strict=True):
        power = []
        for axis in (0, 2):
            path = walk[:, axis] - walk[:, axis].mean()
            fit = np.linalg.lstsq(regression(times, frequency, 2), path)[0]
            power.append((np.hypot(fit[1], fit[3]), np.hypot(fit[2], fit[4])))
        assert power[0][0] > 4 * power[0][1]
        assert power[1][1] > power[1][0]
        assert 5 < power[0][0] < 50
        assert 3 < power[1][1] < 30


def test_rhythm_follows_speed_and_size(walkers: WalkingPopulation) -> None:
    frequencies, _ = harmonic_shares(walkers)
    assert np.all((frequencies > 0.7) & (frequencies < 1.15))
    assert np.abs(frequencies / each(walkers, "frequency") - 1).max() < 0.05
    relative = each(walkers, "speed") / each(walkers, "body.stature")
    assert np.corrcoef(np.log(relative), np.log(frequencies))[0, 1] > 0.6


def test_there_is_more_than_two_harmonics(walkers: WalkingPopulation) -> None:
    """Two harmonics leave 0.2 to 6 % of the variance, and the third harmonic has more than 0.2 %."""
    _, shares = harmonic_shares(walkers)
    residual = 1 - shares[:, :2].sum(axis=1)
    assert np.all((residual > 0.002) & (residual < 0.06))
    assert np.all(shares[:, 2] > 0.002)
    assert shares[:, 2:].sum(axis=1).mean() > 0.004
    assert np.all(shares[:, 0] > 0.85)


def test_left_and_right_differ_a_little(clean: WalkingPopulation) -> None:
    swing = {}
    for side in ("left", "right"):
        heights = joint(clean, f"{side}_ankle")[..., 2]
        swing[side] = np.quantile(heights, 0.98, axis=1) - np.quantile(heights, 0.3, axis=1)
    ratio = np.abs(swing["left"] / swing["right"] - 1)
    assert np.all(ratio > 0)
    assert 0.005 < np.median(ratio) < 0.15
    thighs = [
        np.linalg.norm(joint(clean, f"{side}_knee") - joint(clean, f"{side}_hip"), axis=-1).mean(axis=1)
        for side in ("left", "right")
    ]
    assert 0.5 < np.std(thighs[0] - thighs[1]) < 8


def test_strides_vary_by_one_to_three_percent() -> None:
    long = walking_population(np.random.default_rng(3), male=4, female=6, duration_s=60.0, marker_noise_mm=0)
    distance = (joint(long, "left_ankle") - joint(long, "right_ankle"))[..., 1]
    variations = []
    for path in distance:
        frames = np.arange(path.size - 1)
        up = (path[:-1] < 0) & (path[1:] >= 0)
        moments = frames[up] + path[:-1][up] / (path[:-1][up] - path[1:][up])
        durations = np.diff(moments)
        variations.append(durations.std() / durations.mean())
    assert np.mean(variations) == pytest.approx(normative_gait.STRIDE_TIME_CV, abs=0.005)
    assert np.all((np.array(variations) > 0.007) & (np.array(variations) < 0.03))


def test_marker_noise_is_white_and_as_large_as_asked() -> None:
    still, noisy = (
        walking_population(np.random.default_rng(5), male=1, female=1, marker_noise_mm=noise)
        for noise in (0.0, 2.0)
    )
    noise = noisy.positions_mm - still.positions_mm
    assert noise.std() == pytest.approx(2.0, rel=0.02)
    assert abs(np.corrcoef(noise[:, 1:].ravel(), noise[:, :-1].ravel())[0, 1]) < 0.02


def test_the_same_seed_gives_the_same_people() -> None:
    first, second = (walking_population(np.random.default_rng(11), male=2, female=3) for _ in range(2))
    assert np.array_equal(first.positions_mm, second.positions_mm)
    generator = np.random.default_rng(11)
    assert np.array_equal(walking_population(generator, male=2, female=3).positions_mm, first.positions_mm)
    third = walking_population(generator, male=2, female=3)
    assert not np.allclose(third.positions_mm, first.positions_mm)


def test_few_walkers_are_the_first_of_many(walkers: WalkingPopulation) -> None:
    few = walking_population(np.random.default_rng(2007), male=5, female=7)
    assert few.male.tolist() == walkers.male[:12].tolist()
    assert np.array_equal(few.positions_mm, walkers.positions_mm[:12])
    assert np.array_equal(each(few, "body.stature"), each(walkers, "body.stature")[:12])


def test_a_short_recording_is_the_beginning_of_a_long_one(walkers: WalkingPopulation) -> None:
    short = walking_population(np.random.default_rng(2007), male=2, female=3, duration_s=4.0)
    assert short.positions_mm.shape[1] == 480
    assert np.array_equal(short.positions_mm, walkers.positions_mm[:5, :480])


@pytest.mark.parametrize(("male", "female"), [(0, 3), (3, 0), (4, 1), (1, 4)])
def test_any_mixture_of_men_and_women(male: int, female: int) -> None:
    some = walking_population(np.random.default_rng(1), male=male, female=female, duration_s=3.0)
    assert (some.male.sum(), (~some.male).sum()) == (male, female)
    assert np.unique(each(some, "body.stature")).size == male + female


@pytest.mark.parametrize("frame_rate_hz", [25.0, 100.0, 240.0])
def test_the_walk_does_not_depend_on_the_camera(frame_rate_hz: float) -> None:
    reference, other = (
        walking_population(
            np.random.default_rng(4), male=1, female=1, frame_rate_hz=rate, duration_s=4.0, marker_noise_mm=0
        )
        for rate in (1200.0, frame_rate_hz)
    )
    every = round(1200.0 / frame_rate_hz)
    # First frames lie one sampling interval after the start, hence the shift.
    matching = reference.positions_mm[:, every - 1 :: every]
    assert np.abs(other.positions_mm - matching).max() < 400 / frame_rate_hz


@pytest.mark.parametrize(
    ("arguments", "rejection"),
    [
        ({"male": 0, "female": 0}, rejects("out_of_range", "the number of walkers", value=0)),
        ({"male": -1}, rejects("out_of_range", "male", value=-1)),
        ({"marker_noise_mm": -0.5}, rejects("out_of_range", "marker_noise_mm", value=-0.5)),
        ({"marker_noise_mm": float("nan")}, rejects("out_of_range", "marker_noise_mm")),
        ({"duration_s": 1.0}, rejects("out_of_range", "duration_s of walker 0", value=1.0)),
        ({"duration_s": -1.0}, rejects("out_of_range", "duration_s", value=-1.0)),
        ({"duration_s": float("inf")}, rejects("out_of_range", "duration_s")),
        ({"frame_rate_hz": 5.0}, rejects("out_of_range", "frame_rate_hz", value=5.0)),
    ],
)
def test_bad_input_is_refused_in_one_sentence(arguments: dict, rejection: AbstractContextManager) -> None:
    with rejection as refusal:
        walking_population(np.random.default_rng(0), **arguments)
    assert "\n" not in str(refusal.value)
    assert refusal.value.received


@pytest.mark.parametrize("name", CURVES)
def test_every_curve_passes_through_its_landmarks_and_closes(name: str) -> None:
    curve = CURVES[name]
    phases, values = np.array(curve.phases), np.array(curve.mean_deg)
    assert np.all(np.diff(phases) > 0)
    assert np.allclose(curve.basis(phases) @ values, values)
    for order in (0, 1, 2):
        ends = curve.basis(np.array([phases[0], phases[0] + 1.0]), order) @ values
        assert ends[0] == pytest.approx(ends[1], abs=1e-8 * 10**order)
    # Between landmarks it overshoots them little.
    fine = curve.basis(np.linspace(0, 1, 400) % 1.0) @ values
    margin = 0.15 * np.ptp(values)
    assert values.min() - margin < fine.min()
    assert fine.max() < values.max() + margin


def test_a_persons_curve_is_the_basis_times_the_landmarks() -> None:
    person = draw_person(np.random.default_rng(8), male=True)
    phase = np.random.default_rng(9).uniform(-3, 9, (2, 50))
    for name in CURVES:
        expected = [person.basis(name, phase[s]) @ person.manner[name].values[s] for s in (0, 1)]
        assert np.allclose(person.curve(name, phase), expected)
