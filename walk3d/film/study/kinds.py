"""Film as people make it: somebody stands first, the hand shakes, the frame rate is told wrong, nobody walks at all.

Each clip goes the whole way of a film: tracks of people, the part that is a walk, other frame rates, a verdict.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from pipeline.clips.kinds import Walks
from walk3d.film.simulation.activities import Activity, perform, with_standing
from walk3d.film.simulation.filmed import about_pelvis, belt_speed_mm_s, lasting
from walk3d.film.simulation.keypoints import DetectorError, Filming, SimulatedKeypoints, simulate_keypoints
from walk3d.film.walk import Prior, TrainingWalk, errors
from walk3d.film.walk.calibration import KIND_OF
from walk3d.film.walk.film import Film, Stretch, best_of, watch
from walk3d.film.walk.sagittal_angles import KINDS as ANGLES
from walk3d.film.walk.tracks import find_tracks

STRIDES, OTHERWISE_S = 2.4, 2.4
"""Strides of a walk, and seconds of anything else."""
STILL_S = 1.2
"""Somebody stands so long before and after."""
FAR_MM = (6000.0, 8000.0)
"""Distance of the camera from somebody who walks off."""
WRONG = 0.15
"""Share by which a stride's length in frames may be off before it is another harmonic's."""
IN_THE_WAY = 0.25
"""Share of a height, across the picture, within which somebody who is nearer hides another."""
HALF_WIDTH_PX = 960.0
_KNEES = ANGLES.index("knee") == KIND_OF


@dataclass(frozen=True, kw_only=True)
class FilmKind:
    """A kind of film.

    Attributes
    ----------
    kind, level : str
    error : DetectorError
    frame_rate_hz, told : float
        Frame rate, and the one that is told over it.
    activity : Activity or None
        None: somebody walks.
    stands, crossed : bool
        Whether the walker stands before and after; whether somebody else crosses the picture.
    """

    kind: str
    level: str = ""
    error: DetectorError = field(default_factory=DetectorError)
    frame_rate_hz: float = 30.0
    stated: float = 1.0
    activity: Activity | None = None
    stands: bool = False
    crossed: bool = False

    @property
    def name(self) -> str:
        """Kind and level in words."""
        return f"{self.kind}: {self.level}" if self.level else self.kind


FILM_KINDS = (
    FilmKind(kind="stands, walks, stands", stands=True),
    FilmKind(kind="shake", level="25 px", error=DetectorError(shake_px=25.0)),
    FilmKind(kind="noise", level="8 + 8 px", error=DetectorError(white_px=8.0, slow_px=8.0)),
    FilmKind(kind="frame rate told", level="2 times", stated=2.0),
    FilmKind(kind="frame rate told", level="half", frame_rate_hz=60.0, stated=0.5),
    FilmKind(kind="slow motion", level="4 times", frame_rate_hz=60.0, stated=0.25),
    FilmKind(kind="crossed by somebody", crossed=True),
    *(FilmKind(kind=str(activity), activity=activity) for activity in Activity),
)
"""Films of walks, and of what is none."""


def film_as(
    kind: FilmKind,
    generator: np.random.Generator,
    walks: Walks,
    number: int,
    walk: TrainingWalk,
    heading_rad: float,
    overground: bool,
) -> SimulatedKeypoints:
    """Film one walk of a corpus, or somebody with the limbs of its walker who does something else."""
    recorded, rate = about_pelvis(walks, number), walks.frame_rate_hz[number]
    positions = lasting(recorded, rate, STRIDES)
    speed = belt_speed_mm_s(walk) if overground or kind.stands else 0.0
    filming = Filming(heading_rad=heading_rad, speed_mm_s=speed, frame_rate_hz=kind.frame_rate_hz)
    if kind.stands:
        positions = with_standing(positions, rate, speed, STILL_S)
        filming = Filming(
            heading_rad=heading_rad, distance_mm=FAR_MM, drift_mm_s=0.0, frame_rate_hz=kind.frame_rate_hz
        )
    if kind.activity is not None:
        positions = perform(kind.activity, generator, recorded, rate, OTHERWISE_S)
        filming = Filming(heading_rad=heading_rad, frame_rate_hz=kind.frame_rate_hz)
    return simulate_keypoints(generator, positions, rate, filming, kind.error)


def crossing(
    generator: np.random.Generator, walks: Walks, number: int, walk: TrainingWalk, one: SimulatedKeypoints
) -> list[SimulatedKeypoints]:
    """A walker and somebody else who crosses the picture; where they meet, who is farther is hidden."""
    filming = Filming(
        heading_rad=generator.choice([-0.5, 0.5]) * np.pi,
        speed_mm_s=belt_speed_mm_s(walk),
        person_px=generator.uniform(350.0, 850.0),
        frame_rate_hz=one.frame_rate_hz,
    )
    rate = walks.frame_rate_hz[number]
    positions = lasting(about_pelvis(walks, number), rate, 2.0 * STRIDES)
    other = simulate_keypoints(generator, positions, rate, filming, DetectorError())
    T = min(len(one.pixels), len(other.pixels))
    middle = slice((len(other.pixels) - T) // 2, (len(other.pixels) - T) // 2 + T)
    both = [one.pixels[:T].copy(), other.pixels[middle].copy()]
    across = [np.nanmedian(pixels[..., 0], axis=1) for pixels in both]
    height = [np.nanmax(pixels[T // 2, :, 1]) - np.nanmin(pixels[T // 2, :, 1]) for pixels in both]
    both[np.argmin(height)][np.abs(across[0] - across[1]) < IN_THE_WAY * max(height)] = np.nan
    both[1][np.abs(across[1]) > HALF_WIDTH_PX] = np.nan
    return [
        replace(one, pixels=both[0], positions_mm=one.positions_mm[:T]),
        replace(other, pixels=both[1], positions_mm=other.positions_mm[middle]),
    ]


@dataclass(frozen=True)
class Seen:
    """What was made of one film.

    Attributes
    ----------
    verdict : str
    wrong_frequency : bool
        Whether a walk was found with the stride of another harmonic.
    error_mm, knee_error_deg : float
        Of a walk that was found; else NaN.
    """

    verdict: str
    wrong_frequency: bool
    error_mm: float
    knee_error_deg: float


def see(people: list[SimulatedKeypoints], frequencies_hz: list[float], stated: float, prior: Prior) -> Seen:
    """Look for a walk in the keypoints of everybody, and compare it with the truth of whom it is of."""
    length, rate = len(people[0].pixels), stated * people[0].frame_rate_hz
    rows = np.concatenate([one.pixels for one in people])
    frame = np.tile(np.arange(length), len(people))
    track = find_tracks(frame, np.full(len(rows), ""), rows, rate)[0]
    who = int(np.median(track.rows)) // length
    filmed, first = people[who], int(track.frame[0])
    pixels = np.full((track.frame[-1] - first + 1, *rows.shape[1:]), np.nan)
    pixels[track.frame - first] = rows[track.rows]
    sure = np.isfinite(pixels).all(axis=-1).astype(float)
    watched = watch(
        Film(pixels, sure, rate, filmed.focal_px, prior, first, both_labellings=False, focal_sd=0.0)
    )
    best = best_of(watched.stretches)
    if not best.walks:
        return Seen(str(best.judgement.verdict), False, np.nan, np.nan)
    per_frame = best.fitted.candidates[0].frequency_hz / watched.frame_rate_hz
    off = per_frame * filmed.frame_rate_hz / frequencies_hz[who] - 1.0
    return Seen(str(best.judgement.verdict), bool(abs(off) > WRONG), *_errors(best, filmed))


def _errors(stretch: Stretch, filmed: SimulatedKeypoints) -> tuple[float, float]:
    """Mean distance of the joints, mm, and root mean square error of the knees, degrees."""
    estimate = stretch.fitted.positions_mm
    truth = filmed.positions_mm[stretch.first_frame : stretch.last_frame + 1]
    found = errors.level_angles(estimate, errors.headings(stretch.fitted))
    off = np.degrees(found - errors.level_angles(truth, filmed.heading_rad))[:, _KNEES]
    return errors.mean_distance_mm(estimate, truth), np.sqrt((off**2).mean())
