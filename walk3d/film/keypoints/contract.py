"""Keypoints in the form that all readers return."""

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

MAX_PX = 1e6
MAX_REPEATED_SHARE = 0.05
"""Maximum share of rows that repeat the time of the previous row; up to this share, the repetitions are ignored."""
MAX_FRAMES = 10_000_000
MAX_PAIRS = 20_000_000
"""Maximum number of comparisons between people of the same frame in tracking, summed over all frames."""

MAX_PEOPLE = 30
"""Maximum number of people in one frame.

A larger number is accepted if the file has at least as many frames.

Some files list all frames of one person in a single frame.
"""

MAX_DEPTH_SHARE, DEPTH = 0.2, 101.0
"""Share of confidences outside 0 to 100 % above which they are depths, and the number that stands for a depth."""
IN_3D = "If the points are in 3D, they are not keypoints of a film: see `inspect`."
PLACEHOLDER_DISTANCE = 2.2
"""Distance of a point from the mean of a person's points above which its coordinates may be placeholders.

The distance is relative to the root mean square distance of the person's points from their mean.
"""


@shortened
class Detections:
    """2D keypoints of one video as in its file, with any number of people in each frame.

    Attributes
    ----------
    format : str
        ``"openpose"``, ``"alphapose"``, ``"coco"``, ``"mmpose"``, ``"mediapipe"``, or the suffix of the file.
    names : tuple of str
        K names of points; empty where the file numbers them.
    frame : (N,)
        Frame of each detection, from 0; not a whole number if the times in the file are uneven.
    identity : (N,) str
        Identity in the file; empty if missing.
    points : (N, K, 2) float64
        Columns and rows, rows counted downwards unless a note says otherwise; NaN where missing.
    confidence : (N, K)
        Confidence in the file; 1 if missing.
    n_frames : int
        Number of frames of the video as far as known, including frames without people.
    frame_rate_hz : float
        Frames per second; 0 if unknown.
    image_size : tuple of int
        Width and height in pixels; 0 if unknown.
    notes : tuple of str
        Remarks on unusual but readable content, one sentence each.
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
    """Raise InvalidInput if the numbers of people in each frame (T,) are too large for tracking."""
    if (pairs := int(people @ people)) > MAX_PAIRS or people.max() > max(len(people), MAX_PEOPLE):
        raise damaged(
            "the file has too many people per frame to track them",
            where,
            f"fewer people than frames, and {MAX_PAIRS} pairs or fewer (all frames of a person may be in one)",
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
    """Return the checked detections of a reader, with missing points set to NaN.

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
        If no person was detected, detections have different numbers of points, or there are too many people or frames.

    Notes
    -----
    A point is missing if it is at (0, 0) or (-1, -1), has no confidence, or is not finite.  Placeholders such as 999 or
    -9999 are missing, too: one number that recurs in both coordinates, far from the other points of the person.
    """
    if not all(0 <= size <= MAX_PX for size in image_size):
        received = " x ".join(f"{size:.3g}" if size < 1e300 else "more" for size in image_size)
        raise damaged(
            "the size of the image is out of range",
            where,
            f"0 to {MAX_PX:g} px",
            received,
            code="out_of_range",
        )
    counts = sorted({len(row) for _, _, row in rows})
    if not counts:
        called = "keypoints of a person, named so, or landmarks, joints or pose_keypoints_2d"
        raise damaged(
            "no person was detected in any frame", where, called, f"{n_frames} frames", code="nobody_seen"
        )
    if len(counts) > 1:
        raise damaged(
            "detections differ in their number of points", where, received=counts, code="point_counts_differ"
        )
    rows = sorted(rows, key=lambda row: row[0])
    frame = np.array([frame for frame, _, _ in rows])
    _require_few_people(np.unique(frame, return_counts=True)[1], where)
    frames = max(n_frames, int(frame[-1]) + 1)
    if frames > MAX_FRAMES:
        raise damaged(
            "the frame numbers have a very large gap",
            where,
            f"{MAX_FRAMES} frames or fewer",
            frames,
            code="frames_jump",
        )
    require_points(len(rows), counts[0], where)
    values = np.array([row for _, _, row in rows], float)
    points, confidence = values[..., :2], values[..., 2]
    with np.errstate(invalid="ignore"):
        missing = ~np.isfinite(points).all(axis=-1) | (np.abs(points) > MAX_PX).any(axis=-1)
        missing |= (points == 0.0).all(axis=-1) | (points == -1.0).all(axis=-1)
    notes, sure = list(notes), confidence[~missing]
    if sure.size and not (sure > 0).any():
        notes.append("The confidence is empty or 0 throughout, and is ignored.")
        confidence[:] = 1.0
    elif ((sure < 0) | (sure >= DEPTH)).sum() > MAX_DEPTH_SHARE * sure.size:
        notes.append(f"The third numbers of keypoints are depths, not confidences, and are ignored.  {IN_3D}")
        confidence[:] = 1.0
    points[missing | ~(confidence > 0)] = np.nan
    notes += _leave_out_placeholders(points)
    missing = np.isnan(points[..., 0])
    confidence[missing] = 0.0
    if missing.all():
        expected, empty = "coordinates of a person", "0, -1 or nothing"
        raise damaged("every keypoint is missing", where, expected, empty, code="nothing_measured")
    visible = ~missing.all(axis=1)
    frame = frame[visible]
    if (gone := int(frame[-1] - frame[0]) + 1 - len(np.unique(frame))) > 0:
        notes.append(f"{gone} frames between the first and the last are missing or without people.")
    return Detections(
        format=format,
        names=tuple(map(harmless, names)) if len(names) == counts[0] else (),
        frame=frame,
        identity=np.array([harmless(identity[:80]) for _, identity, _ in rows], str)[visible],
        points=points[visible],
        confidence=confidence[visible],
        n_frames=frames,
        frame_rate_hz=frame_rate_hz,
        image_size=image_size,
        notes=tuple(notes),
    )


def timed(table: Rows, column: int, frames: np.ndarray | None, rate: float) -> tuple[np.ndarray, float]:
    """Return the frame number of each table row, from a column of time stamps, and the frame rate, Hz.

    Frames are not whole numbers if the time stamps are non-uniform.

    Parameters
    ----------
    table : Rows
    column : int
        Column of the times.
    frames : (R,) int or None
        Frames as numbered or in order of the rows: rows of one frame have one time.  None: rows of one time are a
        frame.
    rate : float
        Declared frames per second, which are kept if there are no usable times; 0: none are declared.
    """
    try:
        set_to_seconds(table, column)
        if frames is None:
            frames = np.unique(table.column(column), return_inverse=True)[1]
        numbers, first, which = np.unique(frames, return_index=True, return_inverse=True)
        times = table.numbers([column])[first, 0]
        stamped = np.flatnonzero(np.isfinite(times))  # frames without people may have no time
        if not stamped.size:
            raise damaged("no row has a time", table.where, code="no_times")
        repeated = np.flatnonzero(np.diff(times[stamped]) == 0) + 1
        if 0 < len(repeated) <= MAX_REPEATED_SHARE * len(stamped):
            table.notes.append(
                f"{len(repeated)} times repeat those of the row before, the first in"
                f" {table.place(first[stamped[repeated[0]]])}, and are ignored: these rows are interpolated."
            )
            stamped = np.delete(stamped, repeated)
        at, measured_rate = frames_of(
            times[stamped], None, lambda k: table.place(first[stamped[k]]), table.notes
        )
    except ValueError as error:  # InvalidInput, or numpy's error for an invalid date
        if frames is None:
            raise
        table.notes.append(Remark(f"The times are ignored: {error}.", "times"))
        return frames, rate
    if rate and abs(measured_rate / rate - 1.0) > 1e-3:
        table.notes.append(f"The times give {measured_rate:g} frames per second, not the declared {rate:g}.")
        rate = 0.0
    late = numbers[stamped[0]] + at - numbers[stamped]
    return (numbers + np.interp(numbers, numbers[stamped], late)).round(5)[which], rate or measured_rate


def _leave_out_placeholders(points: np.ndarray) -> list[str]:
    """Set points (N, K, 2) with placeholder values to NaN, in place, and return notes for the user."""
    at = points[..., 0] == points[..., 1]
    numbers, which, count = np.unique(points[at][:, 0], return_inverse=True, return_counts=True)
    at[at] = (count > 1)[which]
    plausible = ~at & np.isfinite(points).all(axis=-1)
    weight = plausible[..., None] / np.maximum(plausible.sum(axis=1), 1)[:, None, None]
    off = np.nan_to_num(points) - (weight * np.nan_to_num(points)).sum(axis=1, keepdims=True)
    spread = np.sqrt((weight * off**2).sum(axis=(1, 2)))
    at &= np.linalg.norm(off, axis=-1) > PLACEHOLDER_DISTANCE * spread[:, None]
    numbers, count = np.unique(points[at][:, 0], return_counts=True)
    points[at] = np.nan
    return [
        f"{n} keypoints are {number:.6g} in both coordinates and count as missing."
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
"""Names of MediaPipe's 33 landmarks, in order."""
