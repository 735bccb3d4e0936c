"""Reconstruction of one person's walking from the keypoints of a film: stretches, verdicts and frame rate.

Standing before and after a walk is left out, and a path is cut where it turns.  If a stretch is not a walk as a whole,
windows of it are tried.  If no stretch is a walk at the stated frame rate, other rates are tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.shortened import shortened
from pipeline.validation import InvalidInput
from walk3d.film.walk.objective import FOCAL_SD
from walk3d.film.walk.prior import Prior
from walk3d.film.walk.reconstruction import Reconstruction, reconstruct_followed
from walk3d.film.walk.start import absolute_angle
from walk3d.film.walk.tracks import moving_parts, straight_stretches
from walk3d.film.walk.verdict import MAX_DISTANCE, SLOW_STRIDE_HZ, Judgement, Verdict, judge

MAX_STRETCH_S = 20.0
"""Maximum duration of a reconstructed stretch, s; longer stretches are cut to their middle part."""
MAX_STRETCHES = 4
WINDOW_S, MAX_WINDOWS = 3.0, 12
"""Duration, s, and maximum number of windows that divide a stretch that as a whole is not a walk.

Neighbouring windows overlap by half.
"""
MIN_WINDOW_STRIDES = 1.5
"""Minimum number of strides of an accepted window; with many windows, a single stride may fit by chance."""
DISTANCE_FACTOR = 2.0
"""Factor on `MAX_DISTANCE`; windows whose images are farther from all walkers are not refined.

The limit also applies to stretches at other frame rates.
"""
HEADING_TOLERANCE_RAD = np.radians(40.0)
"""Difference in heading, rad, below which neighbouring windows with a walk are joined to one stretch."""
ALTERNATIVE_RATES = (2.0, 4.0, 0.5)
"""Factors on the stated frame rate that are tried if no clear walk is found.

The film may be in slow motion, or the file may state half or twice the true rate.

The walk with the smallest residual is chosen.  The last factor is tried only if no other gives a walk.
"""
MAX_RETRIED_STRETCHES = 2
"""Maximum number of stretches that are tried at each alternative frame rate."""
MAX_RESIDUAL_SHARE = 0.6
"""Ratio of residuals below which a walk at another frame rate replaces a doubtful or very short walk.

The ratio is the residual of the walk at the other frame rate over that of the doubtful or very short walk.
"""
PERIOD_TOLERANCE = 0.1
"""Relative difference below which two stride periods count as equal."""
RATE_STRIDE_HZ, RATE_STRIDES = (0.7, 1.3), 2.0
"""Range of stride frequencies, Hz, and minimum number of strides, of a walk that is accepted at another frame rate."""


@shortened
class Stretch:
    """One straight stretch of a person's path, with its reconstruction and verdict.

    Attributes
    ----------
    first_frame, last_frame : int
        First and last frame in the video, both included.
    pixels : (T, 15, 2)
        Keypoints of the joints, relative to the principal point; NaN where missing.
    reconstruction : Reconstruction or None
        None if nothing could be fitted.
    judgement : Judgement
    feet_together : bool
        True if nothing was fitted because the feet move together.
    """

    first_frame: int
    last_frame: int
    pixels: np.ndarray
    reconstruction: Reconstruction | None
    judgement: Judgement
    feet_together: bool = False

    @property
    def frames(self) -> np.ndarray:
        """Indices (T,) of the frames in the video."""
        return np.arange(self.first_frame, self.last_frame + 1)

    @property
    def walks(self) -> bool:
        """True if the verdict on the stretch is a walk or a doubtful walk."""
        return self.judgement.verdict != Verdict.not_a_walk

    @property
    def fitted(self) -> Reconstruction:
        """Reconstruction of a stretch that is a walk or a doubtful walk."""
        assert self.reconstruction is not None
        return self.reconstruction


@dataclass(frozen=True)
class Film:
    """Keypoints of one person throughout a video.

    Attributes
    ----------
    pixels : (T, 15, 2)
        px from the principal point; NaN where missing.
    confidence : (T, 15)
        0 where missing.
    frame_rate_hz, focal_px : float
    prior : Prior
    first : int
        Number of the first frame.
    both_labellings : bool
        True: left and right exchanged throughout are tried as well.
    focal_sd : float
        Standard deviation of the logarithm of the focal length; 0 if it is known.
    """

    pixels: np.ndarray
    confidence: np.ndarray
    frame_rate_hz: float
    focal_px: float
    prior: Prior
    first: int = 0
    both_labellings: bool = True
    focal_sd: float = FOCAL_SD

    def stretch(self, start: int, stop: int, *, quick: bool = False) -> Stretch:
        """Reconstruct the stretch from frame `start` to frame `stop` (exclusive), and judge if it is a walk.

        With `quick`, exchanged labels are not tried, and images that are far from all walkers are not refined.
        """
        pixels = self.pixels[start:stop]
        reconstruction, together = None, False
        try:
            reconstruction = reconstruct_followed(
                pixels,
                (self.confidence[start:stop] > 0).astype(float),
                self.frame_rate_hz,
                self.focal_px,
                self.prior,
                both_labellings=self.both_labellings and not quick,
                focal_sd=self.focal_sd,
                max_distance=DISTANCE_FACTOR * MAX_DISTANCE if quick else np.inf,
            )
            judgement = judge(reconstruction)
        except InvalidInput as refusal:
            judgement, together = (
                Judgement(Verdict.not_a_walk, (str(refusal),)),
                refusal.code == "feet_together",
            )
        first, last = self.first + start, self.first + stop - 1
        return Stretch(first, last, pixels, reconstruction, judgement, together)

    def parts(self) -> list[tuple[int, int]]:
        """Return the parts of the film in which the legs move on a straight path, the longest first.

        A part is its first frame and the frame after its last.
        """
        parts = []
        for start, stop in moving_parts(self.pixels, self.frame_rate_hz):
            straight = straight_stretches(
                self.pixels[start:stop], self.prior.mean[:, 2, 0], self.frame_rate_hz, self.focal_px
            )
            parts += [(start + a, start + b) for a, b in straight]
        return sorted(parts, key=lambda part: (part[0] - part[1], part[0]))

    def walking_parts(self, start: int, stop: int) -> list[Stretch]:
        """Return the stretches of walking within a range of frames that as a whole is not a walk.

        An example is a turn while the camera follows.

        Windows are reconstructed separately; neighbouring walks with one heading are joined.
        """
        length = round(WINDOW_S * self.frame_rate_hz)
        if stop - start < 1.5 * length:
            return []
        count = min(int(np.ceil(2.0 * (stop - start - length) / length)) + 1, MAX_WINDOWS)
        starts = np.linspace(start, stop - length, count).round().astype(int).tolist()
        fixed_focal = replace(self, focal_sd=0.0)  # a short window does not determine the focal length
        windows = [fixed_focal.stretch(a, a + length, quick=True) for a in starts]
        groups: list[list[int]] = []
        for number, window in enumerate(windows):
            if not window.walks or window.fitted.strides < MIN_WINDOW_STRIDES:
                continue
            last = groups[-1][-1] if groups else -2
            if last == number - 1 and _turn(windows[last], window) < HEADING_TOLERANCE_RAD:
                groups[-1].append(number)
            else:
                groups.append([number])
        groups.sort(key=lambda g: (-len(g), g[0]))
        parts = []
        for group in groups[:MAX_STRETCHES]:
            part = self.stretch(starts[group[0]], starts[group[-1]] + length)
            if not part.walks:
                part = self.stretch(starts[group[0]], starts[group[0]] + length)
            if part.walks and part.fitted.strides >= MIN_WINDOW_STRIDES:
                parts.append(part)
        return sorted(parts, key=lambda s: (-len(s.pixels), s.first_frame))


@dataclass(frozen=True)
class FilmResult:
    """Reconstructed stretches of one person in a film.

    Attributes
    ----------
    stretches : tuple of Stretch
        The longest first.
    frame_rate_hz : float
        The stated rate, or another one at which this is a walk.
    notes : tuple of str
        Remarks on omitted or unusual parts, one sentence each.
    """

    stretches: tuple[Stretch, ...]
    frame_rate_hz: float
    notes: tuple[str, ...] = ()

    @property
    def walks(self) -> bool:
        """True if at least one stretch is or may be a walk."""
        return any(stretch.walks for stretch in self.stretches)


def best_of(stretches: Sequence[Stretch]) -> Stretch:
    """Return the stretch with the best verdict; if several stretches have this verdict, return the first one."""
    order = list(Verdict)
    return min(stretches, key=lambda stretch: order.index(stretch.judgement.verdict))


def reconstruct_film(film: Film) -> FilmResult:
    """Find the walking in a film, reconstruct it, and judge the result.

    Other frame rates are tried if there is no clear walk.

    A very slow walk is replaced by one at another rate if that fits better and has another period: in slow motion from
    the front, a step may pass for a stride.  With the same period it stays, because it may be slow.  A doubtful or very
    short walk is replaced if another rate fits much better: a third of a slow stride may pass for a stride.
    """
    as_given = _reconstruct_parts(film)
    walked = [stretch for stretch in as_given.stretches if stretch.walks]
    slow = bool(walked) and _stride_hz(walked[0]) < SLOW_STRIDE_HZ
    if any(_is_sure(stretch) for stretch in walked) and not slow:
        return as_given
    if all(stretch.feet_together for stretch in as_given.stretches):
        return as_given
    others = [replace(film, frame_rate_hz=factor * film.frame_rate_hz) for factor in ALTERNATIVE_RATES]
    retried: list[tuple[Stretch, Film]] = []
    for other in others:
        if other.frame_rate_hz < film.frame_rate_hz and any(np.isfinite(_residual_px(s)) for s, _ in retried):
            break
        retried += [
            (other.stretch(start, stop, quick=True), other)
            for start, stop in other.parts()[:MAX_RETRIED_STRETCHES]
            if (stop - start - 1) / other.frame_rate_hz * RATE_STRIDE_HZ[1] >= RATE_STRIDES
        ]
    stretch, other = min(retried, key=lambda rate: _residual_px(rate[0]), default=(None, film))
    if stretch is None or not np.isfinite(_residual_px(stretch)):
        return as_given
    if walked:
        nearer = (
            _residual_px(stretch) < (1.0 if slow else MAX_RESIDUAL_SHARE) * walked[0].fitted.rms_residual_px
        )
        frames = film.frame_rate_hz / _stride_hz(walked[0]), other.frame_rate_hz / _stride_hz(stretch)
        if not nearer or abs(frames[0] / frames[1] - 1.0) < PERIOD_TOLERANCE:
            return as_given
    result = _reconstruct_parts(other, stretch)
    why = f"no walk at {film.frame_rate_hz:g} frames per second, but one at {other.frame_rate_hz:g}"
    stretches = tuple(_doubted(stretch, why) for stretch in result.stretches)
    note = f"The frame rate is assumed to be {other.frame_rate_hz:g} Hz: {why}. Give input.frame_rate_hz."
    return FilmResult(stretches, other.frame_rate_hz, (note, *result.notes))


def _residual_px(stretch: Stretch) -> float:
    """Return the residual, px, of a stretch that is a clear walk of usual cadence; otherwise return infinity."""
    plain = (
        stretch.judgement.verdict == Verdict.walk
        and stretch.fitted.strides >= RATE_STRIDES
        and RATE_STRIDE_HZ[0] <= _stride_hz(stretch) <= RATE_STRIDE_HZ[1]
    )
    return stretch.fitted.rms_residual_px if plain else np.inf


def _is_sure(stretch: Stretch) -> bool:
    """Return True if the stretch is a clear walk of at least `MIN_WINDOW_STRIDES` strides."""
    return stretch.judgement.verdict == Verdict.walk and stretch.fitted.strides >= MIN_WINDOW_STRIDES


def _stride_hz(stretch: Stretch) -> float:
    return float(stretch.fitted.candidates[0].frequency_hz)


def _doubted(stretch: Stretch, why: str) -> Stretch:
    if not stretch.walks:
        return stretch
    return replace(stretch, judgement=Judgement(Verdict.doubtful, (why, *stretch.judgement.reasons)))


def _reconstruct_parts(film: Film, quick: Stretch | None = None) -> FilmResult:
    """Reconstruct each part of a film in which the legs move on a straight path.

    The stretch `quick` is reused for its part, unless exchanged labels must be tried.
    """
    notes: list[str] = []
    T, first = len(film.pixels), film.first
    moving, parts = moving_parts(film.pixels, film.frame_rate_hz), film.parts()
    if moving != [(0, T)]:
        notes.append(f"The legs move in frames {_frames(moving, first)}; the rest was ignored.")
    if len(parts) > len(moving) or (moving == [(0, T)] and parts != moving):
        notes.append(
            f"The path is not straight throughout: frames {_frames(parts, first)} were reconstructed."
        )
    finished = {(s.first_frame, s.last_frame): s for s in (quick,) if s and not film.both_labellings}
    longest = round(MAX_STRETCH_S * film.frame_rate_hz)
    stretches: list[Stretch] = []
    for start, stop in parts[:MAX_STRETCHES]:
        if stop - start > longest:
            spare = stop - start - longest
            start, stop = start + spare // 2, start + spare // 2 + longest
            notes.append(f"Only the middle {MAX_STRETCH_S:g} s of a long stretch are used.")
        stretch = finished.get((first + start, first + stop - 1)) or film.stretch(start, stop)
        walked = [] if stretch.walks else film.walking_parts(start, stop)
        if walked:
            words = ", ".join(f"{s.first_frame} to {s.last_frame}" for s in walked)
            notes.append(
                f"Frames {first + start} to {first + stop - 1} are not one walk, but these parts are: {words}."
            )
        stretches += walked or [stretch]
    return FilmResult(tuple(stretches), film.frame_rate_hz, tuple(notes))


def _frames(parts: Sequence[tuple[int, int]], first: int) -> str:
    return ", ".join(f"{first + a} to {first + b - 1}" for a, b in sorted(parts))


def _turn(stretch: Stretch, other: Stretch) -> float:
    return absolute_angle(stretch.fitted.candidates[0].heading_rad - other.fitted.candidates[0].heading_rad)
