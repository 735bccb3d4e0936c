"""Synthetic population of people who walk on a treadmill, computed from their joint angles.

No walker is drawn from a linear model of positions.  Each has a body (stature, proportions, asymmetry), a speed, a
stride frequency, and joint angles through published landmarks with published standard deviations.  Positions follow
from a chain of rigid segments.

Steps
-----
1. `person` draws a person from the numbers of `core.anthropometry` and `normative_gait`.
2. `footfall` corrects the angles as little as possible, so that the feet stay on the floor and move with the belt.
3. `strides` draws the phase φ of each leg, with correlated stride times; left and right are half a cycle apart.
4. `kinematics` computes the legs in their planes from thigh and knee angles at φ; the plane leans so that the ankle
   stays on its line.
5. The standing foot rolls over heel, sole and ball, and moves with the belt.  The position of the pelvis follows from
   the standing leg.  In double support it follows from both legs, with smoothly changing weights.
6. Pelvic sway, rotation and obliquity, trunk, head and arms are added, then marker noise.

Sensitivity to assumptions
--------------------------
The standard deviations of constant offsets of joint angles are assumed, not published, and results depend on them.
With static yaw and obliquity of the pelvis added, the best sigma² of zhang2007 figure 3 moved from 23 to 39 mm².
`offsets` scales them all; ``make sensitivity`` tabulates the verdicts at 0, 0.5 and 1.5 times.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.shortened import shortened
from pipeline.synthetic.walkers.footfall import keep_to_floor
from pipeline.synthetic.walkers.kinematics import walk
from pipeline.synthetic.walkers.person import Person, draw_person
from pipeline.synthetic.walkers.strides import draw_strides
from pipeline.validation import require_count, require_range

MIN_CYCLES = 1.5
"""Smallest number of gait cycles that a recording must contain."""

MIN_FRAME_RATE_HZ = 20.0


@shortened
class WalkingPopulation:
    """Recordings of synthetic walkers, with each walker's true body and gait.

    Attributes
    ----------
    positions_mm : (R, T, 15, 3) float64
        Joint positions in WALKER15 order, world frame; the floor is z = 0, and the walkers stay near x = y = 0.
    frame_rate_hz : float
    male : (R,) bool
    people : tuple of R Person
        The walkers.  Their speed is that of the belt, which moves towards −y.  The frequency of a recording differs
        from theirs by the stride-to-stride variability.
    """

    positions_mm: np.ndarray
    frame_rate_hz: float
    male: np.ndarray
    people: tuple[Person, ...]


def walking_population(
    generator: np.random.Generator,
    *,
    male: int = 32,
    female: int = 48,
    duration_s: float = 8.0,
    frame_rate_hz: float = 120.0,
    marker_noise_mm: float = 0.5,
    offsets: float = 1.0,
) -> WalkingPopulation:
    """Generate walkers on a treadmill; by default 32 men and 48 women [zhang2007 section 2].

    Parameters
    ----------
    generator : numpy.random.Generator
        Generator of the seed of the population.  The k-th man and the k-th woman are the same people for any counts,
        and a shorter recording is the beginning of a longer one.
    male, female : int
    duration_s : float
    frame_rate_hz : float
    marker_noise_mm : float
        Standard deviation of white noise on each coordinate.
    offsets : float
        Factor on the assumed standard deviations of constant offsets of joint angles.

    Raises
    ------
    InvalidInput
        If there are no walkers, a count or the noise is negative, the frame rate is below 20 Hz, or a walker has less
        than 1.5 cycles.

    Examples
    --------
    >>> walkers = walking_population(np.random.default_rng(1), male=2, female=3, duration_s=3.0)
    >>> walkers.positions_mm.shape, walkers.male.tolist()
    ((5, 360, 15, 3), [False, True, False, True, False])
    """
    people, walks = zip(
        *(
            walker(member, duration_s, frame_rate_hz, marker_noise_mm, offsets)
            for member in members(generator, male=male, female=female)
        ),
        strict=True,
    )
    return WalkingPopulation(
        positions_mm=np.stack(walks),
        frame_rate_hz=float(frame_rate_hz),
        male=np.array([p.male for p in people]),
        people=people,
    )


@dataclass(frozen=True)
class Member:
    """Identity of a synthetic walker: number in the population, seed, sex, and number within the sex."""

    number: int
    entropy: int
    male: bool
    index: int


def members(generator: np.random.Generator, *, male: int, female: int) -> list[Member]:
    """Return the identities of all walkers of a synthetic population.

    Women and men follow each other in the order F M F M F, until those of one sex are used up.
    """
    require_count("male", male, at_least=0)
    require_count("female", female, at_least=0)
    require_range("the number of walkers", male + female, at_least=1)
    entropy = int(generator.integers(2**63))
    order: list[Member] = []
    counts = {True: 0, False: 0}
    totals = {True: male, False: female}
    while len(order) < male + female:
        turn = len(order) % 5 in (1, 3)
        sex = turn if counts[turn] < totals[turn] else not turn
        order.append(Member(len(order), entropy, sex, counts[sex]))
        counts[sex] += 1
    return order


def walker(
    member: Member, duration_s: float, frame_rate_hz: float, marker_noise_mm: float, offsets: float
) -> tuple[Person, np.ndarray]:
    """Generate a synthetic walker and the recorded walk (T, 15, 3), mm.

    The arguments are those of `walking_population`.
    """
    require_range("duration_s", duration_s, above=0)
    require_range("frame_rate_hz", frame_rate_hz, at_least=MIN_FRAME_RATE_HZ)
    require_range("marker_noise_mm", marker_noise_mm, at_least=0)
    require_range("offsets", offsets, at_least=0)
    seeds = np.random.SeedSequence(member.entropy, spawn_key=(int(member.male), member.index)).spawn(3)
    traits, strides, noise = (np.random.default_rng(seed) for seed in seeds)
    person = keep_to_floor(draw_person(traits, member.male, offsets))
    shortest_s = MIN_CYCLES / person.frequency
    require_range(f"duration_s of walker {member.number}", duration_s, at_least=shortest_s, unit="s")
    frames = round(duration_s * frame_rate_hz)
    positions = noise.standard_normal((frames, 15, 3))
    positions *= marker_noise_mm
    positions += walk(person, draw_strides(person, strides, frames, frame_rate_hz), frame_rate_hz)
    return person, positions
