"""Who is reconstructed: tracks of people through the video, and the straight stretches of one track."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.validation import InvalidInput

JUMP = (0.09, 2.2)
"""Share of the height, and of it per second, that half of a person's joints may move from one frame to the next; who
moves farther is another one, or another video."""
GAP_S = 0.5
"""A person unseen for longer begins anew."""
TURN_RAD_S = np.radians(50.0)
SHORTEST_S = 0.9
LEAST_STRAIGHT = 0.5
"""If straight stretches hold a smaller share of the frames, the path was not measured well enough to cut by it."""


@dataclass(frozen=True)
class Track:
    """One person through successive frames.

    Attributes
    ----------
    identity : str
        As the file says, mostly; empty if it does not.
    frame : (n,) int
        Frames of the video.
    rows : (n,) int
        Detections.
    height_px : float
        Median height in the image.
    """

    identity: str
    frame: np.ndarray
    rows: np.ndarray
    height_px: float


def _moved(one: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Median distance (M,) of the joints (15, 2) of one detection from those of M others that have them, too.

    Infinite where they share fewer than three.
    """
    distance = np.sort(np.linalg.norm(others - one, axis=-1), axis=-1)  # what is missing comes last
    count = np.isfinite(distance).sum(axis=-1)
    each = np.arange(len(others))
    middle = (distance[each, np.maximum(count - 1, 0) // 2] + distance[each, np.minimum(count // 2, 14)]) / 2
    return np.where(count >= 3, middle, np.inf)


def _heights(pixels: np.ndarray) -> np.ndarray:
    """Heights (N,) of joints (N, 15, 2) in the image; NaN where too few are seen."""
    seen = np.isfinite(pixels).all(axis=-1)
    enough = seen.sum(axis=1) >= 4
    height = np.full(len(pixels), np.nan)
    for n in np.flatnonzero(enough):
        points = pixels[n, seen[n]]
        height[n] = max(np.ptp(points[:, 1]), np.ptp(points[:, 0]), 1e-9)
    return height


def find_tracks(
    frame: np.ndarray, identity: np.ndarray, pixels: np.ndarray, frame_rate_hz: float
) -> list[Track]:
    """Tracks of people, the longest first.

    Parameters
    ----------
    frame : (N,) int
    identity : (N,) str
    pixels : (N, 15, 2)
    frame_rate_hz : float

    Notes
    -----
    A detection continues the nearest track that ended not long ago, by place and size; one with the same identity is
    preferred.  Identities are not trusted further: detectors exchange and lose them.
    """
    height = _heights(pixels)
    longest_gap = max(round(GAP_S * frame_rate_hz), 1)
    open_: list[list[int]] = []
    closed: list[list[int]] = []
    for now in np.unique(frame):
        rows = [int(n) for n in np.flatnonzero(frame == now) if np.isfinite(height[n])]
        for track in [t for t in open_ if now - frame[t[-1]] > longest_gap]:
            open_.remove(track)
            closed.append(track)
        pairs = []
        last = np.array([track[-1] for track in open_], dtype=int)
        allowed = np.maximum(JUMP[0], JUMP[1] * (now - frame[last]) / frame_rate_hz)
        for n in rows:
            away = _moved(pixels[n], pixels[last]) / np.maximum(height[last], height[n])
            cost = away + 0.25 * (identity[n] != identity[last])
            pairs += [(float(cost[place]), n, int(place)) for place in np.flatnonzero(away < allowed)]
        used_rows, used_tracks = set(), set()
        for _, n, place in sorted(pairs):
            if n not in used_rows and place not in used_tracks:
                open_[place].append(n)
                used_rows.add(n)
                used_tracks.add(place)
        open_ += [[n] for n in rows if n not in used_rows]
    tracks = []
    for rows in closed + open_:
        at = np.array(rows)
        names, counts = np.unique(identity[at], return_counts=True)
        tracks.append(Track(str(names[np.argmax(counts)]), frame[at], at, float(np.median(height[at]))))
    # Length, then size in the image, then the first frame decide.
    return sorted(tracks, key=lambda t: (-len(t.rows), -t.height_px, int(t.frame[0])))


def choose(tracks: list[Track], person: str) -> Track:
    """The longest track, or that of the person named.

    Raises
    ------
    InvalidInput
        If there is no such person.
    """
    if not tracks:
        raise InvalidInput("no person is seen with four joints or more in any frame")
    if not person:
        return tracks[0]
    for track in tracks:
        if track.identity == person:
            return track
    if person.isdigit() and 1 <= int(person) <= len(tracks) and not any(track.identity for track in tracks):
        return tracks[int(person) - 1]
    listed = sorted({track.identity for track in tracks if track.identity}) or [f"1 to {len(tracks)}"]
    raise InvalidInput(
        "there is no such person", where="input.person", expected=", ".join(listed), received=person
    )


def straight_stretches(
    pixels: np.ndarray, heights_mm: np.ndarray, frame_rate_hz: float, focal_px: float
) -> list[tuple[int, int]]:
    """Straight stretches of a track: frames from and to (exclusive), the longest first.

    Parameters
    ----------
    pixels : (T, 15, 2)
        Relative to the principal point, NaN where missing.
    heights_mm : (15,)
        Mean heights of the average walker's joints, mm.
    frame_rate_hz, focal_px : float

    Notes
    -----
    The path on the ground, from the size and the place in the image, smoothed over about a second; where its direction
    turns, or somebody who else moves stands, a stretch ends.  On a treadmill, or before a camera that follows, there is
    no path and all is one stretch.
    """
    T = len(pixels)
    whole = [(0, T)]
    seen = np.isfinite(pixels).all(axis=-1)
    weight = seen.astype(float)
    total = np.maximum(weight.sum(axis=1), 1.0)
    z = heights_mm - (weight @ heights_mm / total)[:, None]
    rows = np.where(seen, pixels[..., 1], 0.0)
    slope = -(weight * z * rows).sum(axis=1) / np.maximum((weight * z**2).sum(axis=1), 1e-9)
    good = (seen.sum(axis=1) >= 4) & (slope > 0)
    if good.sum() < SHORTEST_S * frame_rate_hz:
        return whole
    frames = np.arange(T)
    scale = np.interp(frames, frames[good], slope[good])
    across = np.interp(frames, frames[good], (np.where(seen, pixels[..., 0], 0.0).sum(axis=1) / total)[good])
    window = max(round(0.8 * frame_rate_hz) | 1, 3)
    if window * 2 > T:
        return whole
    smooth = _running_mean(1.0 / scale, window)
    away = smooth * focal_px
    right = _running_mean(across * smooth, window)
    step = window // 2
    velocity = np.stack([_central(right, step), _central(away, step)], axis=-1) * frame_rate_hz
    speed = np.hypot(*velocity.T)
    typical = float(np.percentile(speed, 75))
    if typical < 400.0:
        return whole
    heading = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    turning = np.abs(_central(heading, step)) * frame_rate_hz > TURN_RAD_S
    moving = speed > 0.35 * typical
    found = []
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (moving & ~turning).astype(int), [0]])))
    for start, stop in edges.reshape(-1, 2).tolist():
        if stop - start < SHORTEST_S * frame_rate_hz:
            continue
        drift = np.abs(heading[start:stop] - np.median(heading[start:stop]))
        if float(np.percentile(drift, 90)) < np.radians(60.0):
            found.append((start, stop))
    if sum(stop - start for start, stop in found) < LEAST_STRAIGHT * T:
        return whole
    return sorted(found, key=lambda s: (s[0] - s[1], s[0]))


def _running_mean(values: np.ndarray, window: int) -> np.ndarray:
    padded = np.pad(values, window // 2, mode="edge")
    return np.convolve(padded, np.full(window, 1.0 / window), mode="valid")


def _central(values: np.ndarray, step: int) -> np.ndarray:
    """Slopes per frame over `step` frames on either side, one-sided at the ends."""
    after = np.minimum(np.arange(len(values)) + step, len(values) - 1)
    before = np.maximum(np.arange(len(values)) - step, 0)
    return np.asarray((values[after] - values[before]) / (after - before))
