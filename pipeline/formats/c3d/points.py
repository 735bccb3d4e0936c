"""Reader of the point trajectories in C3D files, in pure Python.

A C3D file has a 512-byte header, a section of named parameters, and frames of points with analog samples between
them.  This reader returns the points, or the segment origins of a file without points.  It first compares the declared
counts with the file size, so that a damaged file is rejected and never read as a shorter recording.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from pipeline.formats.budget import require_points
from pipeline.formats.c3d.header import Header, floats, integers, read_header
from pipeline.formats.c3d.layout import find_layout
from pipeline.formats.c3d.parameters import Parameters, read_parameters
from pipeline.formats.c3d.rotations import segment_origins
from pipeline.formats.contract import LARGEST, damaged, leave_out_placeholders, motion_capture, read_bytes
from pipeline.formats.text import millimetres_in, unit_of
from pipeline.skeleton.recorded import MotionCapture


def read(path: Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read the points of a C3D file, in the file's axes.

    Parameters
    ----------
    path : Path
    frame_rate_hz : float, optional
        Frames per second, used if the file states 0 and has no analog samples that give the rate.
    units : str, optional
        Unit of length that replaces POINT:UNITS; a contradiction is noted.  The default without both is ``"mm"``.

    Returns
    -------
    MotionCapture
        Points with a negative residual or without finite coordinates are NaN and invalid.

    Raises
    ------
    InvalidInput
        If the file is not C3D, is truncated, contradicts itself, has an unknown unit, or does not state its rate.
    """
    notes: list[str] = []
    data, where = read_bytes(path), path.name
    header = read_header(data, where)
    parameters = read_parameters(data, header, where, notes)
    if not header.points and not any(parameters.numbers("POINT:USED")):
        return _segments(data, header, parameters, where, units, notes)
    scale = _scale(header, parameters, where)
    layout = find_layout(header, parameters, 4 if scale < 0 else 2, len(data), where, notes)
    unit, millimetres, assumed = _unit(parameters, where, units, notes)
    rate = _rate(header, parameters, where, notes, frame_rate_hz)
    names = _labels(parameters, layout.points, notes)
    if header.first > 1:
        notes.append(f"The first frame is number {header.first} of its trial.")

    # A frame contains points, then analog samples, which are dropped.
    require_points(layout.frames, layout.points, where)
    frames = np.frombuffer(data, np.uint8, layout.needed, layout.start).reshape(layout.frames, layout.stride)
    words = frames[:, : 4 * layout.width * layout.points].tobytes()
    numbers = floats(words, header.processor) if scale < 0 else integers(words, header.processor, signed=True)
    numbers = numbers.reshape(layout.frames, layout.points, 4)
    positions = numbers[..., :3] * (millimetres if scale < 0 else millimetres * scale)
    # The fourth word encodes the residual and the cameras that saw the point; negative means not measured.
    measured = numbers[..., 3] >= 0
    valid = measured & (np.abs(positions) < LARGEST).all(axis=-1)
    positions[~valid] = np.nan
    if beyond := np.count_nonzero(measured & ~valid):
        notes.append(
            f"{beyond} samples declared as measured are not finite or too large; they count as missing."
        )
    leave_out_placeholders(positions, notes, millimetres)
    return motion_capture(names, positions, rate, unit, notes, units_assumed=assumed)


def _unit(parameters: Parameters, where: str, units: str | None, notes: list[str]) -> tuple[str, float, bool]:
    """Return the unit of length from the option or the file, its size in millimetres, and True if it is only assumed.

    Millimetres are assumed if neither the option nor the file states a unit.
    """
    declared = unit_of((parameters.texts("POINT:UNITS") or [""])[0])
    unit = units or declared or "mm"
    millimetres = millimetres_in(unit, f"{where}, POINT:UNITS")
    if declared and declared != unit:
        notes.append(f"The file states the unit {declared!r}; the requested unit {unit!r} is used instead.")
    return unit, millimetres, not (units or declared)


def _segments(
    data: bytes, header: Header, parameters: Parameters, where: str, units: str | None, notes: list[str]
) -> MotionCapture:
    """Read the segment origins of a file that contains no points."""
    segments = segment_origins(data, header, parameters, where)
    if segments is None:
        message = "the file declares no points and no segments"
        channels = int((parameters.numbers("ANALOG:USED") or [0])[0]) or header.analog
        if channels:
            message = "the file has only analog channels, no points: export the trial with its trajectories"
        raise damaged(
            message,
            where,
            received=f"{channels} channels" if channels else "",
            code="analog_alone" if channels else "no_points",
            channels=channels,
        )
    names, origins, rate = segments
    unit, millimetres, assumed = _unit(parameters, where, units, notes)
    notes.append("The file has no points; the segment origins (ROTATION) are read instead.")
    return motion_capture(names, origins * millimetres, rate, unit, notes, units_assumed=assumed)


def _scale(header: Header, parameters: Parameters, where: str) -> float:
    """Return the length of one integer step of a coordinate, in the file's unit; negative if the file stores floats."""
    scale = (parameters.numbers("POINT:SCALE") or [header.scale])[0]
    agrees = math.isfinite(header.scale) and (header.scale < 0) == (scale < 0)
    if agrees and scale > 0:
        agrees = math.isclose(scale, header.scale, rel_tol=1e-3)
    if scale == 0 or not agrees:
        raise damaged(
            "the two scales of the points cannot be used",
            f"{where}, byte 12 and POINT:SCALE",
            "the same number in both, not zero",
            f"{header.scale:g} and {scale:g}",
            code="unusable_scale",
        )
    return scale


def _rate(
    header: Header, parameters: Parameters, where: str, notes: list[str], option: float | None
) -> float:
    """Return the frame rate, Hz: POINT:RATE, which must agree with the header within 1 %.

    If both are 0, the rate is that of the analog samples over their number per frame, or else the option.
    """
    declared = [*parameters.numbers("POINT:RATE")[:1], header.rate]
    usable = [rate for rate in declared if math.isfinite(rate) and 1e-3 < rate < 1e6]
    analog = (parameters.numbers("ANALOG:RATE") or [0.0])[0] / max(header.analog_per_channel, 1)
    if not usable and not any(declared) and header.analog and 1e-3 < analog < 1e6:
        notes.append(f"The rate of the points is 0; the analog samples give {analog:g} Hz.")
        return analog
    if not usable and option:
        notes.append(f"The rate of the points is unusable; the requested {option:g} Hz is used.")
        return option
    if not usable or (len(usable) == 2 and not math.isclose(*usable, rel_tol=0.01)):
        raise damaged(
            "the frame rate cannot be used",
            f"{where}, POINT:RATE and byte 20",
            "the same positive number of Hz in both" + ("" if usable else ", or the option frame_rate_hz"),
            " and ".join(f"{rate:g}" for rate in declared),
            code="unusable_rate",
            rates=declared,
        )
    if len(usable) < len(declared) or usable[0] != usable[-1]:
        notes.append(f"POINT:RATE and the header disagree on the frame rate; {usable[0]:g} Hz is used.")
    return usable[0]


def _labels(parameters: Parameters, points: int, notes: list[str]) -> tuple[str, ...]:
    """Return the names of the points from POINT:LABELS and its continuations LABELS2, LABELS3….

    Each of these parameters stores at most 255 names.
    """
    labels = parameters.texts("POINT:LABELS")
    block = 2
    while len(labels) < points and f"POINT:LABELS{block}" in parameters.entries:
        labels += parameters.texts(f"POINT:LABELS{block}")
        block += 1
    if len(labels) > points:
        notes.append(f"{len(labels) - points} labels beyond the {points} points are dropped.")
    labels = (labels + [""] * points)[:points]
    if nameless := labels.count(""):
        notes.append(f"{nameless} points have no label; they are named point_1, point_2… by position.")
    return tuple(label or f"point_{k}" for k, label in enumerate(labels, start=1))
