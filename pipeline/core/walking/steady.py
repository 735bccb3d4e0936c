"""Extraction of the steady part of a walk, and its treadmill equivalent (zhang2007 section 2).

The papers recorded on a treadmill.  Most recordings are overground: people stand, set off, turn and stop.  Here
the steady part is found, its path is taken out and its heading is turned to +y, so that what is left is what a
treadmill would have shown.

Symbols
-------
``positions``  (T, 15, 3) mm, WALKER15, z up, any heading
``facing``     unit horizontal direction at right angles to the hip axis, forwards
``heading``    direction of the path of the pelvis, rad, from +x
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import polynomial

from pipeline.core.choice import first_lowest
from pipeline.core.fourier import SEARCH_HZ, design, single_frequency_power
from pipeline.skeleton import LEFT_LEG, PELVIS, RIGHT_LEG
from pipeline.validation import InvalidInput, require_choice, told_apart

STANDING_MM = 60.0
"""Smallest root mean square of the fore-aft distance between the ankles in a walk, mm."""

SLOWEST_HZ = 4.0 * SEARCH_HZ[1]
"""Smallest frame rate, Hz, which still resolves two harmonics of the fastest stride."""

SHORT_STRIDES = 2.0
"""Number of strides below which the path is estimated as a straight line, jointly with the walk's harmonics."""

TREADMILL_MM_S = 250.0
"""Speed of the pelvis, mm/s, below which a walk counts as treadmill walking."""

_TIGHTNESS = (0.4, 0.6, 0.8, 1.0)
"""Fractions of the allowed range of speeds that the search tries, narrowest first."""

_ENOUGH_STRIDES = 2.0
"""Number of strides that suffice for the search to accept a narrower range of speeds."""


@dataclass(frozen=True)
class Stretch:
    """The steady part of a clip: frames ``start`` to ``stop`` (exclusive).

    Attributes
    ----------
    start, stop : int
    locomotion : {"overground", "treadmill"}
    speed_mm_s : float
        Median speed of the pelvis within the stretch (0 on a treadmill).
    turn_rad : float
        Change of heading from end to end.
    cycles : float
        About how many strides it holds.
    """

    start: int
    stop: int
    locomotion: str
    speed_mm_s: float
    turn_rad: float
    cycles: float


def facing(positions: np.ndarray) -> np.ndarray:
    """Return the horizontal unit vector (T, 2) towards which the hips face."""
    right = positions[:, RIGHT_LEG[0], :2] - positions[:, LEFT_LEG[0], :2]
    forward = np.stack([-right[:, 1], right[:, 0]], axis=-1)  # z x right
    length = np.linalg.norm(forward, axis=-1, keepdims=True)
    return forward / np.where(length > 0, length, 1.0)


def _fore_aft(positions: np.ndarray) -> np.ndarray:
    """Return the fore-aft distance (T,), mm, of the left ankle ahead of the right one."""
    between_ankles = positions[:, LEFT_LEG[2], :2] - positions[:, RIGHT_LEG[2], :2]
    return (between_ankles * facing(positions)).sum(axis=-1)


def _stride(signal: np.ndarray, frame_rate_hz: float) -> int:
    """Return the number of frames in a stride, from the strongest frequency of the ankles' fore-aft distance."""
    candidates = np.arange(SEARCH_HZ[0], SEARCH_HZ[1], 0.01)
    power = single_frequency_power(candidates, np.arange(len(signal)) / frame_rate_hz, signal)
    return max(round(frame_rate_hz / candidates[first_lowest(-power)]), 5)


def _velocity(path: np.ndarray, window: int, frame_rate_hz: float) -> np.ndarray:
    """Return the mean velocity (T, 2) over one cycle around each frame of a path, constant near both ends.

    What sways and surges once or twice a cycle returns after one, so a difference over one cycle does not see
    it; the slope of a regression would.
    """
    window = min(window, len(path) - 1)
    inner = (path[window:] - path[:-window]) * (frame_rate_hz / window)
    before = window // 2
    return np.pad(inner, ((before, len(path) - len(inner) - before), (0, 0)), mode="edge")


def longest_run(flags: np.ndarray) -> tuple[int, int]:
    """Return start and stop of the longest run of True in an array (T,), or 0, 0 if it contains no True.

    If two runs are equally long, the first is returned.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    if not len(edges):
        return 0, 0
    runs = edges.reshape(-1, 2)
    start, stop = runs[np.argmax(runs[:, 1] - runs[:, 0])]
    return int(start), int(stop)


def steady_stretch(
    positions: np.ndarray,
    whole: np.ndarray,
    frame_rate_hz: float,
    *,
    locomotion: str = "auto",
    speed_band: float = 0.35,
    turn_rad_s: float = np.radians(45.0),
    cycles: float = 1.0,
) -> Stretch:
    """Find the longest stretch of steady walking in a clip.

    Steady: every joint seen, the speed of the pelvis (over about one cycle) within a band of its median, and
    the heading changing slowly.  Narrower bands are tried first and taken where they leave two strides.

    Parameters
    ----------
    positions : (T, 15, 3)
        mm.
    whole : (T,) bool
        Frames in which every joint is known.
    frame_rate_hz : float
    locomotion : {"auto", "overground", "treadmill"}
    speed_band, turn_rad_s, cycles : float
        Widest band relative to the median speed, fastest turn, least number of strides.

    Raises
    ------
    InvalidInput
        With the reason why the clip has no such stretch, or if the kind of locomotion is unknown.
    """
    require_choice("locomotion", locomotion, ("auto", "overground", "treadmill"))
    if frame_rate_hz < SLOWEST_HZ:
        raise InvalidInput(
            "the frame rate is too low to resolve strides; check that it is not the time between frames",
            expected=f"{SLOWEST_HZ:g} Hz or more",
            received=f"{frame_rate_hz:g} Hz",
            code="rate_too_low",
            frame_rate_hz=frame_rate_hz,
        )
    first, last = longest_run(whole)
    frames = last - first
    if frames < max(frame_rate_hz * cycles / SEARCH_HZ[1], 5):
        raise InvalidInput(
            "no steady walking: too few consecutive frames in which every joint is visible",
            expected=f"enough frames for {cycles:g} strides",
            received=f"{frames} of {len(whole)}",
            code="too_few_frames",
            frames=frames,
        )
    block = positions[first:last]
    signal = _fore_aft(block)
    stride = _stride(signal, frame_rate_hz)
    velocity = _velocity(block[:, PELVIS, :2], stride, frame_rate_hz)
    speed = np.linalg.norm(velocity, axis=-1)
    fast, peak = np.percentile(speed, 90), speed.max()
    if locomotion == "auto":  # the peak distinguishes a treadmill from standing most of the time
        slow = fast < TREADMILL_MM_S and peak < 2.0 * TREADMILL_MM_S
        locomotion = "treadmill" if slow else "overground"
    start, stop, typical, turn = 0, frames, 0.0, 0.0
    if locomotion == "overground":
        moving = speed >= 0.5 * max(fast, min(peak, TREADMILL_MM_S))
        typical = np.median(speed[moving])
        heading = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
        turning = np.abs(np.gradient(heading) * frame_rate_hz)
        for tightness in _TIGHTNESS:
            near = np.abs(speed - typical) <= tightness * speed_band * typical
            start, stop = longest_run(near & (turning <= turn_rad_s))
            if stop - start >= max(cycles, _ENOUGH_STRIDES) * stride:
                break
        if stop - start >= 5:
            stride = _stride(signal[start:stop], frame_rate_hz)
            typical = np.median(speed[start:stop])
            turn = heading[stop - 1] - heading[start]
            along = (facing(block) * velocity).sum(axis=-1)
            if np.median((along - 0.5 * speed)[start:stop]) < 0:
                raise InvalidInput(
                    "no steady walking: the person walks backwards, or left and right or two axes are exchanged",
                    code="not_forwards",
                )
    strides = (stop - start) / stride
    _require_strides(strides, cycles, float(np.std(signal[start:stop])) if strides >= cycles else np.inf)
    return Stretch(first + start, first + stop, locomotion, typical, turn, strides)


def _require_strides(strides: float, cycles: float, distance_mm: float) -> None:
    """Check that a stretch contains enough strides, and that the ankles pass each other far enough."""
    if strides < cycles:
        raise InvalidInput(
            "no steady walking: the longest part of steady walking is too short",
            expected=f"at least {cycles:g} strides",
            received=told_apart(strides, cycles, 2),
            code="too_short",
            cycles=strides,
        )
    if distance_mm < STANDING_MM:
        raise InvalidInput(
            "no steady walking: the feet hardly pass each other",
            expected=f"a fore-aft distance of the ankles of {STANDING_MM:g} mm (root mean square)",
            received=f"{told_apart(distance_mm, STANDING_MM, 0)} mm",
            code="feet_hardly_pass",
            distance_mm=distance_mm,
        )


def _running_mean(path: np.ndarray, window: int) -> np.ndarray:
    """Return the running mean of a path (T, 2), with fitted straight lines at both ends."""
    total = np.concatenate([np.zeros((1, 2)), np.cumsum(path, axis=0)])
    offset = np.arange(window) - window // 2

    def line(block: np.ndarray) -> np.ndarray:
        return block.mean(axis=0) + np.outer(offset, offset @ block / (offset @ offset))

    start, end = line(path[:window])[: window // 2], line(path[-window:])[window // 2 + 1 :]
    return np.concatenate([start, (total[window:] - total[:-window]) / window, end])


def treadmill_equivalent(
    positions: np.ndarray, frame_rate_hz: float, *, locomotion: str, path: str = "cubic"
) -> np.ndarray:
    """Return the treadmill equivalent (T, 15, 3), mm, of a steady walk: without its path, and heading along +y.

    Parameters
    ----------
    positions : (T, 15, 3)
        mm.
    frame_rate_hz : float
    locomotion : {"overground", "treadmill"}
        Overground, each frame turns by the local heading of the path; on a treadmill, all by the mean facing.
    path : {"cubic", "moving_average"}
        The smooth horizontal path of the pelvis that is subtracted: a cubic in time, or the mean over about
        one cycle around each frame.  A straight trend is not enough: on clips that veer it leaves a tenth to
        a half of the variance unexplained.  But over less than `SHORT_STRIDES` a cubic would take sway and surge
        with it: there it is a straight line, regressed together with two harmonics (one stride cut out of long
        clips is then 11 mm rms off the whole clip's representation, in place of 32 mm).
    """
    require_choice("path", path, ("cubic", "moving_average"))
    pelvis = positions[:, PELVIS, :2]
    stride = _stride(_fore_aft(positions), frame_rate_hz)
    if path == "cubic":
        time = np.linspace(-1.0, 1.0, len(positions))
        if len(positions) < SHORT_STRIDES * stride:
            columns = design(frame_rate_hz / stride, np.arange(len(positions)) / frame_rate_hz, 2)
            weights = np.linalg.lstsq(np.column_stack([columns, time]), pelvis)[0][[0, -1]]
        else:
            weights = polynomial.polyfit(time, pelvis, 3)
        smooth = polynomial.polyval(time, weights).T
        velocity = polynomial.polyval(time, polynomial.polyder(weights)).T
    else:
        window = min(stride | 1, len(pelvis) - (1 - len(pelvis) % 2))
        smooth = _running_mean(pelvis, window)
        velocity = _velocity(pelvis, stride, frame_rate_hz)
    if locomotion == "treadmill":
        velocity = np.broadcast_to(facing(positions).mean(axis=0), velocity.shape)
    turn = np.pi / 2 - np.arctan2(velocity[:, 1], velocity[:, 0])
    level = np.array(positions, float)
    level[..., :2] -= smooth[:, None]
    return turn_about_vertical(level, turn[:, None])


def step_heading(coefficients: np.ndarray) -> float:
    """Return the direction of the steps, rad from +y towards -x, of a walk that heads roughly along +y.

    It is the main horizontal axis of the motion between the ankles.

    Parameters
    ----------
    coefficients : (1 + 2H, 15, 3)
        Fourier representation, mm; its mean posture takes no part.

    Notes
    -----
    The axis of the largest variance over a cycle of left minus right ankle, over all harmonics.  It averages over every
    step, while the tangent of a path of two or three strides also follows a sideways drift.
    """
    between_ankles = coefficients[1:, LEFT_LEG[2], :2] - coefficients[1:, RIGHT_LEG[2], :2]
    xx, xy, yy = (
        between_ankles[:, 0] @ between_ankles[:, 0],
        between_ankles[:, 0] @ between_ankles[:, 1],
        between_ankles[:, 1] @ between_ankles[:, 1],
    )
    return -0.5 * np.arctan2(2.0 * xy, yy - xx)


def turn_about_vertical(positions: np.ndarray, angle_rad: float | np.ndarray) -> np.ndarray:
    """Return the positions (…, 3) rotated about z, counter-clockwise seen from above."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    x, y = positions[..., 0], positions[..., 1]
    return np.stack([c * x - s * y, s * x + c * y, positions[..., 2]], axis=-1)
