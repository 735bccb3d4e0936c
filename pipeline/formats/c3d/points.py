"""C3D files: trajectories of points, read without native code.

A C3D file is a 512-byte header, a section of named parameters, and frames of points with analog samples
between them.  This reader takes the points, or the origins of segments of a file that has no points.
Before it reads them it compares what the file declares
with the bytes that are there, so a damaged file is refused and never read as a shorter recording.
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
        Used if the file states 0 and has no analog samples, whose rate would tell it.
    units : str, optional
        Unit of length to use in place of POINT:UNITS; a contradiction is noted.  Without either ``"mm"``.

    Returns
    -------
    MotionCapture
        Points whose residual is negative or whose coordinates are no numbers are NaN and not valid.

    Raises
    ------
    InvalidInput
        If the file is not C3D, is truncated, contradicts itself, its unit is unknown, or it does not state its rate.
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

    # A frame is its points, then its analog samples, which are cut off.
    require_points(layout.frames, layout.points, where)
    frames = np.frombuffer(data, np.uint8, layout.needed, layout.start).reshape(layout.frames, layout.stride)
    words = frames[:, : 4 * layout.width * layout.points].tobytes()
    numbers = floats(words, header.processor) if scale < 0 else integers(words, header.processor, signed=True)
    numbers = numbers.reshape(layout.frames, layout.points, 4)
    positions = numbers[..., :3] * (millimetres if scale < 0 else millimetres * scale)
    # The fourth word holds the residual and the cameras that saw the point; negative means not measured.
    measured = numbers[..., 3] >= 0
    valid = measured & (np.abs(positions) < LARGEST).all(axis=-1)
    positions[~valid] = np.nan
    if beyond := np.count_nonzero(measured & ~valid):
        notes.append(f"{beyond} samples declared as measured are not numbers or lie beyond any laboratory.")
    leave_out_placeholders(positions, notes, millimetres)
    return motion_capture(names, positions, rate, unit, notes, units_assumed=assumed)


def _unit(parameters: Parameters, where: str, units: str | None, notes: list[str]) -> tuple[str, float, bool]:
    """The unit of length that was asked for, or that the file declares, its millimetres, and whether it is neither."""
    declared = unit_of((parameters.texts("POINT:UNITS") or [""])[0])
    unit = units or declared or "mm"
    millimetres = millimetres_in(unit, f"{where}, POINT:UNITS")
    if declared and declared != unit:
        notes.append(f"The file says its unit is {declared!r}; {unit!r} was asked for and used.")
    return unit, millimetres, not (units or declared)


def _segments(
    data: bytes, header: Header, parameters: Parameters, where: str, units: str | None, notes: list[str]
) -> MotionCapture:
    """The origins of segments, of a file that has those in place of points."""
    segments = segment_origins(data, header, parameters, where)
    if segments is None:
        what = "the file declares no points and no segments"
        channels = int((parameters.numbers("ANALOG:USED") or [0])[0]) or header.analog
        if channels:
            what = "the file holds analog channels alone, no points: export the trial with its trajectories"
        raise damaged(
            what,
            where,
            received=f"{channels} channels" if channels else "",
            code="analog_alone" if channels else "no_points",
            channels=channels,
        )
    names, origins, rate = segments
    unit, millimetres, assumed = _unit(parameters, where, units, notes)
    notes.append("The file has no points; these are the origins of its segments (ROTATION).")
    return motion_capture(names, origins * millimetres, rate, unit, notes, units_assumed=assumed)


def _scale(header: Header, parameters: Parameters, where: str) -> float:
    """Length of one step of integer coordinates, in the file's unit; negative for files of reals."""
    scale = (parameters.numbers("POINT:SCALE") or [header.scale])[0]
    agrees = math.isfinite(header.scale) and (header.scale < 0) == (scale < 0)
    if agrees and scale > 0:
        agrees = math.isclose(scale, header.scale, rel_tol=1e-3)
    if scale == 0 or not agrees:
        raise damaged(
            "the scale of the points is unusable",
            f"{where}, byte 12 and POINT:SCALE",
            "twice the same number, not zero",
            f"{header.scale:g} and {scale:g}",
            code="unusable_scale",
        )
    return scale


def _rate(header: Header, parameters: Parameters, where: str, notes: list[str], given: float | None) -> float:
    """Frames per second: POINT:RATE, which the header must not contradict by more than 1 %.

    Where both are 0, that of the analog samples over their number in a frame, else the one that is given.
    """
    declared = [*parameters.numbers("POINT:RATE")[:1], header.rate]
    usable = [rate for rate in declared if math.isfinite(rate) and 1e-3 < rate < 1e6]
    analog = (parameters.numbers("ANALOG:RATE") or [0.0])[0] / max(header.analog_per_channel, 1)
    if not usable and not any(declared) and header.analog and 1e-3 < analog < 1e6:
        notes.append(f"The rate of the points is 0; {analog:g} Hz follow from that of the analog samples.")
        return analog
    if not usable and given:
        notes.append(f"The rate of the points is unusable; {given:g} Hz was asked for and is used.")
        return given
    if not usable or (len(usable) == 2 and not math.isclose(*usable, rel_tol=0.01)):
        raise damaged(
            "the frame rate is unusable",
            f"{where}, POINT:RATE and byte 20",
            "twice the same positive number of Hz" + ("" if usable else ", or the option frame_rate_hz"),
            " and ".join(f"{rate:g}" for rate in declared),
            code="unusable_rate",
            rates=declared,
        )
    if len(usable) < len(declared) or usable[0] != usable[-1]:
        notes.append(f"POINT:RATE and the header disagree on the frame rate; {usable[0]:g} Hz is used.")
    return usable[0]


def _labels(parameters: Parameters, points: int, notes: list[str]) -> tuple[str, ...]:
    """One name for each point; LABELS holds 255 at most, LABELS2, LABELS3… continue it."""
    labels = parameters.texts("POINT:LABELS")
    block = 2
    while len(labels) < points and f"POINT:LABELS{block}" in parameters.entries:
        labels += parameters.texts(f"POINT:LABELS{block}")
        block += 1
    if len(labels) > points:
        notes.append(f"{len(labels) - points} labels beyond the {points} points are dropped.")
    labels = (labels + [""] * points)[:points]
    if nameless := labels.count(""):
        notes.append(f"{nameless} points have no label; they are called point_1, point_2… in their order.")
    return tuple(label or f"point_{k}" for k, label in enumerate(labels, start=1))
