"""One reader to each file format; every reader returns the same value, `pipeline.skeleton.MotionCapture`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pipeline.formats import bvh, c3d
from pipeline.formats.acclaim import amc as asf_amc
from pipeline.formats.points import csv, trc
from pipeline.skeleton import MotionCapture
from pipeline.validation import InvalidInput

READERS = {".amc": asf_amc, ".bvh": bvh, ".c3d": c3d, ".trc": trc, ".csv": csv}
"""Reader of each suffix, lower case."""

_WITHOUT_RATE = {".amc", ".csv"}
_WITHOUT_UNITS = {".amc", ".bvh", ".c3d", ".csv"}


def read(path: Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Whatever the file holds, by its suffix.

    Parameters
    ----------
    path : Path
    frame_rate_hz, units : optional
        For formats that do not say; a format that does say is believed.

    Raises
    ------
    InvalidInput
        If the suffix is unknown, or the reader refuses the file.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in READERS:
        raise InvalidInput(
            "the format is unknown",
            where=path.name,
            expected="one of " + " ".join(READERS),
            received=suffix or "no suffix",
        )
    if not path.is_file():
        raise InvalidInput("there is no such file", where=str(path))
    options: dict[str, Any] = {}
    if frame_rate_hz and suffix in _WITHOUT_RATE:
        options["frame_rate_hz"] = frame_rate_hz
    if units and suffix in _WITHOUT_UNITS:
        options["units"] = units
    return READERS[suffix].read(path, **options)
