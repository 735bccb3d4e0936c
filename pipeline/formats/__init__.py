"""Readers of motion files, one for each format.

Contract
--------
Every reader is called as `read(path, frame_rate_hz=…, units=…)` and returns a `pipeline.skeleton.MotionCapture`:
millimetres in the file's own axes, NaN where a point was not measured.  The two options are for what a file does
not state; a reader says in its docstring what it does with them.  A file that is damaged or contradicts itself
raises `InvalidInput` that names the file and the place in it; what is odd but readable is listed in `notes`.
"""

from __future__ import annotations

from pathlib import Path

from pipeline.formats import acclaim, bvh, c3d, mvnx
from pipeline.formats.contract import Reader, damaged
from pipeline.formats.points import csv, trc
from pipeline.skeleton import MotionCapture

READERS: dict[str, Reader] = {
    ".amc": acclaim.read,
    ".bvh": bvh.read,
    ".c3d": c3d.read,
    ".trc": trc.read,
    ".csv": csv.read,
    ".tsv": csv.read,
    ".mvnx": mvnx.read,
}
"""Reader of each suffix, lower case."""


def read(path: str | Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read a motion file by the reader of its suffix.

    Parameters
    ----------
    path : str or Path
    frame_rate_hz : float, optional
        Frames per second (Hz), for a file that does not state it.
    units : str, optional
        Unit of length, for a file that does not state it: ``"mm"``, ``"cm"``, ``"m"``, ``"in/0.45"``…

    Raises
    ------
    InvalidInput
        If there is no such file, no reader has this suffix, or the reader refuses the file.
    """
    path = Path(path)
    if not path.exists():
        raise damaged("there is no such file", str(path))
    suffix = path.suffix.lower()
    if suffix not in READERS:
        raise damaged(
            "the format is unknown", path.name, "one of " + " ".join(READERS), suffix or "no suffix"
        )
    return READERS[suffix](path, frame_rate_hz=frame_rate_hz, units=units)
