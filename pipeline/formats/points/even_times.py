"""Frames at equal intervals from rows with a time each: gaps become missing frames, uneven times are resampled."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pipeline.formats.budget import require_points
from pipeline.formats.contract import damaged
from pipeline.skeleton.complaint import Remark
from pipeline.validation import InvalidInput

_GAP = 2.5
"""Intervals longer than so many typical ones are gaps: nothing is interpolated across them."""
_ENOUGH = 10_000
"""Steps that tell a rate."""
_APART = 8
"""Rows between which frames are counted, at most."""
_SKIPPED = 10
"""Frames from row to row that are no gaps: uneven times contradict the rate that is declared."""
_TOLERANCE = 0.01
"""Share by which the rate of the times may differ from the rate that is declared."""

_UNITS = {"milliseconds": 1e3, "microseconds": 1e6, "ticks of 100 ns": 1e7, "nanoseconds": 1e9}
_LONGEST = {"milliseconds": 1.5e3, "microseconds": 5e4, "ticks of 100 ns": 2e6, "nanoseconds": np.inf}
"""Steps up to which times are in these units."""


def unit_of_times(step: float, declared_hz: float | None = None) -> tuple[str, float] | None:
    """Return the unit of times that are not in seconds, and how many of it a second has; None if it may be two.

    Parameters
    ----------
    step : float
        Typical difference of two frames, more than a second.
    declared_hz : float or None
        Decides, if a unit gives it within a tenth.
    """
    by_rate = (unit for unit, size in _UNITS.items() if abs(step * (declared_hz or 0.0) / size - 1) < 0.1)
    unit = next(by_rate, "") or next(unit for unit, longest in _LONGEST.items() if step <= longest)
    if declared_hz is None and _LONGEST["microseconds"] < step < 2e5:
        return None  # 5 to 20 Hz in microseconds, or 50 to 200 in ticks
    return unit, _UNITS[unit]


def at_equal_intervals(
    times_s: np.ndarray,
    positions: np.ndarray,
    declared_hz: float | None,
    place: Callable[[int], str],
    notes: list[str],
) -> tuple[np.ndarray, float]:
    """Return the frames (T', P, 3) at equal intervals, and their rate in hertz; what was done is noted.

    Parameters
    ----------
    times_s : (T,) float64
    positions : (T, P, 3) float64
        NaN where missing.
    declared_hz : float or None
    place : callable
    notes : list of str
        These as in `frames_of`.

    Raises
    ------
    InvalidInput
        As `frames_of` does, or if times leave nearly everything out.
    """
    at, rate = frames_of(times_s, declared_hz, place, notes)
    count = int(at[-1] + 1e-6) + 1
    even = not (at % 1).any()
    if even and count == len(at):
        return positions, rate
    require_points(
        count, positions.shape[1], place(int(np.diff(at).argmax()) + 1), "the times jump", code="times_jump"
    )
    if not even:
        return _interpolated(at, positions, np.arange(float(count))), rate
    filled = np.full((count, *positions.shape[1:]), np.nan)
    filled[at.astype(int)] = positions
    notes.append(f"{count - len(positions)} frames have no row and are missing.")
    return filled, rate


def frames_of(
    times_s: np.ndarray, declared_hz: float | None, place: Callable[[int], str], notes: list[str]
) -> tuple[np.ndarray, float]:
    """Return the frame (T,) of each row, the first 0, not whole if times are uneven, and the rate in hertz.

    Parameters
    ----------
    times_s : (T,) float64
        Seconds of the rows.
    declared_hz : float or None
        Frames per second that the file declares.  The rate of the times counts where rows are a whole number of these
        frames apart throughout: the recording was decimated, and the header was not changed.
    place : callable
        Where in the file the n-th row stands, for errors.
    notes : list of str

    Raises
    ------
    InvalidInput
        If times do not increase, are too coarse, or contradict the declared rate.
    """
    times_s = _in_seconds(times_s, declared_hz, place, notes)
    steps = np.diff(times_s)
    if not steps.size:
        if declared_hz is None:
            raise damaged(
                "the frame rate is unknown",
                place(0),
                "two frames or more, or a rate in the header",
                code="unknown_rate",
            )
        return np.zeros(1), declared_hz
    duration = float(times_s[-1] - times_s[0])
    # Times that are uniform as they are printed are exact.
    rounding = _rounding(times_s) if np.abs(steps / steps.mean() - 1).max() > 1e-6 else 0.0
    rate = declared_hz or _rate(times_s, rounding)
    frames, off = _whole_frames(steps, rate)
    if declared_hz is not None and len(frames) > 1 and (usual := np.median(frames)) > 1:
        row_rate = _rate(times_s, rounding)
        spacing = max(round(rate / row_rate), 1)
        # Rows that are lost again and again leave some that are one frame apart, or two and three.
        decimated = spacing > 1 and _whole_frames(steps, row_rate)[1].max() <= _allowance(rounding, row_rate)
        whole = abs(rate / row_rate / spacing - 1) <= _TOLERANCE + rounding / duration
        if not whole if decimated else usual > _SKIPPED and len(frames) > 2:
            raise _contradiction(place, rate, row_rate)
        if decimated:
            rate /= spacing
            frames, off = _whole_frames(steps, rate)
            notes.append(
                f"Rows are {spacing} frames apart throughout: their rate, {rate:g} Hz, counts, "
                f"not {declared_hz:g} Hz as the header or the option says."
            )
    if not 1 <= rate <= 1e6:
        raise damaged(
            "the times are not in seconds", place(1), "1 Hz or more", f"{rate:g} Hz", code="not_seconds"
        )
    span = frames.sum()
    if declared_hz is not None and abs(span / (duration * rate) - 1) > _TOLERANCE + rounding * rate / span:
        raise _contradiction(place, rate, span / duration)
    doubt = rounding / duration
    if declared_hz is None and off.max() > 1e-6 and doubt > 0.01:
        raise damaged(
            "the times are printed too coarsely to tell the frame rate within 1 %",
            place(0),
            "the option frame_rate_hz, or a rate in the header",
            f"{rate:.4g} Hz give or take {100 * doubt:.2g} %",
            code="coarse_times",
            rate_hz=rate,
            doubt=doubt,
        )
    even = off.max() <= _allowance(rounding, rate)
    if declared_hz is None:
        rate = _whole(span / duration if even else rate, doubt)
    if even:
        return np.append(0.0, np.cumsum(frames)), rate
    uneven = f"The times are not evenly spaced ({steps.min():.4g} to {steps.max():.4g} s)"
    notes.append(Remark(f"{uneven}; they were resampled to {rate:.6g} Hz.", "times"))
    return (times_s - times_s[0]) * rate, rate


def _whole_frames(steps: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Whole frames (T,) nearest to steps in seconds, one or more each, and how far off the steps are (T,)."""
    frames = np.maximum(np.round(steps * rate), 1)
    return frames, np.abs(steps * rate - frames)


def _allowance(rounding: float, rate: float) -> float:
    """Share of a frame by which even times may be off."""
    return 0.02 + 1.1 * rounding * rate


def _contradiction(place: Callable[[int], str], declared_hz: float, times_hz: float) -> InvalidInput:
    return damaged(
        "the times contradict the frame rate of the header or the option",
        place(1),
        f"{declared_hz:g} Hz",
        f"{times_hz:.4g} Hz",
        code="rate_contradiction",
        stated_hz=declared_hz,
        times_hz=times_hz,
    )


def _rate(times_s: np.ndarray, rounding: float) -> float:
    """Return the lowest rate, in hertz, at which most steps are near to whole frames.

    Rates whose frames are hardly longer than the last decimal count less: printed so, any time is near to one.
    """
    steps = np.diff(times_s)
    typical = np.median(steps)
    usual = steps[steps <= _GAP * typical][:_ENOUGH]
    frames = np.arange(0.8, 3.3, 0.01)  # in a typical step
    fit = np.cos(2 * np.pi / typical * np.outer(frames, usual)).mean(axis=1)
    price = 0.1 + 1 / len(usual) + 1.5 * rounding / typical
    rate = frames[np.argmax(fit - price * frames)] / typical
    for spacing in range(1, min(_APART, len(steps)) + 1):  # the farther, the less a late frame matters
        spans = times_s[spacing:] - times_s[:-spacing]
        spans = spans[spans <= _GAP * np.median(spans)]
        rate = np.maximum(np.round(spans * rate), 1).sum() / spans.sum()
    return float(rate)


def _in_seconds(
    times: np.ndarray, declared_hz: float | None, place: Callable[[int], str], notes: list[str]
) -> np.ndarray:
    """Times that increase, in seconds."""
    steps = np.diff(times)
    wrong = np.flatnonzero(~(steps > 0)) if np.isfinite(times[0]) else np.array([-1])
    if wrong.size:
        k = int(wrong[0]) + 1
        raise damaged(
            "the time does not follow the line before",
            place(k),
            "seconds that increase",
            f"{times[k]:g} s",
            code="time_order",
        )
    if len(steps) < 2 or steps.min() <= 1.5:
        return times
    step = np.median(steps)
    if (unit_and_size := unit_of_times(step, declared_hz)) is None:
        raise damaged(
            "times may be microseconds or ticks of 100 ns",
            place(1),
            "the option frame_rate_hz",
            f"frames {step:g} apart",
            code="unclear_time_unit",
        )
    unit, size = unit_and_size
    notes.append(Remark(f"The times are taken as {unit}: frames are {step:g} apart.", "times"))
    return times / size


def _rounding(times_s: np.ndarray) -> float:
    """Return one unit of the last decimal of times as they were printed; 0 beyond six decimals."""
    for decimals in range(1, 7):
        if np.abs(np.round(times_s, decimals) - times_s).max() < 1e-9 * max(1.0, np.abs(times_s).max()):
            return float(10.0**-decimals)
    return 0.0


def _whole(exact: float, doubt: float) -> float:
    """Return a rate as the whole number of hertz, or of its tenths, within a share of doubt about it."""
    for candidate in (float(round(exact)), round(exact, 1)):
        if abs(candidate - exact) <= max(doubt, 1e-9) * exact:
            return candidate
    return float(f"{exact:.12g}")


def _interpolated(times: np.ndarray, positions: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Return positions at other times, by cubics through neighbours with the slopes of parabolas."""
    if len(times) < 3:
        slopes = np.repeat(np.diff(positions, axis=0) / (times[1] - times[0]), len(times), axis=0)
    else:
        step = np.diff(times)[:, None, None]
        chord = np.diff(positions, axis=0) / step
        inner = (step[1:] * chord[:-1] + step[:-1] * chord[1:]) / (step[1:] + step[:-1])
        # Beside a missing sample the chord of the other side is all that is known.
        inner = np.where(np.isnan(inner), np.where(np.isnan(chord[1:]), chord[:-1], chord[1:]), inner)
        slopes = np.concatenate([chord[:1], inner, chord[-1:]])
    k = np.clip(np.searchsorted(times, grid, side="right") - 1, 0, len(times) - 2)
    width = times[k + 1] - times[k]
    u = ((grid - times[k]) / width)[:, None, None]
    move = positions[k + 1] - positions[k]
    begin, end = (width[:, None, None] * slope - move for slope in (slopes[k], slopes[k + 1]))
    interpolated: np.ndarray = positions[k] + u * move + u * (1 - u) * ((1 - u) * begin - u * end)
    interpolated[width > _GAP * np.median(np.diff(times))] = np.nan
    return interpolated
