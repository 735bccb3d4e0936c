"""A whole film of one person: the parts in which somebody walks, each reconstructed and judged, and the frame rate.

Who stands before or after is left out, a path is cut where it turns, and where a stretch is no walk as a whole, walking
is looked for in windows.  If nobody walks at the frame rate that is told, others are tried.
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
from walk3d.film.walk.start import apart
from walk3d.film.walk.tracks import moving_parts, straight_stretches
from walk3d.film.walk.verdict import MOST_DISTANCE, SLOW_STRIDE_HZ, Judgement, Verdict, judge

LONGEST_S = 20.0
"""A longer stretch is cut to its middle part."""
MOST_STRETCHES = 4
WINDOW_S, MOST_WINDOWS = 3.0, 12
"""Length and number of windows in which walking is looked for where a whole stretch is none; they overlap by half."""
WINDOW_STRIDES = 1.5
"""Strides that a window needs: of many windows one may fit a single stride by chance."""
FAR_OFF = 2.0
"""Times the largest distance of a walk: of windows, and at other frame rates, nothing farther is refined."""
ONE_HEADING_RAD = np.radians(40.0)
OTHER_RATES = (2.0, 4.0, 0.5)
"""Factors on the frame rate that are tried if nobody walks: slow motion, and rates that were halved or doubled.

The walk that is nearest to its image counts; the last is tried if no other gives one."""
MOST_TRIED = 2
"""Stretches that are tried so."""
MUCH_NEARER = 0.6
"""Share of the residual of a doubtful walk, or of one of hardly a stride, below which another frame rate's counts."""
SAME_PERIOD = 0.1
"""Share by which two periods that are one may differ."""
RATE_STRIDE_HZ, RATE_STRIDES = (0.7, 1.3), 2.0
"""Strides a second, and strides, that a walk at another frame rate must have to be believed."""


@shortened
class Stretch:
    """One straight stretch of a walk.

    Attributes
    ----------
    first_frame, last_frame : int
        Of the video, both included.
    pixels : (T, 15, 2)
        Keypoints of the joints, relative to the principal point; NaN where missing.
    found : Reconstruction or None
        None if nothing could be fitted.
    judgement : Judgement
    feet_together : bool
        Whether nothing was fitted because the feet move together.
    """

    first_frame: int
    last_frame: int
    pixels: np.ndarray
    found: Reconstruction | None
    judgement: Judgement
    feet_together: bool = False

    @property
    def frames(self) -> np.ndarray:
        """Frames (T,) of the video."""
        return np.arange(self.first_frame, self.last_frame + 1)

    @property
    def walks(self) -> bool:
        """Whether this is or may be a walk."""
        return self.judgement.verdict != Verdict.not_a_walk

    @property
    def fitted(self) -> Reconstruction:
        """What was fitted, where something was, as it is of all that is or may be a walk."""
        assert self.found is not None
        return self.found


@dataclass(frozen=True)
class Film:
    """Keypoints of one person throughout a video.

    Attributes
    ----------
    pixels : (T, 15, 2)
        Relative to the principal point; NaN where missing.
    confidence : (T, 15)
        0 where missing.
    frame_rate_hz, focal_px : float
    prior : Prior
    first : int
        Number of the first frame.
    both_labellings : bool
        Whether left and right exchanged throughout is tried, too.
    focal_sd : float
        Of the logarithm of the focal length; 0: it is known.
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
        """Reconstruct frames from `start` to `stop` (exclusive); `quick`: as labelled, and nothing that is far off."""
        pixels = self.pixels[start:stop]
        found, together = None, False
        try:
            found = reconstruct_followed(
                pixels,
                (self.confidence[start:stop] > 0).astype(float),
                self.frame_rate_hz,
                self.focal_px,
                self.prior,
                both_labellings=self.both_labellings and not quick,
                focal_sd=self.focal_sd,
                most_distance=FAR_OFF * MOST_DISTANCE if quick else np.inf,
            )
            judgement = judge(found)
        except InvalidInput as refusal:
            judgement, together = (
                Judgement(Verdict.not_a_walk, (str(refusal),)),
                refusal.code == "feet_together",
            )
        first, last = self.first + start, self.first + stop - 1
        return Stretch(first, last, pixels, found, judgement, together)

    def parts(self) -> list[tuple[int, int]]:
        """Parts in which the legs move and the path is straight: frames from and to (exclusive), the longest first."""
        found = []
        for start, stop in moving_parts(self.pixels, self.frame_rate_hz):
            straight = straight_stretches(
                self.pixels[start:stop], self.prior.mean[:, 2, 0], self.frame_rate_hz, self.focal_px
            )
            found += [(start + a, start + b) for a, b in straight]
        return sorted(found, key=lambda part: (part[0] - part[1], part[0]))

    def walking_parts(self, start: int, stop: int) -> list[Stretch]:
        """Parts that are a walk, of frames that are none as a whole: somebody turned before a camera that follows.

        Windows of some three strides are reconstructed alone; neighbours that are walks with one heading are joined.
        """
        length = round(WINDOW_S * self.frame_rate_hz)
        if stop - start < 1.5 * length:
            return []
        count = min(int(np.ceil(2.0 * (stop - start - length) / length)) + 1, MOST_WINDOWS)
        starts = np.linspace(start, stop - length, count).round().astype(int).tolist()
        held = replace(self, focal_sd=0.0)  # three seconds say little of a focal length
        windows = [held.stretch(a, a + length, quick=True) for a in starts]
        groups: list[list[int]] = []
        for number, window in enumerate(windows):
            if not window.walks or window.fitted.strides < WINDOW_STRIDES:
                continue
            last = groups[-1][-1] if groups else -2
            if last == number - 1 and _turn(windows[last], window) < ONE_HEADING_RAD:
                groups[-1].append(number)
            else:
                groups.append([number])
        groups.sort(key=lambda g: (-len(g), g[0]))
        parts = []
        for group in groups[:MOST_STRETCHES]:
            part = self.stretch(starts[group[0]], starts[group[-1]] + length)
            if not part.walks:
                part = self.stretch(starts[group[0]], starts[group[0]] + length)
            if part.walks and part.fitted.strides >= WINDOW_STRIDES:
                parts.append(part)
        return sorted(parts, key=lambda s: (-len(s.pixels), s.first_frame))


@dataclass(frozen=True)
class Watched:
    """What a film of one person shows.

    Attributes
    ----------
    stretches : tuple of Stretch
        The longest first.
    frame_rate_hz : float
        The one that was told, or another at which this is a walk.
    notes : tuple of str
        What was left out or is odd, a sentence each.
    """

    stretches: tuple[Stretch, ...]
    frame_rate_hz: float
    notes: tuple[str, ...] = ()

    @property
    def walks(self) -> bool:
        """Whether one of the stretches is or may be a walk."""
        return any(stretch.walks for stretch in self.stretches)


def best_of(stretches: Sequence[Stretch]) -> Stretch:
    """The first of the stretches with the best verdict."""
    order = list(Verdict)
    return min(stretches, key=lambda stretch: order.index(stretch.judgement.verdict))


def watch(film: Film) -> Watched:
    """Find, reconstruct and judge the walking in a film; if there is none, at other frame rates, too.

    A walk that is too slow counts as none if one at another rate is nearer to the image and has another period: of slow
    motion from the front a step may pass for a stride.  With the same period it may be slow, or slow motion.  So does
    one that is doubtful or of hardly a stride, if another is much nearer: a third of a slow stride may pass for one.
    """
    as_given = _watch(film)
    walked = [stretch for stretch in as_given.stretches if stretch.walks]
    slow = bool(walked) and _stride_hz(walked[0]) < SLOW_STRIDE_HZ
    if any(_sure(stretch) for stretch in walked) and not slow:
        return as_given
    if all(stretch.feet_together for stretch in as_given.stretches):
        return as_given
    others = [replace(film, frame_rate_hz=factor * film.frame_rate_hz) for factor in OTHER_RATES]
    tried: list[tuple[Stretch, Film]] = []
    for other in others:
        if other.frame_rate_hz < film.frame_rate_hz and any(np.isfinite(_off(s)) for s, _ in tried):
            break
        tried += [
            (other.stretch(start, stop, quick=True), other)
            for start, stop in other.parts()[:MOST_TRIED]
            if (stop - start - 1) / other.frame_rate_hz * RATE_STRIDE_HZ[1] >= RATE_STRIDES
        ]
    stretch, other = min(tried, key=lambda rate: _off(rate[0]), default=(None, film))
    if stretch is None or not np.isfinite(_off(stretch)):
        return as_given
    if walked:
        nearer = _off(stretch) < (1.0 if slow else MUCH_NEARER) * walked[0].fitted.rms_residual_px
        frames = film.frame_rate_hz / _stride_hz(walked[0]), other.frame_rate_hz / _stride_hz(stretch)
        if not nearer or abs(frames[0] / frames[1] - 1.0) < SAME_PERIOD:
            return as_given
    watched = _watch(other, stretch)
    why = f"at {film.frame_rate_hz:g} frames a second nobody walks, at {other.frame_rate_hz:g} somebody does"
    stretches = tuple(_doubted(stretch, why) for stretch in watched.stretches)
    note = f"The frame rate is taken to be {other.frame_rate_hz:g} Hz: {why}. Give the true one."
    return Watched(stretches, other.frame_rate_hz, (note, *watched.notes))


def _off(stretch: Stretch) -> float:
    """Residual of a walk of a usual cadence that nothing speaks against, px; infinite of anything else."""
    plain = (
        stretch.judgement.verdict == Verdict.walk
        and stretch.fitted.strides >= RATE_STRIDES
        and RATE_STRIDE_HZ[0] <= _stride_hz(stretch) <= RATE_STRIDE_HZ[1]
    )
    return stretch.fitted.rms_residual_px if plain else np.inf


def _sure(stretch: Stretch) -> bool:
    """Whether this is a walk without doubt, of more than a stride."""
    return stretch.judgement.verdict == Verdict.walk and stretch.fitted.strides >= WINDOW_STRIDES


def _stride_hz(stretch: Stretch) -> float:
    return float(stretch.fitted.candidates[0].frequency_hz)


def _doubted(stretch: Stretch, why: str) -> Stretch:
    if not stretch.walks:
        return stretch
    return replace(stretch, judgement=Judgement(Verdict.doubtful, (why, *stretch.judgement.reasons)))


def _watch(film: Film, quick: Stretch | None = None) -> Watched:
    """Reconstruct the parts of a film; one that was looked at quickly is taken from there, if that was all."""
    notes: list[str] = []
    T, first = len(film.pixels), film.first
    moving, parts = moving_parts(film.pixels, film.frame_rate_hz), film.parts()
    if moving != [(0, T)]:
        notes.append(f"The legs move in frames {_frames(moving, first)}; the rest is left out.")
    if len(parts) > len(moving) or (moving == [(0, T)] and parts != moving):
        notes.append(
            f"The path is not straight throughout: reconstructed are frames {_frames(parts, first)}."
        )
    known = {(s.first_frame, s.last_frame): s for s in (quick,) if s and not film.both_labellings}
    longest = round(LONGEST_S * film.frame_rate_hz)
    stretches: list[Stretch] = []
    for start, stop in parts[:MOST_STRETCHES]:
        if stop - start > longest:
            spare = stop - start - longest
            start, stop = start + spare // 2, start + spare // 2 + longest
            notes.append(f"Of a long stretch the middle {LONGEST_S:g} s are used.")
        stretch = known.get((first + start, first + stop - 1)) or film.stretch(start, stop)
        walked = [] if stretch.walks else film.walking_parts(start, stop)
        if walked:
            words = ", ".join(f"{s.first_frame} to {s.last_frame}" for s in walked)
            notes.append(
                f"Frames {first + start} to {first + stop - 1} are not one walk; parts of them are: {words}."
            )
        stretches += walked or [stretch]
    return Watched(tuple(stretches), film.frame_rate_hz, tuple(notes))


def _frames(parts: Sequence[tuple[int, int]], first: int) -> str:
    return ", ".join(f"{first + a} to {first + b - 1}" for a, b in sorted(parts))


def _turn(one: Stretch, other: Stretch) -> float:
    return apart(one.fitted.candidates[0].heading_rad - other.fitted.candidates[0].heading_rad)
