"""A population of walkers on a treadmill, made by kinematics alone.

No walker is drawn from a linear model of positions: each has a body (stature, proportions, the two sides
unlike), a speed and a rhythm, and joint angles through published landmarks with published spreads, all from
`pipeline.core.normative_gait`.  Positions follow by a chain of rigid segments.

How one walker walks
--------------------
1. Phase φ of each leg runs on with stride times that vary and remember; right and left half a cycle apart.
2. Thigh and knee angles at φ give the leg in its plane; the plane leans so that the ankle keeps to its line.
3. The standing foot rolls over heel, sole and ball and otherwise rides on the belt.  The pelvis is carried by
   the standing leg (while both stand, by both, in shares that change over smoothly): so it bobs and surges.
4. Before that, the drawn angles are moved as little as will let the feet keep to the floor and to the belt.
5. Pelvic sway, rotation and obliquity, the trunk, the head and the arms are added on top; then marker noise.

Legend: e thigh elevation, k knee flexion, l1 thigh, l2 shank.  Arrays are (space, side, frame) until the last
line of a walk; sides are ordered left, right.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.signal import lfilter

from pipeline.core import normative_gait as norm
from pipeline.core.normative_gait import SIDE, Person, draw_person
from pipeline.refusal import Refusal

LEAST_CYCLES = 1.5
LEAST_FRAME_RATE_HZ = 20.0
_STEP = 1e-5
"""Of finite differences, in radians or as a fraction."""

_FOOT_PITCH = PchipInterpolator(norm.FOOT_PHASES, np.radians(norm.FOOT_PITCH_DEG))


@dataclass(frozen=True)
class WalkingPopulation:
    """Walkers with known answers.

    Attributes
    ----------
    positions_mm : (R, T, 15, 3) float64
        WALKER15 order, world frame; the floor is z = 0 and the walkers stay about x = y = 0.
    frame_rate_hz : float
    male : (R,) bool
    stature_mm, age_years : (R,) float64
    leg_length_mm : (R,) float64
        Hip to floor, mean of the two sides.
    speed_mm_s : (R,) float64
        Of the belt, which moves towards −y.
    stride_frequency_hz : (R,) float64
        Intended; what eight seconds show differs by the stride-to-stride variability.
    """

    positions_mm: np.ndarray
    frame_rate_hz: float
    male: np.ndarray
    stature_mm: np.ndarray
    age_years: np.ndarray
    leg_length_mm: np.ndarray
    speed_mm_s: np.ndarray
    stride_frequency_hz: np.ndarray


def walking_population(
    generator: np.random.Generator,
    *,
    male: int = 32,
    female: int = 48,
    duration_s: float = 8.0,
    frame_rate_hz: float = 120.0,
    marker_noise_mm: float = 0.5,
) -> WalkingPopulation:
    """Walkers on a treadmill, men and women in the order of 2 to 3 while both last [zhang2007 section 2].

    Parameters
    ----------
    generator : numpy.random.Generator
        One number is drawn from it; every walker's own generators grow from that.  The k-th man and the k-th
        woman are the same people whatever the counts, and a shorter recording is the beginning of a longer.
    male, female : int
    duration_s : float
    frame_rate_hz : float
    marker_noise_mm : float
        Standard deviation of white noise on each coordinate.

    Returns
    -------
    WalkingPopulation

    Raises
    ------
    Refusal
        If there is nobody, a count or the noise is negative, the frame rate is under 20 Hz, or a walker makes
        less than 1.5 cycles in the time given.

    Examples
    --------
    >>> walkers = walking_population(np.random.default_rng(1), male=2, female=3, duration_s=3.0)
    >>> walkers.positions_mm.shape, walkers.male.tolist()
    ((5, 360, 15, 3), [False, True, False, True, False])
    """
    _refuse_bad_sizes(male, female, duration_s, frame_rate_hz, marker_noise_mm)
    frames = round(duration_s * frame_rate_hz)
    entropy = int(generator.integers(2**63))
    people: list[Person] = []
    positions = np.empty((male + female, frames, 15, 3))
    for number, (is_male, index) in enumerate(_order(male, female)):
        seeds = np.random.SeedSequence(entropy, spawn_key=(int(is_male), index)).spawn(3)
        traits, strides, noise = (np.random.default_rng(seed) for seed in seeds)
        person = _settled(draw_person(traits, is_male))
        if duration_s * person.frequency < LEAST_CYCLES:
            raise Refusal(
                "the recording is too short",
                where=f"walker {number}",
                expected=f"{LEAST_CYCLES} cycles, here {LEAST_CYCLES / person.frequency:.2f} s",
                received=f"{duration_s:g} s",
            )
        people.append(person)
        noise.standard_normal(out=positions[number])
        positions[number] *= marker_noise_mm
        positions[number] += _walk(person, strides, frames, frame_rate_hz)
    return WalkingPopulation(
        positions_mm=positions,
        frame_rate_hz=float(frame_rate_hz),
        male=np.array([p.male for p in people]),
        stature_mm=np.array([p.stature for p in people]),
        age_years=np.array([p.age_years for p in people]),
        leg_length_mm=np.array([p.leg_length for p in people]),
        speed_mm_s=np.array([p.speed for p in people]),
        stride_frequency_hz=np.array([p.frequency for p in people]),
    )


def _refuse_bad_sizes(male: int, female: int, duration_s: float, rate: float, noise: float) -> None:
    where = "synthetic walkers"
    if male < 0 or female < 0 or male + female == 0:
        raise Refusal(
            "there is nobody to walk",
            where=where,
            expected="counts of men and women, at least one in all",
            received=f"{male} and {female}",
        )
    for what, value, least, unit in (
        ("the duration is too short", duration_s, 0.0, "s"),
        ("the frame rate is too low", rate, LEAST_FRAME_RATE_HZ, "Hz"),
        ("the marker noise is negative", noise, 0.0, "mm"),
    ):
        if not (np.isfinite(value) and value >= least):
            raise Refusal(
                what, where=where, expected=f"{least:g} {unit} or more", received=f"{value:g} {unit}"
            )


def _order(male: int, female: int) -> list[tuple[bool, int]]:
    """(is male, index within the sex) in the fixed order F M F M F, then whoever is left."""
    order: list[tuple[bool, int]] = []
    taken = {True: 0, False: 0}
    wanted = {True: male, False: female}
    while len(order) < male + female:
        turn = len(order) % 5 in (1, 3)
        sex = turn if taken[turn] < wanted[turn] else not turn
        order.append((sex, taken[sex]))
        taken[sex] += 1
    return order


def _stopped(angle: np.ndarray, stop_deg: float) -> np.ndarray:
    """Flexion that ends smoothly at a joint's stop, radians."""
    stop, soft = np.radians(stop_deg), np.radians(norm.STOP_SOFTNESS_DEG)
    return stop + soft * np.logaddexp(0.0, (angle - stop) / soft)


def _opposed(person: Person, name: str, phase: np.ndarray) -> np.ndarray:
    """Half of right less left: a curve that changes sign when the sides change places, (T,)."""
    left, right = person.curve(name, phase)
    return (right - left) / 2.0


def _shared(person: Person, name: str, phase: np.ndarray) -> np.ndarray:
    """Mean of the sides: a curve that both steps repeat, (T,)."""
    left, right = person.curve(name, phase)
    return (left + right) / 2.0


def _rolling_foot(person: Person, phase: np.ndarray, gains: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far ahead of its place over a flat foot, and how high, the ankle is: two like `phase`, mm."""
    pitch = _FOOT_PITCH(phase % 1.0)
    pitch = pitch * np.where(pitch > 0, gains[0], gains[1])
    # The foot turns about its heel while the toes are up, about its ball while the heel is up.
    pivot = person.stature * np.where(pitch > 0, -norm.FOOT_HEEL, norm.FOOT_BALL)
    height = person.stature * norm.SEGMENTS["ankle_height"]
    sin, cos = np.sin(pitch), np.cos(pitch)
    return pivot - pivot * cos - height * sin, height * cos - pivot * sin


def _weights(phase: np.ndarray) -> np.ndarray:
    """Share of the body's weight on each leg, (2, T), summing to one."""
    within = phase % 1.0
    handover = norm.TOE_OFF - 0.5
    share = np.clip(np.minimum(within, norm.TOE_OFF - within) / handover, 0.0, 1.0)
    smooth = share**2 * (3.0 - 2.0 * share)
    return smooth / smooth.sum(axis=0)


def _hips(person: Person, phase: np.ndarray) -> np.ndarray:
    """Hips from the pelvis, (3, 2, T) mm."""
    yaw = _opposed(person, "pelvic_rotation", phase)
    roll = _opposed(person, "pelvic_obliquity", phase)
    axis = np.stack([np.cos(yaw) * np.cos(roll), np.sin(yaw) * np.cos(roll), np.sin(roll)])
    return person.half_hips * SIDE * axis[:, None]


def _sway(person: Person, phase: np.ndarray) -> np.ndarray:
    """Sideways path of the pelvis, (T,) mm."""
    return person.sway * np.degrees(_opposed(person, "pelvic_sway", phase))


def _settled(person: Person) -> Person:
    """The person nearest to the one drawn whose feet keep to the floor and to the belt.

    Angles drawn one by one do not fit a floor.  The landmark values of thigh and knee, the scale of the
    thigh's excursion (which sets the length of the stride), the foot's excursions, and the surge and bob of
    the pelvis are moved by Gauss–Newton least squares, each in units of its own standard deviation, until
    the standing ankles ride where a foot that rolls on the belt puts them.
    """
    stance = np.linspace(0.0, norm.FLOOR_UNTIL, 24)
    belt = person.speed / person.frequency * stance
    lag = np.array([[0.0], [0.5 + person.step_asymmetry]])
    thigh, knee = (person.manner[name].values for name in ("thigh", "knee"))
    thigh_basis, knee_basis = (person.basis(name, stance) for name in ("thigh", "knee"))
    centre = thigh.mean(axis=1)
    sizes = [thigh.shape[1]] * 2 + [knee.shape[1]] * 2 + [1, 2, 2, 4, 1, 6]
    *four, scale, gains, places, surge, level, bob = (
        slice(end - size, end) for size, end in zip(sizes, np.cumsum(sizes), strict=True)
    )
    thighs, knees = four[:2], four[2:]
    expected = np.zeros(sum(sizes))
    expected[surge] = norm.SURGE_MM
    sd = np.full(expected.size, person.stature)  # places on the belt and the pelvis's level are free
    sd[: knees[0].start] = np.radians(norm.SETTLING_SD_DEG["thigh"])
    sd[knees[0].start : scale.start] = np.radians(norm.SETTLING_SD_DEG["knee"])
    sd[scale], sd[gains] = norm.SETTLING_SCALE_SD, norm.FOOT_GAIN_CV
    sd[surge], sd[bob] = norm.SURGE_SD_MM, norm.BOB_SD_MM
    sides = []
    for side in (0, 1):
        clock = stance - lag[side]
        waves = np.stack([f(2.0 * np.pi * h * clock) for h in (1, 2, 4) for f in (np.sin, np.cos)], axis=1)
        hip = _hips(person, clock + lag)[:, side]
        across = person.ankle_lines[side] - _sway(person, clock + lag) - hip[0]
        sides.append((side, waves, hip, across))

    x = expected.copy()
    for _ in range(4):
        factor = person.foot_gains * (1.0 + x[gains])
        foot = _rolling_foot(person, stance, factor)
        more = [_rolling_foot(person, stance, factor + _STEP * one) for one in np.eye(2)]
        jacobian, residual = [np.diag(1.0 / sd)], [(x - expected) / sd]
        for side, waves, hip, across in sides:
            own = thigh_basis @ (thigh[side] - centre[side])
            e = centre[side] + (1.0 + x[scale]) * own + thigh_basis @ x[thighs[side]]
            free = knee_basis @ (knee[side] + x[knees[side]])
            k = _stopped(free, norm.KNEE_STOP_DEG)
            slope = (_stopped(free + _STEP, norm.KNEE_STOP_DEG) - k) / _STEP
            l1, l2 = person.thigh[side], person.shank[side]
            reach, length = l1 * np.sin(e) + l2 * np.sin(e - k), l1 * np.cos(e) + l2 * np.cos(e - k)
            upright = np.sqrt(1.0 - (across / length) ** 2)
            ahead = x[surge] @ waves[:, :4].T + belt - x[places][side] + hip[1] + reach - foot[0]
            above = x[level] + waves @ x[bob] + hip[2] - length * upright - foot[1]
            slopes = (length, -l2 * np.cos(e - k)), (reach * upright, -l2 * np.sin(e - k) * upright)
            for direction, (error, (by_thigh, by_knee)) in enumerate(
                zip((ahead, above), slopes, strict=True)
            ):
                rows = np.zeros((stance.size, x.size))
                rows[:, thighs[side]] = by_thigh[:, None] * thigh_basis
                rows[:, scale] = (by_thigh * own)[:, None]
                rows[:, knees[side]] = (by_knee * slope)[:, None] * knee_basis
                rows[:, gains] = np.stack([foot[direction] - m[direction] for m in more], axis=1)
                rows[:, gains] *= person.foot_gains / _STEP
                if direction == 0:
                    rows[:, surge], rows[:, places.start + side] = waves[:, :4], -1.0
                else:
                    rows[:, bob], rows[:, level] = waves, 1.0
                jacobian.append(rows / norm.FLOOR_SD_MM)
                residual.append(error / norm.FLOOR_SD_MM)
        j = np.vstack(jacobian)
        x -= np.linalg.solve(j.T @ j, j.T @ np.concatenate(residual))

    moved = {
        "thigh": centre[:, None] + (1.0 + x[scale]) * (thigh - centre[:, None]) + [x[s] for s in thighs],
        "knee": knee + [x[s] for s in knees],
    }
    manner = {n: replace(m, values=moved.get(n, m.values)) for n, m in person.manner.items()}
    return replace(person, manner=manner, foot_gains=person.foot_gains * (1.0 + x[gains]))


@dataclass(frozen=True)
class _Strides:
    """What changes from stride to stride, frame by frame: phases (2, T), gains, sideways shifts in mm."""

    phase: np.ndarray
    gains: dict[str, np.ndarray]
    foot: np.ndarray
    lane: np.ndarray


def _draw_strides(person: Person, rng: np.random.Generator, frames: int, rate: float) -> _Strides:
    """Phases and gains that vary with memory; a longer recording begins with a shorter one."""
    cycles = np.arange(frames) * person.frequency / rate
    # One row a stride, drawn in order; the spare ones cover strides that run ahead of the mean.
    rows = int(np.ceil(cycles[-1] * 1.2)) + 4
    fresh = rng.standard_normal((rows, 10))
    memory = np.full(10, norm.STRIDE_MEMORY)
    memory[9] = norm.BELT_WANDER_MEMORY
    memory[7:9] = 0.0
    steady = np.empty_like(fresh)
    for column, m in enumerate(memory):
        new = np.sqrt(1.0 - m**2)
        start = fresh[:1, column] * (1.0 - new)  # the first stride is as spread as all others
        steady[:, column], _ = lfilter([new], [1.0, -m], fresh[:, column], zi=start)
    knots = np.arange(rows)

    def at(place: np.ndarray, column: int) -> np.ndarray:
        return np.interp(place, knots, steady[:, column])

    # Interpolating between strides averages some of the variability away; restore its variance.
    slower = norm.STRIDE_TIME_CV * at(cycles, 0) / np.sqrt((2.0 + norm.STRIDE_MEMORY) / 3.0)
    left = person.start_phase + np.cumsum(person.frequency / rate / (1.0 + slower))
    phase = np.stack([left, left + 0.5 + person.step_asymmetry])
    leg, arm, trunk = (norm.STRIDE_GAIN_CV[part] for part in ("leg", "arm", "trunk"))
    gains = {
        "thigh": (1.0 + leg / 2.0 * at(left, 1)) * (1.0 + slower),
        "knee": np.stack([1.0 + leg * at(left, c) for c in (2, 3)]),
        "arm": np.stack([1.0 + arm * at(left, c) for c in (4, 5)]),
        "trunk": 1.0 + trunk * at(left, 6),
    }
    # A foot keeps its line while it stands and moves to the next one while it swings.
    foot = np.empty_like(phase)
    for side in (0, 1):
        stride = np.floor(phase[side] - norm.TOE_OFF).astype(int) + 1
        within = phase[side] % 1.0
        swing = np.where(within < norm.TOE_OFF, 1.0, (within - norm.TOE_OFF) / (1.0 - norm.TOE_OFF))
        lines = norm.FOOT_PLACEMENT_SD_MM * steady[:, 7 + side]
        before, after = lines[np.maximum(stride - 1, 0)], lines[stride]
        foot[side] = before + (after - before) * swing**2 * (3.0 - 2.0 * swing)
    return _Strides(phase, gains, foot, norm.BELT_WANDER_SD_MM * at(cycles, 9))


def _walk(person: Person, rng: np.random.Generator, frames: int, rate: float) -> np.ndarray:
    """Joint centres without noise, (T, 15, 3) mm."""
    strides = _draw_strides(person, rng, frames, rate)
    phase, gains = strides.phase, strides.gains

    # Legs: angles first, in each leg's own plane.
    thigh = person.curve("thigh", phase, gains["thigh"])
    knee = _stopped(person.curve("knee", phase, gains["knee"]), norm.KNEE_STOP_DEG)
    reach = person.thigh * np.sin(thigh) + person.shank * np.sin(thigh - knee)
    length = person.thigh * np.cos(thigh) + person.shank * np.cos(thigh - knee)

    # The sideways lean of each leg's plane keeps its ankle on its line.
    hips = _hips(person, phase)
    sway = gains["trunk"] * _sway(person, phase)
    lean = np.arcsin((person.ankle_lines + strides.foot - sway - hips[0]) / length)

    # The standing leg carries the pelvis; on a belt, a walker makes good what drift remains.
    weights = _weights(phase)
    shift, ankle_height = _rolling_foot(person, phase, person.foot_gains)
    height = (weights * (ankle_height + length * np.cos(lean) - hips[2])).sum(axis=0)
    between = (weights[:, 1:] + weights[:, :-1]) / 2.0
    steps = (between * np.diff(shift - hips[1] - reach, axis=1)).sum(axis=0) - person.speed / rate
    surge = lfilter([1.0], [1.0, 1.0 / (rate * norm.BELT_RETURN_S) - 1.0], np.append(0.0, steps))
    pelvis = np.stack([sway + strides.lane, surge, height])

    hips = pelvis[:, None] + hips
    ankles = hips + np.stack([length * np.sin(lean), reach, -length * np.cos(lean)])
    knees = hips + _knees(person, thigh, knee, lean)
    sternum, head, shoulders, thorax_yaw = _upper_body(person, phase, gains["trunk"], pelvis)
    elbows, wrists = _arms(person, phase, gains["arm"], thorax_yaw, shoulders)
    left, right = 0, 1
    return np.stack(
        [
            head,
            sternum,
            *(joint[:, left] for joint in (shoulders, elbows, wrists)),
            *(joint[:, right] for joint in (shoulders, elbows, wrists)),
            pelvis,
            *(joint[:, left] for joint in (hips, knees, ankles)),
            *(joint[:, right] for joint in (hips, knees, ankles)),
        ]
    ).transpose(2, 0, 1)


def _knees(person: Person, thigh: np.ndarray, knee: np.ndarray, lean: np.ndarray) -> np.ndarray:
    """Knees from their hips, (3, 2, T) mm: bent forward of the line hip–ankle, and turned out about it."""
    # In the leg's plane: how far the thigh is turned from the line hip–ankle.
    bend = np.arctan2(person.shank * np.sin(knee), person.thigh + person.shank * np.cos(knee))
    inclination = thigh - bend
    sin, cos = np.sin(inclination), np.cos(inclination)
    line = np.stack([cos * np.sin(lean), sin, -cos * np.cos(lean)])
    forward = np.stack([-sin * np.sin(lean), cos, sin * np.cos(lean)])
    outward = SIDE * np.stack([np.cos(lean), np.zeros_like(lean), np.sin(lean)])
    turned = np.cos(person.knee_out) * forward + np.sin(person.knee_out) * outward
    return person.thigh * (np.cos(bend) * line + np.sin(bend) * turned)


def _upper_body(
    person: Person, phase: np.ndarray, gain: np.ndarray, pelvis: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Sternum (3, T), head (3, T), shoulders (3, 2, T) in mm and the thorax's rotation (T,)."""

    def direction(forward: np.ndarray, sideways: np.ndarray) -> np.ndarray:
        return np.stack(
            [np.sin(sideways), np.sin(forward) * np.cos(sideways), np.cos(forward) * np.cos(sideways)]
        )

    lean = _opposed(person, "trunk_sway", phase) * gain
    up = direction(_shared(person, "trunk_lean", phase), lean)
    sternum = pelvis + person.trunk * up
    # The head keeps nearly upright sideways: it takes a third of the trunk's lean.
    head = sternum + person.head * direction(_shared(person, "head_lean", phase), lean / 3.0)
    yaw = _opposed(person, "thorax_rotation", phase) * gain
    roll = _opposed(person, "thorax_obliquity", phase) * gain
    axis = np.stack([np.cos(yaw) * np.cos(roll), np.sin(yaw) * np.cos(roll), np.sin(roll)])
    axis = axis - (axis * up).sum(axis=0) * up
    axis = axis / np.linalg.norm(axis, axis=0)
    middle = sternum - person.shoulder_drop * up
    return sternum, head, middle[:, None] + person.half_shoulders * SIDE * axis[:, None], yaw


def _arms(
    person: Person, phase: np.ndarray, gain: np.ndarray, yaw: np.ndarray, shoulders: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Elbows and wrists, each (3, 2, T) mm, swinging in planes that turn with the thorax."""
    swing = person.curve("upper_arm", phase, gain)
    bend = _stopped(person.curve("elbow", phase, gain), norm.ELBOW_STOP_DEG)
    still = np.zeros_like(yaw)
    outward = SIDE * np.stack([np.cos(yaw), np.sin(yaw), still])[:, None]
    ahead = np.stack([-np.sin(yaw), np.cos(yaw), still])[:, None]
    upward = np.array([0.0, 0.0, 1.0])[:, None, None]
    hanging = np.sin(swing) * ahead - np.cos(swing) * upward
    forward = np.cos(swing) * ahead + np.sin(swing) * upward
    upper_arm = np.cos(person.arm_out) * hanging + np.sin(person.arm_out) * outward
    inward = np.sin(person.arm_out) * hanging - np.cos(person.arm_out) * outward
    turned = np.cos(person.forearm_in) * forward + np.sin(person.forearm_in) * inward
    elbows = shoulders + person.upper_arm * upper_arm
    return elbows, elbows + person.forearm * (np.cos(bend) * upper_arm + np.sin(bend) * turned)
