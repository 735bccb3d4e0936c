"""What every reader of keypoints returns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.formats.budget import require_points
from pipeline.formats.contract import damaged
from pipeline.formats.points.cells import Rows
from pipeline.formats.points.csv.table import set_to_seconds
from pipeline.formats.points.even_times import frames_of
from pipeline.shortened import shortened
from pipeline.skeleton.complaint import Remark
from pipeline.validation import harmless

LARGEST_PX = 1e6
TWICE = 0.05
"""Share of rows with the time of the row before, up to which these were written by mistake."""
MOST_FRAMES = 10_000_000
MOST_PAIRS = 20_000_000
"""Of people in a frame, each with each, summed over frames: so many are compared to follow who walks."""

CROWD = 30
"""More in a frame, and more than there are frames, are no people: all frames of one person in one, say."""

DEPTHS, DEPTH = 0.2, 101.0
"""Share of numbers below 0 or above 100 %, from which these are depths and no confidence; a depth."""
IN_3D = "If the points are in 3D, they are no film's: see `inspect`."
FAR = 2.2
"""Distance from the middle of a person's points, to their root mean square distance, beyond which there are none."""


@shortened
class Detections:
    """2D keypoints of one video, as a file holds them: any number of people in any frame.

    Attributes
    ----------
    format : str
        ``"openpose"``, ``"alphapose"``, ``"coco"``, ``"mmpose"``, ``"mediapipe"``, or its suffix.
    names : tuple of str
        K names of points; empty where the file numbers them.
    frame : (N,)
        Frame of each detection, from 0; not a whole number where a file has times that are uneven.
    identity : (N,) str
        Who it is, as the file says; empty where it does not.
    points : (N, K, 2) float64
        Columns and rows, rows counted downwards unless a note says otherwise; NaN where missing.
    confidence : (N, K)
        As the file says; 1 where it does not.
    n_frames : int
        Frames of the video as far as the file tells, those without people included.
    frame_rate_hz : float
        0 if the file does not say.
    image_size : tuple of int
        Width and height in pixels; 0 if the file does not say.
    notes : tuple of str
        What is odd in the file but readable, one sentence each.
    """

    format: str
    names: tuple[str, ...]
    frame: np.ndarray
    identity: np.ndarray
    points: np.ndarray
    confidence: np.ndarray
    n_frames: int
    frame_rate_hz: float
    image_size: tuple[int, int]
    notes: tuple[str, ...]


def _require_few_people(people: np.ndarray, where: str) -> None:
    """Require numbers of people by frame (T,) that can be assigned to tracks."""
    if (pairs := int(people @ people)) > MOST_PAIRS or people.max() > max(len(people), CROWD):
        raise damaged(
            "too many people to be told apart",
            where,
            f"fewer than frames (are all frames of a person in one?), and {MOST_PAIRS} pairs or fewer",
            f"up to {people.max()} in a frame, {pairs} pairs",
            code="too_many_people",
            people=int(people.max()),
        )


def detections(
    format: str,
    where: str,
    rows: Sequence[tuple[float, str, np.ndarray]],
    n_frames: int,
    *,
    names: Sequence[str] = (),
    frame_rate_hz: float = 0.0,
    image_size: tuple[int, int] = (0, 0),
    notes: Sequence[str] = (),
) -> Detections:
    """Build the result of a reader.

    Parameters
    ----------
    format, where : str
        Kind of file, and its name for messages.
    rows : sequence of (float, str, (K, 3))
        Frame, identity, and column, row, confidence of each point of each detection.
    n_frames : int
    names : sequence of str
    frame_rate_hz : float
    image_size : tuple of int
    notes : sequence of str

    Raises
    ------
    InvalidInput
        If nobody was detected, detections have different numbers of points, or there are too many people or frames.

    Notes
    -----
    A point at (0, 0) or (-1, -1), of no confidence, or not finite is missing; so is one of a number that stands again
    and again in both coordinates, far from the others of the person (999, -9999).
    """
    counts = sorted({len(row) for _, _, row in rows})
    if not counts:
        called = "keypoints of a person, called so, landmarks, joints or pose_keypoints_2d"
        raise damaged(
            "nobody was detected in any frame", where, called, f"{n_frames} frames", code="nobody_seen"
        )
    if len(counts) > 1:
        raise damaged(
            "detections differ in their number of points", where, received=counts, code="point_counts_differ"
        )
    rows = sorted(rows, key=lambda row: row[0])
    frame = np.array([frame for frame, _, _ in rows])
    _require_few_people(np.unique(frame, return_counts=True)[1], where)
    frames = max(n_frames, int(frame[-1]) + 1)
    if frames > MOST_FRAMES:
        raise damaged(
            "the numbers of frames jump", where, f"{MOST_FRAMES} frames or fewer", frames, code="frames_jump"
        )
    require_points(len(rows), counts[0], where)
    values = np.array([row for _, _, row in rows], float)
    points, confidence = values[..., :2], values[..., 2]
    with np.errstate(invalid="ignore"):
        missing = ~np.isfinite(points).all(axis=-1) | (np.abs(points) > LARGEST_PX).any(axis=-1)
        missing |= (points == 0.0).all(axis=-1) | (points == -1.0).all(axis=-1)
    notes, sure = list(notes), confidence[~missing]
    if sure.size and not (sure > 0).any():
        notes.append("The confidence is empty or 0 throughout, and taken as not given.")
        confidence[:] = 1.0
    elif ((sure < 0) | (sure >= DEPTH)).sum() > DEPTHS * sure.size:
        notes.append(f"The third numbers of keypoints are depths, which are no confidence.  {IN_3D}")
        confidence[:] = 1.0
    points[missing | ~(confidence > 0)] = np.nan
    notes += _leave_out_placeholders(points)
    missing = np.isnan(points[..., 0])
    confidence[missing] = 0.0
    if missing.all():
        expected, empty = "coordinates of a person", "0, -1 or nothing"
        raise damaged("every keypoint is missing", where, expected, empty, code="nothing_measured")
    seen = ~missing.all(axis=1)
    frame = frame[seen]
    if (gone := int(frame[-1] - frame[0]) + 1 - len(np.unique(frame))) > 0:
        notes.append(f"{gone} frames between the first and the last are missing, or without people.")
    return Detections(
        format=format,
        names=tuple(map(harmless, names)) if len(names) == counts[0] else (),
        frame=frame,
        identity=np.array([harmless(who[:80]) for _, who, _ in rows], str)[seen],
        points=points[seen],
        confidence=confidence[seen],
        n_frames=frames,
        frame_rate_hz=frame_rate_hz,
        image_size=image_size,
        notes=tuple(notes),
    )


def timed(table: Rows, column: int, frames: np.ndarray | None, rate: float) -> tuple[np.ndarray, float]:
    """Frames of rows by their times, not whole where these are uneven, and frames a second.

    Parameters
    ----------
    table : Rows
    column : int
        Of the times.
    frames : (R,) int or None
        As numbered or in turn; they decide which rows are of one time.  None: their times do.
    rate : float
        That is declared, which stays where the times tell none; 0: none is.
    """
    try:
        set_to_seconds(table, column)
        if frames is None:
            frames = np.unique(table.column(column), return_inverse=True)[1]
        numbers, first, which = np.unique(frames, return_index=True, return_inverse=True)
        times = table.numbers([column])[first, 0]
        known = np.flatnonzero(np.isfinite(times))  # a frame without people may have none
        if not known.size:
            raise damaged("no row has a time", table.where, code="no_times")
        twice = np.flatnonzero(np.diff(times[known]) == 0) + 1
        if 0 < len(twice) <= TWICE * len(known):
            table.notes.append(
                f"{len(twice)} times are those of the row before, the first in {table.place(first[known[twice[0]]])}, "
                "and are not used: the rows are put between their neighbours."
            )
            known = np.delete(known, twice)
        at, own = frames_of(times[known], None, lambda k: table.place(first[known[k]]), table.notes)
    except ValueError as error:  # InvalidInput, or of numpy: a date that is none
        if frames is None:
            raise
        table.notes.append(Remark(f"The times are not used: {error}.", "times"))
        return frames, rate
    if rate and abs(own / rate - 1.0) > 1e-3:
        table.notes.append(f"By the times there are {own:g} frames a second, not {rate:g} as is declared.")
        rate = 0.0
    late = numbers[known[0]] + at - numbers[known]
    return (numbers + np.interp(numbers, numbers[known], late)).round(5)[which], rate or own


def _leave_out_placeholders(points: np.ndarray) -> list[str]:
    """Make points (N, K, 2) of one number that is no place NaN, in place; return notes on them."""
    at = points[..., 0] == points[..., 1]
    numbers, which, count = np.unique(points[at][:, 0], return_inverse=True, return_counts=True)
    at[at] = (count > 1)[which]
    seen = ~at & np.isfinite(points).all(axis=-1)
    weight = seen[..., None] / np.maximum(seen.sum(axis=1), 1)[:, None, None]
    off = np.nan_to_num(points) - (weight * np.nan_to_num(points)).sum(axis=1, keepdims=True)
    spread = np.sqrt((weight * off**2).sum(axis=(1, 2)))
    at &= np.linalg.norm(off, axis=-1) > FAR * spread[:, None]
    numbers, count = np.unique(points[at][:, 0], return_counts=True)
    points[at] = np.nan
    return [
        f"{n} keypoints are {number:.6g} in both coordinates and are taken as missing."
        for number, n in zip(numbers.tolist(), count.tolist(), strict=True)
    ]


_FACE = (
    "nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye", "right_eye_outer",
    "left_ear", "right_ear", "mouth_left", "mouth_right",
)  # fmt: skip
_BODY = (
    "shoulder", "elbow", "wrist", "pinky", "index", "thumb", "hip", "knee", "ankle", "heel", "foot_index",
)  # fmt: skip
MEDIAPIPE = (*_FACE, *(f"{side}_{part}" for part in _BODY for side in ("left", "right")))
"""The 33 landmarks in order."""
