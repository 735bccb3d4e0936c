"""Tracks of people through a video, and the parts of a track with walking and with a straight path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.skeleton import LEFT_LEG, RIGHT_LEG
from walk3d.film.walk.path import image_scale

MAX_JUMP = (0.09, 2.2)
"""Maximum median motion of a person's joints between two detections, relative to the height: in total, and per second.

The larger of the two limits applies.  A larger motion means another person, or another shot of the video.
"""
MAX_GAP_S = 0.5
"""Maximum time, s, without a detection within a track."""
JOIN_S, JOIN_ROWS, JOIN_OFF, JOIN_SIZE = 1.5, 5, 0.3, 1.2
"""Limits for joining two tracks of the same person.

In order: longest gap, s; fewest detections in either track; mismatch of the paths; ratio of heights.

The mismatch, in heights, is that of the extrapolated paths in the middle of the gap.
"""
TURN_RAD_S = np.radians(50.0)
MIN_WALK_S = 0.9
MIN_STRAIGHT_SHARE = 0.5
"""Share of frames in straight stretches below which the path is too noisy to be divided into stretches."""
MOTION_S = 0.7
"""Duration, s, of the time window in which the motion of the legs is measured, about one step."""
MOVING_SHARE = 0.45
"""Threshold for the motion of the legs above which a person moves, as a share of the motion's 80 % quantile."""
MOVING_THROUGHOUT_SHARE = 0.85
"""Share of frames with moving legs, from which the whole track counts as moving."""
_LEGS = [(joint, leg[0]) for leg in (LEFT_LEG, RIGHT_LEG) for joint in leg[1:]]


@dataclass(frozen=True)
class Track:
    """Track of one person through successive frames.

    Attributes
    ----------
    identity : str
        Most frequent identity in the file; empty if the file has no identities.
    frame : (n,) int
        Frames of the video.
    rows : (n,) int
        Indices of the detections.
    height_px : float
        Median height in the image.
    """

    identity: str
    frame: np.ndarray
    rows: np.ndarray
    height_px: float


def _joint_distance(detection: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the median distances (M,), px, of the joints (15, 2) of one detection from those of M other detections.

    The distance is infinite if two detections share fewer than three joints.
    """
    distance = np.sort(np.linalg.norm(others - detection, axis=-1))  # NaN comes last
    count = np.isfinite(distance).sum(axis=-1)
    each = np.arange(len(others))
    middle = (distance[each, np.maximum(count - 1, 0) // 2] + distance[each, np.minimum(count // 2, 14)]) / 2
    return np.where(count >= 3, middle, np.inf)


def _heights(pixels: np.ndarray) -> np.ndarray:
    """Return the heights (N,) in the image, px, of people with joints (N, 15, 2).

    The height is NaN where too few joints are visible.
    """
    visible = np.isfinite(pixels).all(axis=-1)
    ends = [(np.where(visible[..., None], pixels, sign * np.inf) * sign).min(axis=1) for sign in (1.0, -1.0)]
    size = np.maximum(-(ends[0] + ends[1]).min(axis=-1), 1e-9)
    return np.where(visible.sum(axis=1) >= 4, size, np.nan)


def find_tracks(
    frame: np.ndarray, identity: np.ndarray, pixels: np.ndarray, frame_rate_hz: float
) -> list[Track]:
    """Return the tracks of people in a video, the track with the longest uninterrupted part first.

    Parameters
    ----------
    frame : (N,)
    identity : (N,) str
    pixels : (N, 15, 2)
    frame_rate_hz : float

    Notes
    -----
    A detection continues the nearest recent track, by position and size; the same identity is preferred.  Identities
    are not trusted further, since detectors exchange and lose them.  Tracks that continue each other after a longer
    time are joined, see `_joined`.
    """
    height = _heights(pixels)
    longest_gap = _gap(frame_rate_hz)
    open_: list[list[int]] = []
    closed: list[list[int]] = []
    for now in np.unique(frame):
        rows = [int(n) for n in np.flatnonzero(frame == now) if np.isfinite(height[n])]
        for track in [t for t in open_ if now - frame[t[-1]] > longest_gap]:
            open_.remove(track)
            closed.append(track)
        pairs = []
        last = np.array([track[-1] for track in open_], int)
        allowed = np.maximum(MAX_JUMP[0], MAX_JUMP[1] * (now - frame[last]) / frame_rate_hz)
        for n in rows:
            away = _joint_distance(pixels[n], pixels[last]) / np.maximum(height[last], height[n])
            cost = away + 0.25 * (identity[n] != identity[last])
            pairs += [(cost[number], n, int(number)) for number in np.flatnonzero(away < allowed)]
        used_rows, used_tracks = set(), set()
        for _, n, number in sorted(pairs):
            if n not in used_rows and number not in used_tracks:
                open_[number].append(n)
                used_rows.add(n)
                used_tracks.add(number)
        open_ += [[n] for n in rows if n not in used_rows]
    tracks = []
    for at in _joined([np.array(rows) for rows in closed + open_], frame, pixels, height, frame_rate_hz):
        names, counts = np.unique(identity[at], return_counts=True)
        tracks.append(Track(str(names[np.argmax(counts)]), frame[at], at, np.median(height[at])))
    # Sorted by length without a gap, then by size in the image, then by the first frame.
    return sorted(tracks, key=lambda t: (-_unbroken(t.frame, longest_gap), -t.height_px, int(t.frame[0])))


def _unbroken(frame: np.ndarray, longest_gap: int) -> int:
    """Return the number of detections in the longest uninterrupted part of a track."""
    ends = np.flatnonzero(np.diff(frame, append=np.inf) > longest_gap)
    return int(np.diff(ends, prepend=-1).max())


def _joined(
    tracks: list[np.ndarray], frame: np.ndarray, pixels: np.ndarray, height: np.ndarray, frame_rate_hz: float
) -> list[np.ndarray]:
    """Join tracks that continue each other in position and size, and return the detections of each person.

    Both ends are extrapolated to the middle of the gap.  Tracks stay separate if a third track that overlaps one of
    them in time fits as well.
    """
    long = [rows for rows in tracks if len(rows) >= JOIN_ROWS]
    ends = max(_gap(frame_rate_hz), JOIN_ROWS)
    first, last = (np.array([frame[rows[end]] for rows in long]) for end in (0, -1))
    begin, finish = (
        np.reshape([_end(rows[::way], frame, pixels, height, ends) for rows in long], (-1, 2, 3))
        for way in (1, -1)
    )
    after: dict[int, list[int]] = {k: [] for k in range(len(long))}
    before: dict[int, list[int]] = {k: [] for k in range(len(long))}
    for k in range(len(long)):
        unseen = first - last[k]
        half = unseen[:, None] / 2.0
        off = finish[k, 0] + half * finish[k, 1] - begin[:, 0] + half * begin[:, 1]
        size = np.exp(np.maximum(begin[:, 0, 2], finish[k, 0, 2]))
        near = np.linalg.norm(off[:, :2], axis=1) < JOIN_OFF * size
        near &= np.abs(off[:, 2]) < np.log(JOIN_SIZE)
        # After a shorter gap the detection would have continued the track, unless it moved too far.
        near &= (unseen > _gap(frame_rate_hz)) & (unseen <= JOIN_S * frame_rate_hz)
        for n in np.flatnonzero(near).tolist():
            after[k].append(n)
            before[n].append(k)
    follows = {}
    for k, later in after.items():
        n = min(later, key=lambda n: first[n], default=k)
        rivals = [m for m in later if m != n and first[m] <= last[n]]
        rivals += [m for m in before[n] if m != k and last[m] >= first[k]]
        if n != k and not rivals and last[k] == max(last[before[n]]):
            follows[k] = n
    people = [rows for rows in tracks if len(rows) < JOIN_ROWS]
    for k in sorted(set(after) - set(follows.values())):
        person = [long[k]]
        while k in follows:
            k = follows[k]
            person.append(long[k])
        people.append(np.concatenate(person))
    return people


def _end(
    rows: np.ndarray, frame: np.ndarray, pixels: np.ndarray, height: np.ndarray, count: int
) -> np.ndarray:
    """Return image column, row and log height at the beginning of a track, and their changes per frame, as (2, 3)."""
    near = rows[:count]
    state = np.column_stack([np.nanmedian(pixels[near], axis=1), np.log(height[near])])
    return np.polyfit(frame[near] - frame[rows[0]], state, 1)[::-1]


def _gap(frame_rate_hz: float) -> int:
    """Return the longest gap within a track, in frames."""
    return max(round(MAX_GAP_S * frame_rate_hz), 1)


def moving_parts(pixels: np.ndarray, frame_rate_hz: float) -> list[tuple[int, int]]:
    """Return the parts of a track in which the legs move, the longest first.

    A part is its first frame and the frame after its last.

    Parameters
    ----------
    pixels : (T, 15, 2)
        NaN where missing.
    frame_rate_hz : float

    Notes
    -----
    The motion is that of knees and ankles about their hips over the height in the image, so path and camera do not
    matter. Standing before or after a walk is left out.  If the legs move nearly throughout, the whole track is
    returned.
    """
    T = len(pixels)
    window = max(round(MOTION_S * frame_rate_hz) | 1, 3)
    height = _heights(pixels)
    measured = np.isfinite(height)
    if 2 * window > T or measured.sum() < window:
        return [(0, T)]
    size = _running_mean(np.interp(np.arange(T), np.flatnonzero(measured), height[measured]), window)
    power, count = np.zeros(T), np.zeros(T)
    for joint, hip in _LEGS:
        about = (pixels[:, joint] - pixels[:, hip]) / size[:, None]
        visible = np.isfinite(about).all(axis=-1)
        about = np.where(visible[:, None], about, 0.0)
        share = np.maximum(_running_mean(visible.astype(float), window), 1.0 / window)
        mean = np.stack([_running_mean(about[:, axis], window) for axis in (0, 1)], axis=-1) / share[:, None]
        square = _running_mean((about**2).sum(axis=-1), window) / share
        enough = share > 0.5
        power += np.where(enough, np.maximum(square - (mean**2).sum(axis=-1), 0.0), 0.0)
        count += enough
    motion = np.sqrt(power / np.maximum(count, 1))
    moving = (motion > MOVING_SHARE * np.percentile(motion, 80)) | (count == 0)
    if moving.mean() >= MOVING_THROUGHOUT_SHARE:
        return [(0, T)]
    parts = [part for part in _runs(moving) if part[1] - part[0] >= MIN_WALK_S * frame_rate_hz]
    return sorted(parts, key=lambda s: s[0] - s[1]) or [(0, T)]


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Return the runs of true values in `flags`, each as its first index and the index after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]


def straight_stretches(
    pixels: np.ndarray, heights_mm: np.ndarray, frame_rate_hz: float, focal_px: float
) -> list[tuple[int, int]]:
    """Return the straight stretches of a person's track, the longest first.

    A stretch is its first frame and the frame after its last.

    Parameters
    ----------
    pixels : (T, 15, 2)
        Relative to the principal point, NaN where missing.
    heights_mm : (15,)
        Mean heights of the average walker's joints, mm.
    frame_rate_hz, focal_px : float

    Notes
    -----
    The path on the ground follows from size and position in the image, smoothed over about a second.  A stretch ends
    where the path turns or the person stops.  On a treadmill, or with a following camera, there is no path and the
    track is one stretch.
    """
    T = len(pixels)
    full_track = [(0, T)]
    across, inverse, good = _ground_path(pixels, heights_mm)
    window = max(round(0.8 * frame_rate_hz) | 1, 3)
    if good.sum() < MIN_WALK_S * frame_rate_hz or window * 2 > T:
        return full_track
    smooth = _running_mean(inverse, window)
    away = smooth * focal_px
    right = _running_mean(across * smooth, window)
    step = window // 2
    velocity = np.column_stack([_central(right, step), _central(away, step)]) * frame_rate_hz
    speed = np.hypot(*velocity.T)
    typical = np.percentile(speed, 75)
    if typical < 400.0:
        return full_track
    heading = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    turning = np.abs(_central(heading, step)) * frame_rate_hz > TURN_RAD_S
    moving = speed > 0.35 * typical
    stretches = []
    for start, stop in _runs(moving & ~turning):
        if stop - start < MIN_WALK_S * frame_rate_hz:
            continue
        drift = np.abs(heading[start:stop] - np.median(heading[start:stop]))
        if np.percentile(drift, 90) < np.radians(60.0):
            stretches.append((start, stop))
    if sum(stop - start for start, stop in stretches) < MIN_STRAIGHT_SHARE * T:
        return full_track
    return sorted(stretches, key=lambda s: s[0] - s[1])


def _ground_path(pixels: np.ndarray, heights_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the body's image column (T,), its distance over focal length (T,), mm per pixel, and a frame mask (T,).

    The mask marks the frames in which both were measured; other frames are interpolated.
    """
    visible = np.isfinite(pixels).all(axis=-1)
    slope = image_scale(np.where(visible, pixels[..., 1], 0.0), visible.astype(float), heights_mm)
    good = (visible.sum(axis=1) >= 4) & (slope > 0)
    if not good.any():
        return np.zeros(len(pixels)), np.zeros(len(pixels)), good
    frames = np.arange(len(pixels))
    across = (np.where(visible, pixels[..., 0], 0.0).sum(axis=1) / np.maximum(visible.sum(axis=1), 1))[good]
    return (
        np.interp(frames, frames[good], across), 1.0 / np.interp(frames, frames[good], slope[good]), good,
    )  # fmt: skip


def path_turn_rad(pixels: np.ndarray, heights_mm: np.ndarray, focal_px: float) -> float:
    """Return the change in the direction of the path over a stretch (T, 15, 2), from its first to its last frame, rad.

    Only position and size in the image are used: detectors exaggerate the turn of a body that is seen from the side.
    """
    across, inverse, good = _ground_path(pixels, heights_mm)
    if good.sum() < 8:
        return 0.0
    unit = np.linspace(-1.0, 1.0, len(pixels))
    positions = np.column_stack([across * inverse, focal_px * inverse])[good]
    _, along, bent = np.polynomial.polynomial.polyfit(unit[good], positions, 2)
    start, end = (np.arctan2(*(along + side * 2.0 * bent)) for side in (-1.0, 1.0))
    return (end - start + np.pi) % (2.0 * np.pi) - np.pi


def _running_mean(values: np.ndarray, window: int) -> np.ndarray:
    padded = np.pad(values, window // 2, mode="edge")
    return np.convolve(padded, np.full(window, 1.0 / window), mode="valid")


def _central(values: np.ndarray, step: int) -> np.ndarray:
    """Return the slopes of `values` per frame, as differences over `step` frames to either side.

    At the ends, only the frames that exist are used.
    """
    after = np.minimum(np.arange(len(values)) + step, len(values) - 1)
    before = np.maximum(np.arange(len(values)) - step, 0)
    return (values[after] - values[before]) / (after - before)
