"""Reconstruction of one person's walk from a file of keypoints."""

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
from walk3d.film.walk.film import Film, FilmResult, Stretch, best_of, reconstruct_film
from walk3d.film.walk.objective import FOCAL_SD
from walk3d.film.walk.tracks import MAX_GAP_S, MIN_WALK_S, Track, find_tracks

FOCAL_SHARE = 0.75
"""Initial estimate of an unknown focal length, relative to the longer side of the image.

It lies between the usual values of phones and camcorders.
"""
MAX_OTHER_TRACKS = 3
"""Maximum number of other tracks to try if no person is named and the longest track is not a walk."""
RANGES = {
    "frame_rate_hz": (5.0, 1000.0), "focal_px": (10.0, 1e6), "stature_mm": (400.0, 2500.0), "width": (16, 100_000),
    "height": (16, 100_000),
}  # fmt: skip
"""Accepted range of each numeric option of the input; an option of 0 means unknown."""


class Labels(StrEnum):
    """Use of the detector's left and right labels."""

    both = "both"
    """Compare two reconstructions: with the labels of the file, and with left and right exchanged in all frames."""
    as_given = "as_given"
    """Use the left and right labels of the file, without a comparison with exchanged labels."""


class Input(Options):
    """Options of the input: the file of keypoints and what is known about the video."""

    path: str = ""  # file or folder of keypoints, or a film
    frame_rate_hz: float = 0.0  # frames per second; 0: as stated in the file
    layout: str = ""  # coco17, halpe26, body25, …; empty: recognised from the file
    frames: str = ""  # first:last, or seconds as 2s:6.5s, with open ends; empty: where the person walks
    person: str = ""  # identity in the file, or a number by length of track; empty: the longest track
    width: int = 0  # width of the image, px; 0: as stated in the file
    height: int = 0  # height of the image, px; 0: as stated in the file
    focal_px: float = 0.0  # focal length of the camera, px; 0: estimated with the walk
    stature_mm: float = 0.0  # stature of the walker; 0: unknown, and no length is in true millimetres
    least_confidence: float = 0.3  # keypoints below this confidence are ignored
    labels: Labels = Labels.both


@shortened
class Walk:
    """Reconstructed walk of one person in a file of keypoints.

    Attributes
    ----------
    source : Detections
    layout : Layout
    recognised : str
        Reason for the choice of the layout.
    track : Track
        Track of the person who was reconstructed.
    frame_rate_hz, focal_px : float
    focal_known : bool
        If False, `focal_px` is the initial value and each stretch has its own estimate.
    centre_px : (2,)
        Principal point.
    calibrations : dict of str to Calibration
    stature_mm : float
        Stature of the walker; 0: unknown.
    bars_for : str
        Key of `calibrations` whose bars are shown: for any person if the layout's joints were not measured.
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
        """Multipliers of the error bars in the results."""
        return self.calibrations[self.bars_for]

    @property
    def best(self) -> Stretch:
        """Stretch of the film with the best verdict; the longest one if several stretches have this verdict."""
        return best_of(self.stretches)


@functools.lru_cache(maxsize=4)
def _prior(folder: Path, layout: str) -> tuple[Prior, dict[str, Calibration]]:
    trained = model_file.load(folder)
    detector: Detector = layouts.layouts()[layout].detector
    return prepare(trained.model, detector, unfamiliar=trained.unfamiliar), trained.calibrations


def reconstruct_clip(options: Input, model: Path = model_file.SHIPPED) -> Walk:
    """Reconstruct the walk in a file or folder of keypoints.

    Parameters
    ----------
    options : Input
    model : Path
        Folder of the model of walkers.

    Raises
    ------
    InvalidInput
        If the file cannot be read or recognised, the frame rate is unknown, or the named person is not in it.
    """
    with one_thread():
        return _reconstruct_clip(options, model)


def _reconstruct_clip(options: Input, model: Path) -> Walk:
    if not options.path:
        raise InvalidInput(
            "must name a file or folder of keypoints", "input.path", received="nothing", code="none_named"
        )
    for name, (least, most) in RANGES.items():
        if value := getattr(options, name):
            require_range(f"input.{name}", value, at_least=least, at_most=most)
    require_range("input.least_confidence", options.least_confidence, at_least=0, below=1)
    source = keypoints.read(options.path)
    notes = list(source.notes)
    rate = _rate(options, source, notes)
    layout, order, recognised = layouts.recognise(source, options.layout)
    pixels, confidence = layouts.to_joints(layout, order, source)
    size = (options.width or source.image_size[0], options.height or source.image_size[1])
    pixels, size = in_pixels(pixels, size, notes)
    focal = options.focal_px or FOCAL_SHARE * max(size)
    centre = np.array(size) / 2.0
    pixels = pixels - centre
    _drop_low_confidence(pixels, confidence, options.least_confidence, notes)
    used = _selected_frames(options.frames, source.frame, rate)
    tracks = find_tracks(source.frame, source.identity, np.where(used[:, None, None], pixels, np.nan), rate)
    prior, calibrations = _prior(model, layout.name)
    marks = np.dstack([pixels, confidence])

    def reconstruct_track(track: Track) -> FilmResult:
        """Reconstruct the walking of one person throughout the video."""
        first, last = int(track.frame[0]), int(track.frame[-1])
        frames, frame, values = (
            np.full((last - first + 1, 15, 3), np.nan),
            track.frame,
            marks[track.rows],
        )
        if (frame % 1).any() and len(frame) > 1:
            frame, _, values = on_even_grid(frame, np.zeros(len(frame)), values)
        frames[frame.astype(int) - first] = values
        film = Film(
            frames[..., :2], np.where(np.isnan(frames[..., 0]), 0.0, frames[..., 2]), rate, focal, prior, first,
            both_labellings=options.labels == Labels.both, focal_sd=0.0 if options.focal_px else FOCAL_SD,
        )  # fmt: skip
        return reconstruct_film(film)

    track, film_result = _walking_track(tracks, options.person, rate, reconstruct_track, notes)
    notes += film_result.notes
    walk = Walk(
        source=source,
        layout=layout,
        recognised=recognised,
        track=track,
        frame_rate_hz=film_result.frame_rate_hz,
        focal_px=focal,
        focal_known=bool(options.focal_px),
        centre_px=centre,
        calibrations=calibrations,
        stature_mm=options.stature_mm,
        bars_for=AS_OURS if layout.measured or ANYBODY not in calibrations else ANYBODY,
        stretches=film_result.stretches,
    )
    return replace(walk, notes=(*notes, *_doubts(walk)))


def _rate(options: Input, source: Detections, notes: list[str]) -> float:
    """Return the frame rate, Hz, from the options or else from the file, and add a note if the two differ."""
    rate = options.frame_rate_hz or source.frame_rate_hz
    if not rate:
        raise InvalidInput(
            "the frame rate is unknown", "input.frame_rate_hz", "frames per second",
            " ".join(remarks_of("times", notes)), code="unknown_rate",
        )  # fmt: skip
    least, most = RANGES["frame_rate_hz"]
    require_range(f"{Path(options.path).name}, frames a second", rate, at_least=least, at_most=most)
    if source.frame_rate_hz and abs(rate / source.frame_rate_hz - 1) > 5e-4:
        notes.append(
            f"The file states {source.frame_rate_hz:g} frames per second, but input.frame_rate_hz={rate:g} is used."
        )
    return rate


def _selected_frames(frames: str, frame: np.ndarray, rate: float) -> np.ndarray:
    """Return the mask (n,) of the frames that `input.frames` selects.

    The option is ``first:last`` in frames, last included, or a range of seconds as ``2s:6.5s``.
    """
    parts = re.fullmatch(r"(\d+|\d+\.?\d*s)?:(\d+|\d+\.?\d*s)?", frames or ":")
    if parts is None:
        raise InvalidInput(
            "must be a range of frames or seconds", "input.frames", "first:last, as 120:300 or 2s:6.5s",
            frames, code="bad_part"
        )  # fmt: skip
    first, last = (
        otherwise if end is None else float(end[:-1]) * rate if end.endswith("s") else float(end)
        for end, otherwise in zip(parts.groups(), (-np.inf, np.inf), strict=True)
    )
    used = (frame >= first) & (frame <= last)
    if not used.any():
        raise InvalidInput(
            "no frame is in this range", "input.frames", f"frames from {frame.min():.0f} to {frame.max():.0f}",
            frames, code="no_frames", typed=True
        )  # fmt: skip
    return used


def _drop_low_confidence(pixels: np.ndarray, confidence: np.ndarray, least: float, notes: list[str]) -> None:
    """Set keypoints (n, 15, 2) of low confidence to NaN, and turn inverted images upright, in place.

    An image is inverted if its row numbers increase upwards.
    """
    doubtful = confidence < least * np.nanmax(confidence)
    if share := (doubtful & np.isfinite(pixels).all(axis=-1)).mean():
        percent = f"{100 * share:.0f}" if share >= 0.005 else "Less than 1"
        notes.append(f"{percent} % of the keypoints are below input.least_confidence and are ignored.")
    pixels[doubtful], confidence[doubtful] = np.nan, 0.0
    if upside_down(pixels):
        pixels[..., 1] *= -1.0
        notes.append("Heads are below feet: image rows count upwards in this file and were flipped.")


def _walking_track(
    tracks: list[Track],
    person: str,
    rate: float,
    reconstruct_track: Callable[[Track], FilmResult],
    notes: list[str],
) -> tuple[Track, FilmResult]:
    """Return a track and its reconstruction: the named person's track, otherwise the longest track.

    If the longest track is not a walk, return the first other track that is a walk, if there is one.
    """
    track = choose(tracks, person)
    film_result = reconstruct_track(track)
    if not person and not film_result.walks:
        # The person who is longest in the picture may stand while another walks through.
        others = [other for other in tracks if other is not track and len(other.rows) >= MIN_WALK_S * rate]
        for other in others[:MAX_OTHER_TRACKS]:
            if (other_result := reconstruct_track(other)).walks:
                notes.append(
                    f"The longest track (frames {track.frame[0]:.0f} to {track.frame[-1]:.0f}) is not a walk;"
                    f" the track of frames {other.frame[0]:.0f} to {other.frame[-1]:.0f} is."
                )
                track, film_result = other, other_result
                break
    unseen = np.flatnonzero(np.diff(track.frame) > MAX_GAP_S * rate + 1)
    if unseen.size:
        times = [f"{track.frame[k] + 1:.0f} to {track.frame[k + 1] - 1:.0f}" for k in unseen]
        notes.append(
            f"The person is not seen in frames {listed(times)}; position and size match before and after."
        )
    left_out = [other for other in tracks if other is not track and len(other.rows) >= 5]
    overlapping = [bool(np.isin(other.frame, track.frame).any()) for other in left_out]
    if others := [other for other, overlaps in zip(left_out, overlapping, strict=True) if overlaps]:
        notes.append(
            f"Tracks of other people were ignored: {len(others)}, the longest with {len(others[0].rows)} frames"
            f" {_from_to(others[0])}."
        )
    if perhaps := [other for other, overlaps in zip(left_out, overlapping, strict=True) if not overlaps]:
        more = f", and {len(perhaps) - 1} more" if len(perhaps) > 1 else ""
        notes.append(
            f"Another track was ignored, perhaps of the same person: {len(perhaps[0].rows)} frames"
            f" {_from_to(perhaps[0])}{more}."
        )
    return track, film_result


def _from_to(track: Track) -> str:
    return f"(frames {track.frame[0]:.0f} to {track.frame[-1]:.0f})"


def _doubts(walk: Walk) -> Iterator[str]:
    """Yield notes for the user on the assumptions of a reconstruction about the keypoints and the camera."""
    best = walk.best.reconstruction
    if not walk.layout.measured:
        yield (
            f"The joint definitions of {walk.layout.name} were not measured: the error bars are those for "
            + (
                "any person, learnt on people of laboratories that were left out."
                if walk.bars_for == ANYBODY
                else "people of the model's only laboratory and may be too narrow."
            )
        )
    if not walk.focal_known:
        how = (
            f"{best.focal_px:.0f} px was estimated from the keypoints, starting from the usual {walk.focal_px:.0f} px"
            if best and best.focal_estimated
            else f"the usual {walk.focal_px:.0f} px was assumed"
        )
        yield f"The focal length is unknown: {how}."
    if best and best.labels_exchanged:
        yield "Left and right are exchanged throughout, or the person walks backwards."


def choose(tracks: list[Track], person: str) -> Track:
    """Return the track of the named person, or the longest track.

    Raises
    ------
    InvalidInput
        If the named person is not in the file.
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
        "this person is not in the file",
        "input.person",
        ", ".join(listed),
        person,
        code="unknown_person",
        typed=True,
    )
