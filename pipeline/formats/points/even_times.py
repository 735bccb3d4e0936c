"""Resampling of rows with time stamps to frames at equal intervals; gaps become missing frames."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pipeline.formats.budget import require_points
from pipeline.formats.contract import damaged
from pipeline.skeleton.complaint import Remark
from pipeline.validation import InvalidInput

MAX_INTERVAL = 2.5
"""Longest interval between rows that is interpolated, as a multiple of the typical interval.

Longer intervals are gaps.
"""
MAX_STEPS = 10_000
"""Largest number of intervals between rows from which the frame rate is estimated."""
MAX_SPACING = 8
"""Largest distance, in rows, between two rows whose time difference contributes to the estimated frame rate."""
MAX_ROW_FRAMES = 10
"""Median number of frames between unevenly timed rows above which the declared frame rate is rejected."""
RATE_TOLERANCE = 0.01
"""Largest accepted relative difference between the frame rate computed from times and the declared frame rate."""

_UNITS = {"milliseconds": 1e3, "microseconds": 1e6, "ticks of 100 ns": 1e7, "nanoseconds": 1e9}
MAX_STEP = {"milliseconds": 1.5e3, "microseconds": 5e4, "ticks of 100 ns": 2e6, "nanoseconds": np.inf}
"""Longest plausible interval between frames for each unit of time, in that unit.

Times with longer intervals are in a smaller unit.
"""


def unit_of_times(step: float, declared_hz: float | None = None) -> tuple[str, float] | None:
    """Return the unit of times that are not in seconds, and the number of units per second; None if it is ambiguous.

    Parameters
    ----------
    step : float
        Typical time between frames, above 1.
    declared_hz : float or None
        Declared rate; a unit that gives this rate within 10 % is used.
    """
    by_rate = (unit for unit, size in _UNITS.items() if abs(step * (declared_hz or 0.0) / size - 1) < 0.1)
    unit = next(by_rate, "") or next(unit for unit, max_step in MAX_STEP.items() if step <= max_step)
    if declared_hz is None and MAX_STEP["microseconds"] < step < 2e5:
        return None  # 5 to 20 Hz in microseconds, or 50 to 200 in ticks
    return unit, _UNITS[unit]


def at_equal_intervals(
    times_s: np.ndarray,
    positions: np.ndarray,
    declared_hz: float | None,
    location: Callable[[int], str],
    notes: list[str],
) -> tuple[np.ndarray, float]:
    """Resample positions to frames (T', P, 3) at equal intervals, and return them with the frame rate, Hz.

    Parameters
    ----------
    times_s : (T,) float64
    positions : (T, P, 3) float64
        Positions, NaN where missing.
    declared_hz : float or None
    location : callable
    notes : list of str
        As in `frames_of`, like times_s, declared_hz and location.

    Raises
    ------
    InvalidInput
        If `frames_of` raises, or nearly all frames are missing.
    """
    at, rate = frames_of(times_s, declared_hz, location, notes)
    count = int(at[-1] + 1e-6) + 1
    even = not (at % 1).any()
    if even and count == len(at):
        return positions, rate
    require_points(
        count,
        positions.shape[1],
        location(int(np.diff(at).argmax()) + 1),
        "the times have a jump that is too large",
        code="times_jump",
    )
    if not even:
        return _interpolated(at, positions, np.arange(float(count))), rate
    filled = np.full((count, *positions.shape[1:]), np.nan)
    filled[at.astype(int)] = positions
    notes.append(f"{count - len(positions)} frames have no row and are missing.")
    return filled, rate


def frames_of(
    times_s: np.ndarray, declared_hz: float | None, location: Callable[[int], str], notes: list[str]
) -> tuple[np.ndarray, float]:
    """Return the frame number (T,) of each row, counted from 0 and possibly fractional, and the frame rate, Hz.

    Positions are fractional if the times are non-uniform.

    Parameters
    ----------
    times_s : (T,) float64
        Times of the rows, s.
    declared_hz : float or None
        Frames per second that the file declares.  If all rows are a whole number of these frames apart, the rate of
        the times is used: the recording was decimated, and the header was not changed.
    location : callable
        Function that gives the location of a row in the file, for errors.
    notes : list of str

    Raises
    ------
    InvalidInput
        If times do not increase, are too coarse, or contradict the declared rate.
    """
    times_s = _in_seconds(times_s, declared_hz, location, notes)
    steps = np.diff(times_s)
    if not steps.size:
        if declared_hz is None:
            raise damaged(
                "the frame rate is unknown",
                location(0),
                "two frames or more, or a rate in the header",
                code="unknown_rate",
            )
        return np.zeros(1), declared_hz
    duration = float(times_s[-1] - times_s[0])
    # Printed times with uniform steps are exact.
    rounding = _rounding(times_s) if np.abs(steps / steps.mean() - 1).max() > 1e-6 else 0.0
    rate = declared_hz or _rate(times_s, rounding)
    frames, off = _whole_frames(steps, rate)
    if declared_hz is not None and len(frames) > 1 and (usual := np.median(frames)) > 1:
        row_rate = _rate(times_s, rounding)
        spacing = max(round(rate / row_rate), 1)
        # Repeatedly lost rows leave steps of one, two and three frames: this is not decimation.
        decimated = spacing > 1 and _whole_frames(steps, row_rate)[1].max() <= _allowance(rounding, row_rate)
        whole = abs(rate / row_rate / spacing - 1) <= RATE_TOLERANCE + rounding / duration
        if not whole if decimated else usual > MAX_ROW_FRAMES and len(frames) > 2:
            raise _contradiction(location, rate, row_rate)
        if decimated:
            rate /= spacing
            frames, off = _whole_frames(steps, rate)
            notes.append(
                f"All rows are {spacing} frames apart: their rate of {rate:g} Hz is used "
                f"instead of {declared_hz:g} Hz from the header or the option."
            )
    if not 1 <= rate <= 1e6:
        raise damaged(
            "the times are not in seconds", location(1), "1 Hz or more", f"{rate:g} Hz", code="not_seconds"
        )
    span = frames.sum()
    if (
        declared_hz is not None
        and abs(span / (duration * rate) - 1) > RATE_TOLERANCE + rounding * rate / span
    ):
        raise _contradiction(location, rate, span / duration)
    doubt = rounding / duration
    if declared_hz is None and off.max() > 1e-6 and doubt > 0.01:
        raise damaged(
            "the times have too few digits to give the frame rate within 1 %",
            location(0),
            "the option frame_rate_hz, or a rate in the header",
            f"{rate:.4g} Hz ± {100 * doubt:.2g} %",
            code="coarse_times",
            rate_hz=rate,
            doubt=doubt,
        )
    even = off.max() <= _allowance(rounding, rate)
    if declared_hz is None:
        rate = _whole(span / duration if even else rate, doubt)
    if even:
        return np.append(0.0, np.cumsum(frames)), rate
    spread = f"{steps.min():.4g} to {steps.max():.4g} s"
    notes.append(
        Remark(f"The times are not evenly spaced ({spread}); they are resampled to {rate:.6g} Hz.", "times")
    )
    return (times_s - times_s[0]) * rate, rate


def _whole_frames(steps: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Round time steps (T,), s, to whole frames, at least 1; return frames (T,) and rounding errors (T,) in frames."""
    frames = np.maximum(np.round(steps * rate), 1)
    return frames, np.abs(steps * rate - frames)


def _allowance(rounding: float, rate: float) -> float:
    """Return the largest rounding error, in frames, up to which times count as uniform."""
    return 0.02 + 1.1 * rounding * rate


def _contradiction(location: Callable[[int], str], declared_hz: float, times_hz: float) -> InvalidInput:
    return damaged(
        "the times contradict the frame rate of the header or the option",
        location(1),
        f"{declared_hz:g} Hz",
        f"{times_hz:.4g} Hz",
        code="rate_contradiction",
        stated_hz=declared_hz,
        times_hz=times_hz,
    )


def _rate(times_s: np.ndarray, rounding: float) -> float:
    """Return the lowest frame rate, Hz, at which most time steps are close to whole numbers of frames.

    Rates with frames hardly longer than the last printed digit are penalised, because any time is close to a frame.
    """
    steps = np.diff(times_s)
    typical = np.median(steps)
    usual = steps[steps <= MAX_INTERVAL * typical][:MAX_STEPS]
    frames = np.arange(0.8, 3.3, 0.01)  # frames in a typical step
    fit = np.cos(2 * np.pi / typical * np.outer(frames, usual)).mean(axis=1)
    price = 0.1 + 1 / len(usual) + 1.5 * rounding / typical
    rate = frames[np.argmax(fit - price * frames)] / typical
    for spacing in range(
        1, min(MAX_SPACING, len(steps)) + 1
    ):  # with a larger spacing, a late frame matters less
        spans = times_s[spacing:] - times_s[:-spacing]
        spans = spans[spans <= MAX_INTERVAL * np.median(spans)]
        rate = np.maximum(np.round(spans * rate), 1).sum() / spans.sum()
    return float(rate)


def _in_seconds(
    times: np.ndarray, declared_hz: float | None, location: Callable[[int], str], notes: list[str]
) -> np.ndarray:
    """Return times in seconds, after checking that the times increase."""
    steps = np.diff(times)
    wrong = np.flatnonzero(~(steps > 0)) if np.isfinite(times[0]) else np.array([-1])
    if wrong.size:
        k = int(wrong[0]) + 1
        raise damaged(
            "the time does not increase from the line before",
            location(k),
            "increasing times",
            f"{times[k]:g} s",
            code="time_order",
        )
    if len(steps) < 2 or steps.min() <= 1.5:
        return times
    step = np.median(steps)
    if (unit_and_size := unit_of_times(step, declared_hz)) is None:
        raise damaged(
            "the unit of the times is ambiguous: microseconds or ticks of 100 ns",
            location(1),
            "the option frame_rate_hz",
            f"frames {step:g} apart",
            code="unclear_time_unit",
        )
    unit, size = unit_and_size
    notes.append(Remark(f"The times are read as {unit}: frames are {step:g} apart.", "times"))
    return times / size


def _rounding(times_s: np.ndarray) -> float:
    """Return the value of the last decimal digit of printed times, s; 0 if the times have more than six decimals."""
    for decimals in range(1, 7):
        if np.abs(np.round(times_s, decimals) - times_s).max() < 1e-9 * max(1.0, np.abs(times_s).max()):
            return float(10.0**-decimals)
    return 0.0


def _whole(exact: float, doubt: float) -> float:
    """Round a frame rate to whole hertz, or else to tenths, if the relative change is at most `doubt`."""
    for candidate in (float(round(exact)), round(exact, 1)):
        if abs(candidate - exact) <= max(doubt, 1e-9) * exact:
            return candidate
    return float(f"{exact:.12g}")


def _interpolated(times: np.ndarray, positions: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Interpolate positions at the times of a grid with cubic Hermite polynomials; parabolas give the slopes."""
    if len(times) < 3:
        slopes = np.repeat(np.diff(positions, axis=0) / (times[1] - times[0]), len(times), axis=0)
    else:
        step = np.diff(times)[:, None, None]
        chord = np.diff(positions, axis=0) / step
        inner = (step[1:] * chord[:-1] + step[:-1] * chord[1:]) / (step[1:] + step[:-1])
        # Next to a missing sample only the chord on the other side is available.
        inner = np.where(np.isnan(inner), np.where(np.isnan(chord[1:]), chord[:-1], chord[1:]), inner)
        slopes = np.concatenate([chord[:1], inner, chord[-1:]])
    k = np.clip(np.searchsorted(times, grid, side="right") - 1, 0, len(times) - 2)
    width = times[k + 1] - times[k]
    u = ((grid - times[k]) / width)[:, None, None]
    move = positions[k + 1] - positions[k]
    begin, end = (width[:, None, None] * slope - move for slope in (slopes[k], slopes[k + 1]))
    interpolated: np.ndarray = positions[k] + u * move + u * (1 - u) * ((1 - u) * begin - u * end)
    interpolated[width > MAX_INTERVAL * np.median(np.diff(times))] = np.nan
    return interpolated
