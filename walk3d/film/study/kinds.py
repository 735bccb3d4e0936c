"""Kinds of amateur film, such as a pause before the walk, a shaking hand, a wrong frame rate, or no walk at all.

Each clip is processed like a real film: tracks of people, walking parts, other frame rates, a verdict.
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
from walk3d.film.walk.film import Film, Stretch, best_of, reconstruct_film
from walk3d.film.walk.sagittal_angles import KINDS as ANGLES
from walk3d.film.walk.tracks import find_tracks

STRIDES, ACTIVITY_S = 2.4, 2.4
"""Number of strides of a walk, and duration of any other activity, s."""
STANDING_S = 1.2
"""Time, s, for which a person stands before and after a walk."""
FAR_MM = (6000.0, 8000.0)
"""Range of distances, mm, between the camera and a person who stands and then walks."""
FREQUENCY_TOLERANCE = 0.15
"""Relative error of the stride frequency above which the estimate counts as another harmonic of the true frequency."""
OCCLUSION_SHARE = 0.25
"""Horizontal distance between two people in the image below which the nearer person hides the other.

It is relative to the larger of the two heights in the image.
"""
HALF_WIDTH_PX = 960.0
_KNEES = ANGLES.index("knee") == KIND_OF


@dataclass(frozen=True, kw_only=True)
class FilmKind:
    """Kind of amateur film: detector, frame rate, and what the person does.

    Attributes
    ----------
    kind, level : str
    error : DetectorError
    frame_rate_hz, stated : float
        True frame rate, and the stated rate over it.
    activity : Activity or None
        Activity of the person; None: walking.
    stands, crossed : bool
        True if the walker stands before and after; True if another person crosses the picture.
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
        """Name of the kind of film: its kind and level, in words."""
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
"""All kinds of amateur film: films of walks, then films of other activities."""


def film_as(
    kind: FilmKind,
    generator: np.random.Generator,
    walks: Walks,
    number: int,
    walk: TrainingWalk,
    heading_rad: float,
    overground: bool,
) -> SimulatedKeypoints:
    """Simulate an amateur film of one walk in a corpus, or of another activity of a person with the same limbs."""
    recorded, rate = about_pelvis(walks, number), walks.frame_rate_hz[number]
    positions = lasting(recorded, rate, STRIDES)
    speed = belt_speed_mm_s(walk) if overground or kind.stands else 0.0
    filming = Filming(heading_rad=heading_rad, speed_mm_s=speed, frame_rate_hz=kind.frame_rate_hz)
    if kind.stands:
        positions = with_standing(positions, rate, speed, STANDING_S)
        filming = Filming(
            heading_rad=heading_rad, distance_mm=FAR_MM, drift_mm_s=0.0, frame_rate_hz=kind.frame_rate_hz
        )
    if kind.activity is not None:
        positions = perform(kind.activity, generator, recorded, rate, ACTIVITY_S)
        filming = Filming(heading_rad=heading_rad, frame_rate_hz=kind.frame_rate_hz)
    return simulate_keypoints(generator, positions, rate, filming, kind.error)


def crossing(
    generator: np.random.Generator, walks: Walks, number: int, walk: TrainingWalk, walker: SimulatedKeypoints
) -> list[SimulatedKeypoints]:
    """Return the simulated keypoints of a walker and of a second person who crosses the image.

    Where the two people meet, the farther person is hidden.
    """
    filming = Filming(
        heading_rad=generator.choice([-0.5, 0.5]) * np.pi,
        speed_mm_s=belt_speed_mm_s(walk),
        person_px=generator.uniform(350.0, 850.0),
        frame_rate_hz=walker.frame_rate_hz,
    )
    rate = walks.frame_rate_hz[number]
    positions = lasting(about_pelvis(walks, number), rate, 2.0 * STRIDES)
    other = simulate_keypoints(generator, positions, rate, filming, DetectorError())
    T = min(len(walker.pixels), len(other.pixels))
    middle = slice((len(other.pixels) - T) // 2, (len(other.pixels) - T) // 2 + T)
    both = [walker.pixels[:T].copy(), other.pixels[middle].copy()]
    across = [np.nanmedian(pixels[..., 0], axis=1) for pixels in both]
    height = [np.nanmax(pixels[T // 2, :, 1]) - np.nanmin(pixels[T // 2, :, 1]) for pixels in both]
    both[np.argmin(height)][np.abs(across[0] - across[1]) < OCCLUSION_SHARE * max(height)] = np.nan
    both[1][np.abs(across[1]) > HALF_WIDTH_PX] = np.nan
    return [
        replace(walker, pixels=both[0], positions_mm=walker.positions_mm[:T]),
        replace(other, pixels=both[1], positions_mm=other.positions_mm[middle]),
    ]


@dataclass(frozen=True)
class Seen:
    """Result of the reconstruction of one amateur film.

    Attributes
    ----------
    verdict : str
    wrong_frequency : bool
        True if the walk has the stride of another harmonic.
    error_mm, knee_error_deg : float
        Errors of the reconstructed walk; NaN without one.
    """

    verdict: str
    wrong_frequency: bool
    error_mm: float
    knee_error_deg: float


def see(people: list[SimulatedKeypoints], frequencies_hz: list[float], stated: float, prior: Prior) -> Seen:
    """Find a walk in the keypoints of all people of a film, and compare its reconstruction with the ground truth."""
    length, rate = len(people[0].pixels), stated * people[0].frame_rate_hz
    rows = np.concatenate([person.pixels for person in people])
    frame = np.tile(np.arange(length), len(people))
    track = find_tracks(frame, np.full(len(rows), ""), rows, rate)[0]
    number = int(np.median(track.rows)) // length
    filmed, first = people[number], int(track.frame[0])
    pixels = np.full((track.frame[-1] - first + 1, *rows.shape[1:]), np.nan)
    pixels[track.frame - first] = rows[track.rows]
    sure = np.isfinite(pixels).all(axis=-1).astype(float)
    result = reconstruct_film(
        Film(pixels, sure, rate, filmed.focal_px, prior, first, both_labellings=False, focal_sd=0.0)
    )
    best = best_of(result.stretches)
    if not best.walks:
        return Seen(str(best.judgement.verdict), False, np.nan, np.nan)
    per_frame = best.fitted.candidates[0].frequency_hz / result.frame_rate_hz
    off = per_frame * filmed.frame_rate_hz / frequencies_hz[number] - 1.0
    return Seen(str(best.judgement.verdict), bool(abs(off) > FREQUENCY_TOLERANCE), *_errors(best, filmed))


def _errors(stretch: Stretch, filmed: SimulatedKeypoints) -> tuple[float, float]:
    """Return the mean distance of joints from ground truth, mm, and the root mean square error of knees, degrees."""
    estimate = stretch.fitted.positions_mm
    truth = filmed.positions_mm[stretch.first_frame : stretch.last_frame + 1]
    angles = errors.level_angles(estimate, errors.headings(stretch.fitted))
    off = np.degrees(angles - errors.level_angles(truth, filmed.heading_rad))[:, _KNEES]
    return errors.mean_distance_mm(estimate, truth), np.sqrt((off**2).mean())
