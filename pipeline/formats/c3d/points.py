"""C3D files: the trajectories of 3D points, without any native code.

A C3D file is a 512-byte header, a section of named parameters, and frames of points with analog samples
between them.  This reader takes the points only.  Before it reads them it compares what the file declares
with the bytes that are there, so that a damaged file ends in a `InvalidInput` and never in a shorter recording.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import BinaryIO

import numpy as np

from pipeline.formats.c3d.header import Header, floats, integers, read_header
from pipeline.formats.c3d.layout import find_layout
from pipeline.formats.c3d.parameters import Parameters, read_parameters
from pipeline.skeleton import MILLIMETRES, MotionCapture
from pipeline.validation import InvalidInput

_LARGEST_MM = 1e9
"""A thousand kilometres: no position of a person, but a number that a damaged file may hold."""


def read(path: str | Path, *, units: str | None = None) -> MotionCapture:
    """The points of a C3D file, in millimetres and in the file's own axes.

    Parameters
    ----------
    path : str or Path
    units : str, optional
        Unit of length to use in place of POINT:UNITS, one of `pipeline.skeleton.MILLIMETRES`.

    Returns
    -------
    MotionCapture
        Points whose residual is negative or whose coordinates are no numbers are NaN and not valid.

    Raises
    ------
    InvalidInput
        If the file is not C3D, is truncated, contradicts itself, or does not say its unit or its rate.
    """
    path = Path(path)
    if not path.is_file():
        raise InvalidInput("there is no such file", where=str(path))
    try:
        with path.open("rb") as handle:
            return _read(handle, str(path), units)
    except OSError as error:
        raise InvalidInput(
            "the file cannot be read", where=str(path), received=str(error.strerror)
        ) from error


def _read(handle: BinaryIO, where: str, units: str | None) -> MotionCapture:
    notes: list[str] = []
    size = os.fstat(handle.fileno()).st_size
    header = read_header(handle, size, where)
    parameters = read_parameters(handle, header, size, where, notes)
    scale = _scale(header, parameters, where)
    layout = find_layout(header, parameters, 4 if scale < 0 else 2, size, where, notes)
    millimetres, unit = _unit(parameters, units, where, notes)
    rate = _rate(header, parameters, where, notes)
    names = _labels(parameters, layout.points, notes)
    if header.first > 1:
        notes.append(f"The first frame is number {header.first} of its trial.")

    handle.seek(layout.start)
    raw = np.frombuffer(handle.read(layout.needed), dtype=np.uint8)
    if raw.size != layout.needed:
        raise InvalidInput(
            "the file became shorter while it was read",
            where=where,
            expected=f"{layout.needed} bytes",
            received=f"{raw.size}",
        )
    # A frame is its points, then its analog samples; the stride jumps over the latter.
    points = raw.reshape(layout.frames, layout.stride)[:, : 4 * layout.width * layout.points]
    words = np.ascontiguousarray(points).reshape(-1)
    numbers = floats(words, header.processor) if scale < 0 else integers(words, header.processor, signed=True)
    numbers = numbers.reshape(layout.frames, layout.points, 4)
    positions = numbers[..., :3] * (millimetres if scale < 0 else millimetres * scale)
    # The fourth word holds the residual and the cameras that saw the point; negative means not measured.
    measured = numbers[..., 3] >= 0
    valid = measured & (np.abs(positions) < _LARGEST_MM).all(axis=-1)
    positions[~valid] = np.nan
    if beyond := int(np.count_nonzero(measured & ~valid)):
        notes.append(f"{beyond} samples declared as measured are not numbers or lie beyond any laboratory.")
    at_origin = int(np.count_nonzero((positions == 0).all(axis=-1)))
    if at_origin:
        notes.append(f"{at_origin} samples declared as measured lie exactly at the origin.")
    return MotionCapture(
        names=names,
        positions_mm=positions,
        valid=valid,
        frame_rate_hz=rate,
        units=unit,
        channels=(),
        angles_deg=np.empty((layout.frames, 0)),
        notes=tuple(notes),
    )


def _scale(header: Header, parameters: Parameters, where: str) -> float:
    """The scale of integer coordinates; negative for files of reals."""
    scale = (parameters.numbers("POINT:SCALE") or [header.scale])[0]
    agrees = math.isfinite(header.scale) and (header.scale < 0) == (scale < 0)
    if agrees and scale > 0:
        agrees = math.isclose(scale, header.scale, rel_tol=1e-3)
    if scale == 0 or not agrees:
        raise InvalidInput(
            "the scale of the points is unusable",
            where=f"{where}, byte 12 and POINT:SCALE",
            expected="twice the same number, not zero",
            received=f"{header.scale:g} and {scale:g}",
        )
    return scale


def _unit(parameters: Parameters, given: str | None, where: str, notes: list[str]) -> tuple[float, str]:
    declared = (parameters.texts("POINT:UNITS") or [""])[0].lower()
    unit = declared if given is None else given
    if unit not in MILLIMETRES:
        raise InvalidInput(
            "the unit of length is unknown" if unit else "the file does not give its unit of length",
            where=f"{where}, POINT:UNITS" if given is None else f"{where}, option units",
            expected="one of "
            + ", ".join(MILLIMETRES)
            + ("; or set the option units" if given is None else ""),
            received=repr(unit) if unit else "",
        )
    if given is not None and declared and declared != given:
        notes.append(f"The file says its unit is {declared!r}; {given!r} was asked for and used.")
    return MILLIMETRES[unit], unit


def _rate(header: Header, parameters: Parameters, where: str, notes: list[str]) -> float:
    """Frames per second: POINT:RATE, which the header must not contradict by more than 1 %."""
    declared = [*parameters.numbers("POINT:RATE")[:1], header.rate]
    usable = [rate for rate in declared if math.isfinite(rate) and 1e-3 < rate < 1e6]
    if not usable or (len(usable) == 2 and not math.isclose(*usable, rel_tol=0.01)):
        raise InvalidInput(
            "the frame rate is unusable",
            where=f"{where}, POINT:RATE and byte 20",
            expected="twice the same positive number of hertz",
            received=" and ".join(f"{rate:g}" for rate in declared),
        )
    if len(usable) < len(declared) or usable[0] != usable[-1]:
        notes.append(f"POINT:RATE and the header disagree on the frame rate; {usable[0]:g} Hz is used.")
    return usable[0]


def _labels(parameters: Parameters, points: int, notes: list[str]) -> tuple[str, ...]:
    """One name per point; LABELS holds 255 at most, LABELS2, LABELS3… continue it."""
    labels = parameters.texts("POINT:LABELS")
    block = 2
    while len(labels) < points and f"POINT:LABELS{block}" in parameters.entries:
        labels += parameters.texts(f"POINT:LABELS{block}")
        block += 1
    if len(labels) > points:
        notes.append(f"{len(labels) - points} labels beyond the {points} points are dropped.")
    labels = (labels + [""] * points)[:points]
    nameless = labels.count("")
    if nameless:
        notes.append(f"{nameless} points have no label; they are called point_1, point_2… by their place.")
    names = tuple(label or f"point_{k}" for k, label in enumerate(labels, start=1))
    if len(set(names)) < points:
        notes.append(f"{points - len(set(names))} labels stand more than once.")
    return names
