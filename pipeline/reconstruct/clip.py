"""From a file of keypoints to reconstructed stretches: what was recognised, who walks, and what was left out."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from pipeline.core.keypoint_walk import Detector, Prior, Reconstruction, prepare, reconstruct_followed
from pipeline.core.keypoint_walk.calibration import UNKNOWN_LAYOUT, Calibration
from pipeline.core.keypoint_walk.objective import FOCAL_SD
from pipeline.core.keypoint_walk.verdict import Judgement, Verdict, judge
from pipeline.formats import keypoints
from pipeline.formats.keypoints import Detections
from pipeline.processes import one_thread
from pipeline.reconstruct import layouts, model_file
from pipeline.reconstruct.image import in_pixels, upside_down
from pipeline.reconstruct.layouts import Layout
from pipeline.reconstruct.people import SHORTEST_S, Track, choose, find_tracks, straight_stretches
from pipeline.shortened import shortened
from pipeline.validation import InvalidInput, require_range

FOCAL_SHARE = 0.75
"""Focal length over the longer side of the image from which the fit starts, where it is not known: between a
telephone's and a camcorder's."""
LONGEST_S = 20.0
"""A longer stretch is cut to its middle part."""
MOST_STRETCHES = 4
MOST_OTHERS = 3
"""Tracks that are tried after the longest, if it is no walk and nobody is named."""
WINDOW_S, MOST_WINDOWS = 3.0, 12
ONE_HEADING_RAD = np.radians(40.0)
"""Length and number of windows in which walking is looked for where a whole stretch is none; they overlap by half."""
POSSIBLE = {
    "frame_rate_hz": (5.0, 1000.0), "focal_px": (10.0, 1e6), "stature_mm": (400.0, 2500.0), "width": (16, 100_000),
    "height": (16, 100_000),
}  # fmt: skip
"""Ranges of what may be known of a video; 0 is not known."""
USUAL_CADENCE_HZ = (0.6, 1.3)
"""Stride frequencies outside of which a wrong frame rate is more likely than such a walk."""


class Labels(StrEnum):
    """Whether the detector's left and right are believed."""

    both = "both"
    """Exchanged throughout is tried, too."""
    as_given = "as_given"


@dataclass(kw_only=True)
class Input:
    """Keypoints to be reconstructed, and what is known of the video."""

    path: str = ""  # file of keypoints
    frame_rate_hz: float = 0.0  # 0: as the file says
    layout: str = ""  # coco17, halpe26, body25, …; empty: recognised
    person: str = ""  # identity in the file, or a number by length of track; empty: the longest track
    width: int = 0  # of the image, px; 0: as the file says
    height: int = 0  # of the image, px; 0: as the file says
    focal_px: float = 0.0  # 0: not known, and found with the walk
    stature_mm: float = 0.0  # 0: not known; then nothing is in true millimetres
    least_confidence: float = 0.3  # keypoints below it are not used
    labels: Labels = Labels.both


@shortened
@dataclass(frozen=True)
class Stretch:
    """One straight stretch of a walk.

    Attributes
    ----------
    first_frame, last_frame : int
        Of the video, both included.
    pixels : (T, 15, 2)
        Keypoints of the joints, relative to the principal point; NaN where missing.
    confidence : (T, 15)
    found : Reconstruction or None
        None if nothing could be fitted.
    judgement : Judgement
    """

    first_frame: int
    last_frame: int
    pixels: np.ndarray
    confidence: np.ndarray
    found: Reconstruction | None
    judgement: Judgement


@shortened
@dataclass(frozen=True)
class Walk:
    """What a file of keypoints shows.

    Attributes
    ----------
    source : Detections
    layout : Layout
    recognised : str
        Why this layout.
    tracks : tuple of Track
        Everybody, the longest first.
    track : Track
        Who was reconstructed.
    frame_rate_hz, focal_px : float
    focal_known : bool
        Otherwise `focal_px` is where the search for it began; each stretch has found its own.
    centre_px : (2,)
        Principal point.
    prior : Prior
    calibration : Calibration
    bars_factor : float
        Bars are widened by this for the layout.
    stretches : tuple of Stretch
        The longest first.
    notes : tuple of str
    """

    source: Detections
    layout: Layout
    recognised: str
    tracks: tuple[Track, ...]
    track: Track
    frame_rate_hz: float
    focal_px: float
    focal_known: bool
    centre_px: np.ndarray
    prior: Prior
    calibration: Calibration
    bars_factor: float
    stretches: tuple[Stretch, ...]
    notes: tuple[str, ...] = field(default=())

    @property
    def best(self) -> Stretch:
        """The longest stretch with the best verdict."""
        order = list(Verdict)
        return min(self.stretches, key=lambda s: order.index(s.judgement.verdict))


@functools.lru_cache(maxsize=4)
def _prior(folder: Path, layout: str) -> tuple[Prior, Calibration]:
    trained = model_file.load(folder)
    detector: Detector = layouts.layouts()[layout].detector
    return prepare(trained.model, detector), trained.calibration


def reconstruct_clip(given: Input, model: Path = model_file.SHIPPED) -> Walk:
    """Reconstruct the walk that a file or folder of keypoints shows.

    Parameters
    ----------
    given : Input
    model : Path
        Folder of the model of walkers.

    Raises
    ------
    InvalidInput
        If the file cannot be read or recognised, the frame rate is not known, or there is no such person.
    """
    with one_thread():
        return _reconstruct_clip(given, model)


def _reconstruct_clip(given: Input, model: Path) -> Walk:
    if not given.path:
        raise InvalidInput("must name a file or folder of keypoints", where="input.path", received="nothing")
    for name, (least, most) in POSSIBLE.items():
        if value := getattr(given, name):
            require_range(f"input.{name}", value, at_least=least, at_most=most)
    require_range("input.least_confidence", given.least_confidence, at_least=0, below=1)
    source = keypoints.read(given.path)
    notes = list(source.notes)
    rate = _rate(given, source, notes)
    layout, order, recognised = layouts.recognise(source, given.layout)
    pixels, confidence = layouts.to_joints(layout, order, source)
    size = (given.width or source.image_size[0], given.height or source.image_size[1])
    pixels, size = in_pixels(pixels, size, notes)
    focal = given.focal_px or FOCAL_SHARE * max(size)
    centre = np.array(size) / 2.0
    pixels = pixels - centre
    _leave_out_doubtful(pixels, confidence, given.least_confidence, notes)
    tracks = find_tracks(source.frame, source.identity, pixels, rate)
    prior, calibration = _prior(model, layout.name)

    def reconstructed(track: Track, said: list[str]) -> list[Stretch]:
        return _stretches(track, pixels, confidence, rate, focal, prior, given, said)

    track, stretches = _walking_track(tracks, given.person, rate, reconstructed, notes)
    walk = Walk(
        source=source,
        layout=layout,
        recognised=recognised,
        tracks=tuple(tracks),
        track=track,
        frame_rate_hz=rate,
        focal_px=focal,
        focal_known=bool(given.focal_px),
        centre_px=centre,
        prior=prior,
        calibration=calibration,
        bars_factor=1.0 if layout.measured else UNKNOWN_LAYOUT,
        stretches=tuple(stretches),
    )
    return replace(walk, notes=(*notes, *_doubts(walk)))


def _rate(given: Input, source: Detections, notes: list[str]) -> float:
    """Frames a second, as given or as the file has them."""
    rate = given.frame_rate_hz or source.frame_rate_hz
    if not rate:
        raise InvalidInput(
            "the frame rate is not known", where="input.frame_rate_hz", expected="frames per second"
        )
    if source.frame_rate_hz and abs(rate / source.frame_rate_hz - 1) > 0.01:
        notes.append(
            f"The file says {source.frame_rate_hz:g} frames a second; {rate:g} was given and is used."
        )
    return rate


def _leave_out_doubtful(pixels: np.ndarray, confidence: np.ndarray, least: float, notes: list[str]) -> None:
    """Empty keypoints (n, 15, 2) below the least confidence, and turn rows that are counted upwards, in place."""
    doubtful = confidence < least * np.nanmax(confidence)
    if share := float((doubtful & np.isfinite(pixels).all(axis=-1)).mean()):
        percent = f"{100 * share:.0f}" if share >= 0.005 else "Less than 1"
        notes.append(f"{percent} % of the keypoints are below the least confidence and are not used.")
    pixels[doubtful], confidence[doubtful] = np.nan, 0.0
    if upside_down(pixels):
        pixels[..., 1] *= -1.0
        notes.append("Heads are below feet: rows were counted upwards, and are turned.")


def _walking_track(
    tracks: list[Track],
    person: str,
    rate: float,
    reconstructed: Callable[[Track, list[str]], list[Stretch]],
    notes: list[str],
) -> tuple[Track, list[Stretch]]:
    """The track that is named, or the longest; or, if that is no walk, the first of the others that is one."""
    track, told = choose(tracks, person), list[str]()
    stretches = reconstructed(track, told)
    if not person and not _walks(stretches):
        # Who is longest in the picture may stand in it while somebody else walks through.
        others = [other for other in tracks if other is not track and len(other.rows) >= SHORTEST_S * rate]
        for other in others[:MOST_OTHERS]:
            told_of_other: list[str] = []
            found = reconstructed(other, told_of_other)
            if _walks(found):
                notes.append(
                    f"The longest track (frames {track.frame[0]} to {track.frame[-1]}) is no walk;"
                    f" the one of frames {other.frame[0]} to {other.frame[-1]} is."
                )
                track, stretches, told = other, found, told_of_other
                break
    left_out = [other for other in tracks if other is not track and len(other.rows) >= 5]
    if left_out:
        notes.append(
            f"{len(left_out)} other tracks of people were left out, the longest of {len(left_out[0].rows)} frames"
            f" (frames {left_out[0].frame[0]} to {left_out[0].frame[-1]})."
        )
    notes += told
    return track, stretches


def _doubts(walk: Walk) -> Iterator[str]:
    """What was assumed of the keypoints, the camera and the frame rate."""
    rate, best = walk.frame_rate_hz, walk.best.found
    if walk.bars_factor > 1:
        yield f"Joint definitions of {walk.layout.name} were not measured: bars are {UNKNOWN_LAYOUT} times wider."
    if not walk.focal_known:
        how = (
            f"{best.focal_px:.0f} px was found with the walk"
            if best and best.focal_found
            else "it is assumed"
        )
        yield f"The focal length is not known, {walk.focal_px:.0f} px is usual: {how}."
    if best is not None:
        stride = best.candidates[0].frequency_hz
        usual = [
            r
            for r in (rate, rate / 2, 2 * rate)
            if USUAL_CADENCE_HZ[0] <= stride * r / rate <= USUAL_CADENCE_HZ[1]
        ]
        if rate not in usual:
            other_rate = f", or {usual[0]:g} Hz" if usual else ""
            yield f"A stride of {1 / stride:.2f} s is unusual: is the frame rate {rate:g} Hz{other_rate}?"


def _walks(stretches: list[Stretch]) -> bool:
    return any(stretch.judgement.verdict != Verdict.not_a_walk for stretch in stretches)


def _stretches(
    track: Track,
    pixels: np.ndarray,
    confidence: np.ndarray,
    rate: float,
    focal: float,
    prior: Prior,
    given: Input,
    notes: list[str],
) -> list[Stretch]:
    """Reconstruct the straight stretches of one person's track; what is odd is added to `notes`."""
    first, last = int(track.frame[0]), int(track.frame[-1])
    T = last - first + 1
    whole, sure = np.full((T, 15, 2), np.nan), np.zeros((T, 15))
    whole[track.frame - first], sure[track.frame - first] = pixels[track.rows], confidence[track.rows]
    parts = straight_stretches(whole, prior.mean[:, 2, 0], rate, focal)
    if len(parts) > 1 or parts[0] != (0, T):
        words = ", ".join(f"{first + a} to {first + b - 1}" for a, b in sorted(parts))
        notes.append(f"The path is not straight throughout: reconstructed are frames {words}.")
    longest = round(LONGEST_S * rate)
    film = _Film(whole, sure, first, rate, focal, prior, given)
    stretches = []
    for start, stop in parts[:MOST_STRETCHES]:
        if stop - start > longest:
            spare = stop - start - longest
            start, stop = start + spare // 2, start + spare // 2 + longest
            notes.append(f"Of a long stretch the middle {LONGEST_S:g} s are used.")
        stretch = film.stretch(start, stop)
        walked = film.walking_parts(start, stop) if stretch.judgement.verdict == Verdict.not_a_walk else []
        if walked:
            words = ", ".join(f"{s.first_frame} to {s.last_frame}" for s in walked)
            notes.append(
                f"Frames {first + start} to {first + stop - 1} are not one walk; parts of them are: {words}."
            )
        stretches += walked or [stretch]
    return stretches


@dataclass(frozen=True)
class _Film:
    """One person's keypoints throughout a video, and how they are reconstructed."""

    pixels: np.ndarray
    confidence: np.ndarray
    first: int
    rate: float
    focal: float
    prior: Prior
    given: Input

    def stretch(self, start: int, stop: int, *, quick: bool = False) -> Stretch:
        """Reconstruct frames from `start` to `stop` (exclusive); `quick`: as labelled only."""
        pixels, confidence = self.pixels[start:stop], self.confidence[start:stop]
        found = None
        try:
            found = reconstruct_followed(
                pixels,
                (confidence > 0).astype(float),
                self.rate,
                self.focal,
                self.prior,
                both_labellings=self.given.labels == Labels.both and not quick,
                focal_sd=0.0 if self.given.focal_px else FOCAL_SD,
            )
            judgement = judge(found)
        except InvalidInput as refusal:
            judgement = Judgement(Verdict.not_a_walk, (str(refusal),))
        return Stretch(self.first + start, self.first + stop - 1, pixels, confidence, found, judgement)

    def walking_parts(self, start: int, stop: int) -> list[Stretch]:
        """Parts that are a walk, of frames that are none as a whole: somebody turned before a camera that follows.

        Windows of some three strides are reconstructed alone; neighbours that are walks with one heading are joined.
        """
        length = round(WINDOW_S * self.rate)
        if stop - start < 1.5 * length:
            return []
        count = min(int(np.ceil(2.0 * (stop - start - length) / length)) + 1, MOST_WINDOWS)
        starts = np.linspace(start, stop - length, count).round().astype(int).tolist()
        windows = [self.stretch(a, a + length, quick=True) for a in starts]
        groups: list[list[int]] = []
        for number, window in enumerate(windows):
            if window.found is None or window.judgement.verdict == Verdict.not_a_walk:
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
            if part.judgement.verdict == Verdict.not_a_walk:
                part = self.stretch(starts[group[0]], starts[group[0]] + length)
            if part.judgement.verdict != Verdict.not_a_walk:
                parts.append(part)
        return sorted(parts, key=lambda s: (-len(s.pixels), s.first_frame))


def _turn(one: Stretch, other: Stretch) -> float:
    assert one.found is not None
    assert other.found is not None
    turn = one.found.candidates[0].heading_rad - other.found.candidates[0].heading_rad
    return abs(float((turn + np.pi) % (2.0 * np.pi) - np.pi))
