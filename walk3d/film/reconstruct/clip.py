"""From a file of keypoints to reconstructed stretches: what was recognised, who walks, and what was left out."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from pipeline.processes import one_thread
from pipeline.shortened import shortened
from pipeline.skeleton.complaint import remarks_of
from pipeline.validation import InvalidInput, Options, listed, require_range
from walk3d.film import keypoints
from walk3d.film.keypoints import Detections
from walk3d.film.reconstruct import layouts, model_file
from walk3d.film.reconstruct.image import in_pixels, upside_down
from walk3d.film.reconstruct.layouts import Layout
from walk3d.film.video.film import on_even_grid
from walk3d.film.walk import Detector, Prior, prepare
from walk3d.film.walk.calibration import ANYBODY, AS_OURS, Calibration
from walk3d.film.walk.film import Film, Stretch, Watched, best_of, watch
from walk3d.film.walk.objective import FOCAL_SD
from walk3d.film.walk.tracks import GAP_S, SHORTEST_S, Track, find_tracks

FOCAL_SHARE = 0.75
"""Focal length over the longer side of the image from which the fit starts, where it is not known: between a
telephone's and a camcorder's."""
MOST_OTHERS = 3
"""Tracks that are tried after the longest, if it is no walk and nobody is named."""
POSSIBLE = {
    "frame_rate_hz": (5.0, 1000.0), "focal_px": (10.0, 1e6), "stature_mm": (400.0, 2500.0), "width": (16, 100_000),
    "height": (16, 100_000),
}  # fmt: skip
"""Ranges of what may be known of a video; 0 is not known."""


class Labels(StrEnum):
    """Whether the detector's left and right are believed."""

    both = "both"
    """Exchanged throughout is tried, too."""
    as_given = "as_given"


class Input(Options):
    """Keypoints to be reconstructed, and what is known of the video."""

    path: str = ""  # file of keypoints
    frame_rate_hz: float = 0.0  # 0: as the file says
    layout: str = ""  # coco17, halpe26, body25, …; empty: recognised
    frames: str = ""  # first:last, or seconds as 2s:6.5s; either may be left out; empty: where somebody walks
    person: str = ""  # identity in the file, or a number by length of track; empty: the longest track
    width: int = 0  # of the image, px; 0: as the file says
    height: int = 0  # of the image, px; 0: as the file says
    focal_px: float = 0.0  # 0: not known, and found with the walk
    stature_mm: float = 0.0  # 0: not known; then nothing is in true millimetres
    least_confidence: float = 0.3  # keypoints below it are not used
    labels: Labels = Labels.both


@shortened
class Walk:
    """What a file of keypoints shows.

    Attributes
    ----------
    source : Detections
    layout : Layout
    recognised : str
        Why this layout.
    track : Track
        Who was reconstructed.
    frame_rate_hz, focal_px : float
    focal_known : bool
        Otherwise `focal_px` is where the search for it began; each stretch has found its own.
    centre_px : (2,)
        Principal point.
    calibrations : dict of str to Calibration
    stature_mm : float
        Of the walker; 0: not known.
    bars_for : str
        Whom bars hold for, a key of these: anybody where the layout's joints were not measured.
    stretches : tuple of Stretch
        The longest first.
    notes : tuple of str
    """

    source: Detections
    layout: Layout
    recognised: str
    track: Track
    frame_rate_hz: float
    focal_px: float
    focal_known: bool
    centre_px: np.ndarray
    calibrations: dict[str, Calibration]
    stature_mm: float
    bars_for: str
    stretches: tuple[Stretch, ...]
    notes: tuple[str, ...] = ()

    @property
    def calibration(self) -> Calibration:
        """Multipliers of the bars that are shown."""
        return self.calibrations[self.bars_for]

    @property
    def best(self) -> Stretch:
        """The longest stretch with the best verdict."""
        return best_of(self.stretches)


@functools.lru_cache(maxsize=4)
def _prior(folder: Path, layout: str) -> tuple[Prior, dict[str, Calibration]]:
    trained = model_file.load(folder)
    detector: Detector = layouts.layouts()[layout].detector
    return prepare(trained.model, detector, unfamiliar=trained.unfamiliar), trained.calibrations


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
        raise InvalidInput(
            "must name a file or folder of keypoints", "input.path", received="nothing", code="none_named"
        )
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
    used = _chosen(given.frames, source.frame, rate)
    tracks = find_tracks(source.frame, source.identity, np.where(used[:, None, None], pixels, np.nan), rate)
    prior, calibrations = _prior(model, layout.name)
    marks = np.dstack([pixels, confidence])

    def watched(track: Track) -> Watched:
        """What one person's keypoints throughout the video show."""
        first, last = int(track.frame[0]), int(track.frame[-1])
        whole, frame, values = np.full((last - first + 1, 15, 3), np.nan), track.frame, marks[track.rows]
        if (frame % 1).any() and len(frame) > 1:
            frame, _, values = on_even_grid(frame, np.zeros(len(frame)), values)
        whole[frame.astype(int) - first] = values
        film = Film(
            whole[..., :2], np.where(np.isnan(whole[..., 0]), 0.0, whole[..., 2]), rate, focal, prior, first,
            both_labellings=given.labels == Labels.both, focal_sd=0.0 if given.focal_px else FOCAL_SD,
        )  # fmt: skip
        return watch(film)

    track, shown = _walking_track(tracks, given.person, rate, watched, notes)
    notes += shown.notes
    walk = Walk(
        source=source,
        layout=layout,
        recognised=recognised,
        track=track,
        frame_rate_hz=shown.frame_rate_hz,
        focal_px=focal,
        focal_known=bool(given.focal_px),
        centre_px=centre,
        calibrations=calibrations,
        stature_mm=given.stature_mm,
        bars_for=AS_OURS if layout.measured or ANYBODY not in calibrations else ANYBODY,
        stretches=shown.stretches,
    )
    return replace(walk, notes=(*notes, *_doubts(walk)))


def _rate(given: Input, source: Detections, notes: list[str]) -> float:
    """Frames a second, as given or as the file has them."""
    rate = given.frame_rate_hz or source.frame_rate_hz
    if not rate:
        raise InvalidInput(
            "the frame rate is not known", "input.frame_rate_hz", "frames per second",
            " ".join(remarks_of("times", notes)), code="unknown_rate",
        )  # fmt: skip
    least, most = POSSIBLE["frame_rate_hz"]
    require_range(f"{Path(given.path).name}, frames a second", rate, at_least=least, at_most=most)
    if source.frame_rate_hz and abs(rate / source.frame_rate_hz - 1) > 5e-4:
        notes.append(
            f"The file says {source.frame_rate_hz:g} frames a second; {rate:g} was given and is used."
        )
    return rate


def _chosen(frames: str, frame: np.ndarray, rate: float) -> np.ndarray:
    """Rows (n,) bool of the frames that are named, as ``first:last``, both included, or in seconds, ``2s:6.5s``."""
    parts = re.fullmatch(r"(\d+|\d+\.?\d*s)?:(\d+|\d+\.?\d*s)?", frames or ":")
    if parts is None:
        raise InvalidInput(
            "must name a part of the video", "input.frames", "first:last, as 120:300 or 2s:6.5s",
            frames, code="bad_part"
        )  # fmt: skip
    first, last = (
        otherwise if end is None else float(end[:-1]) * rate if end.endswith("s") else float(end)
        for end, otherwise in zip(parts.groups(), (-np.inf, np.inf), strict=True)
    )
    used = (frame >= first) & (frame <= last)
    if not used.any():
        raise InvalidInput(
            "no frame is left", "input.frames", f"frames from {frame.min():.0f} to {frame.max():.0f}",
            frames, code="no_frames", typed=True
        )  # fmt: skip
    return used


def _leave_out_doubtful(pixels: np.ndarray, confidence: np.ndarray, least: float, notes: list[str]) -> None:
    """Empty keypoints (n, 15, 2) below the least confidence, and turn rows that are counted upwards, in place."""
    doubtful = confidence < least * np.nanmax(confidence)
    if share := (doubtful & np.isfinite(pixels).all(axis=-1)).mean():
        percent = f"{100 * share:.0f}" if share >= 0.005 else "Less than 1"
        notes.append(f"{percent} % of the keypoints are below the least confidence and are not used.")
    pixels[doubtful], confidence[doubtful] = np.nan, 0.0
    if upside_down(pixels):
        pixels[..., 1] *= -1.0
        notes.append("Heads are below feet: rows were counted upwards, and are turned.")


def _walking_track(
    tracks: list[Track], person: str, rate: float, watched: Callable[[Track], Watched], notes: list[str]
) -> tuple[Track, Watched]:
    """The track that is named, or the longest; or, if that is no walk, the first of the others that is one."""
    track = choose(tracks, person)
    shown = watched(track)
    if not person and not shown.walks:
        # Who is longest in the picture may stand in it while somebody else walks through.
        others = [other for other in tracks if other is not track and len(other.rows) >= SHORTEST_S * rate]
        for other in others[:MOST_OTHERS]:
            if (found := watched(other)).walks:
                notes.append(
                    f"The longest track (frames {track.frame[0]:.0f} to {track.frame[-1]:.0f}) is no walk;"
                    f" the one of frames {other.frame[0]:.0f} to {other.frame[-1]:.0f} is."
                )
                track, shown = other, found
                break
    unseen = np.flatnonzero(np.diff(track.frame) > GAP_S * rate + 1)
    if unseen.size:
        times = [f"{track.frame[k] + 1:.0f} to {track.frame[k + 1] - 1:.0f}" for k in unseen]
        notes.append(
            f"The person is not seen in frames {listed(times)}, and is the same one afterwards by place and size."
        )
    left_out = [other for other in tracks if other is not track and len(other.rows) >= 5]
    meanwhile = [bool(np.isin(other.frame, track.frame).any()) for other in left_out]
    if others := [other for other, seen in zip(left_out, meanwhile, strict=True) if seen]:
        notes.append(
            f"Left out are tracks of other people: {len(others)}, the longest of {len(others[0].rows)} frames"
            f" {_from_to(others[0])}."
        )
    if perhaps := [other for other, seen in zip(left_out, meanwhile, strict=True) if not seen]:
        more = f", and {len(perhaps) - 1} more" if len(perhaps) > 1 else ""
        notes.append(
            f"Left out is another track, perhaps the same person, of {len(perhaps[0].rows)} frames"
            f" {_from_to(perhaps[0])}{more}."
        )
    return track, shown


def _from_to(track: Track) -> str:
    return f"(frames {track.frame[0]:.0f} to {track.frame[-1]:.0f})"


def _doubts(walk: Walk) -> Iterator[str]:
    """What was assumed of the keypoints and the camera."""
    best = walk.best.found
    if not walk.layout.measured:
        yield f"Joint definitions of {walk.layout.name} were not measured: bars hold for " + (
            "anybody, as learnt on people of laboratories left out."
            if walk.bars_for == ANYBODY
            else "a person measured as those of the model, which knows one laboratory alone, and may be too narrow."
        )
    if not walk.focal_known:
        how = (
            f"{best.focal_px:.0f} px was estimated from the keypoints"
            if best and best.focal_found
            else "it is assumed"
        )
        yield f"The focal length is not known, {walk.focal_px:.0f} px is usual: {how}."
    if best and best.labels_exchanged:
        yield "Left and right are exchanged throughout, unless somebody walks backwards, who faces the other way."


def choose(tracks: list[Track], person: str) -> Track:
    """The longest track, or that of the person named.

    Raises
    ------
    InvalidInput
        If there is no such person.
    """
    if not tracks:
        raise InvalidInput("no person is seen with four joints or more in any frame", code="nobody_seen")
    if not person:
        return tracks[0]
    for track in tracks:
        if track.identity == person:
            return track
    if person.isdigit() and 1 <= int(person) <= len(tracks) and not any(track.identity for track in tracks):
        return tracks[int(person) - 1]
    listed = sorted({track.identity for track in tracks if track.identity}) or [f"1 to {len(tracks)}"]
    raise InvalidInput(
        "there is no such person",
        "input.person",
        ", ".join(listed),
        person,
        code="unknown_person",
        typed=True,
    )
