"""Readers of motion files, one for each format.

Contract
--------
Every reader is called by `read_one` as `read(path, frame_rate_hz=…, units=…)` and returns a
`pipeline.skeleton.recorded.MotionCapture`: positions in millimetres, in the
axes of the file, NaN where a point was not measured.  The two options are used if a file does not state a value; `read`
also replaces a value that the file states.  A file that is damaged, contradicts itself or exceeds its memory budget
raises `InvalidInput` with the file and the line or byte.  Odd but readable content is listed in `notes`.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from pipeline.formats import acclaim, arrays, bvh, c3d, fourier_walks, mvnx
from pipeline.formats.budget import read_one
from pipeline.formats.contract import Reader, damaged
from pipeline.formats.points import csv, trc
from pipeline.formats.text import millimetres_in as millimetres_in
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import UpAxis
from pipeline.validation import require_choice, require_range

READERS: dict[str, Reader] = {
    ".amc": acclaim.read,
    ".bvh": bvh.read,
    ".c3d": c3d.read,
    ".trc": trc.read,
    ".csv": csv.read,
    ".tsv": csv.read,
    ".txt": csv.read,
    ".emt": csv.read,
    ".mvnx": mvnx.read,
    ".npz": arrays.read,
    ".mat": fourier_walks.read_mat,
    ".mm": fourier_walks.read_mm,
    ".js": fourier_walks.read,
    ".json": fourier_walks.read,
}
"""Reader for each file suffix (in lower case)."""

RATE_TOLERANCE = 0.01
"""Relative difference between the requested frame rate and the file's frame rate above which a note is added."""

ADVICE = {
    ".asf": "this is a skeleton without motion: give the .amc file of its motion",
    ".fbx": "export it as BVH, in Blender for instance",
    ".glb": "export it as BVH, in Blender for instance",
    ".gltf": "export it as BVH, in Blender for instance",
    ".usd": "export it as BVH, in Blender for instance",
    ".mot": "this has joint angles but no positions: give the TRC file that they were computed from",
    ".sto": "this has results of OpenSim: give the TRC file that they were computed from",
    ".osim": "this is a model without motion: give the TRC file of a trial",
    ".qtm": "export it from QTM as C3D or TSV",
    ".tak": "export it from Motive as C3D or CSV",
    ".mvn": "export it from MVN as MVNX, C3D or BVH",
    ".x1d": "export the trial from Nexus as C3D",
    ".x2d": "export the trial from Nexus as C3D",
    ".trb": "export the trial from Cortex as TRC or C3D",
    ".tdf": "export the trial from BTS as C3D",
    ".mdx": "export the trial from BTS as C3D",
    ".xlsx": "save the sheet as CSV",
    ".xls": "save the sheet as CSV",
    ".ods": "save the sheet as CSV",
    ".json": fourier_walks.OTHER_JSON,
    ".mp4": "run a keypoint detector on the video, then `reconstruct`",
    ".avi": "run a keypoint detector on the video, then `reconstruct`",
    ".mov": "run a keypoint detector on the video, then `reconstruct`",
    ".pkl": "a pickle can run code and is never opened: save the points as CSV",
    ".npy": "this array has no joint names: save an NPZ file with names, positions_mm and frame_rate_hz",
    ".gz": "unpack it",
    ".zip": "unpack it",
    ".7z": "unpack it",
    ".bz2": "unpack it",
    ".xz": "unpack it",
}
"""Advice for files of unsupported formats, by suffix."""


_BIDS_TABLE = re.compile(r"(.*_)?(channels|events|participants|samples|scans|sessions)\.tsv")
"""Pattern of the names of BIDS tables that contain metadata of recordings, not motion."""
_SCRIPT_BYTES = 100_000
"""Number of bytes at the start of a script or JSON file that are searched for an average walker.

BMWalker.js has 42 kB.
"""
_TEXT_BYTES = 4000
"""Number of bytes at the start of a text file that are searched for lines of numbers."""
_WALKER = re.compile(rb"\bmeanwalker\[0\]|\"mean_walker\"")
"""Pattern of the array name by which a file with an average walker is recognised."""
_NUMBERS = re.compile(rb"^.*?([;,\t ]+-?\d[\d.e+-]*){3}", re.MULTILINE | re.IGNORECASE)


def is_recording(path: Path) -> bool:
    """Return True if a file looks like a recording that some reader can read.

    The suffix decides.  A ``.txt`` file must begin with lines of numbers, and a script or JSON file must contain an
    average walker.
    """
    suffix = path.suffix.lower()
    if suffix in (".js", ".json") and path.is_file():
        with path.open("rb") as file:
            return bool(_WALKER.search(file.read(_SCRIPT_BYTES)))
    if suffix != ".txt" or not path.is_file():
        return suffix in READERS and not _BIDS_TABLE.fullmatch(path.name)
    with path.open("rb") as file:
        return len(_NUMBERS.findall(file.read(_TEXT_BYTES))) > 1


def read(
    path: str | Path, *, frame_rate_hz: float | None = None, units: str | None = None, up: str = UpAxis.auto
) -> MotionCapture:
    """Read a motion file with the reader for its suffix.

    Parameters
    ----------
    path : str or Path
    frame_rate_hz : float, optional
        Frames per second (Hz).  If the file states another rate, it is replaced, with a note.
    units : str, optional
        Unit of length: ``"mm"``, ``"cm"``, ``"m"``, ``"in/0.45"``…  If the file states another one, it is replaced,
        with a note.
    up : str
        Axis of the file that points up: ``"x"``, ``"-x"``, ``"y"``…  ``"auto"`` infers it from the upright body.
        The positions are not rotated.

    Raises
    ------
    InvalidInput
        If the file does not exist, no reader has this suffix, the reader rejects the file, or an option is invalid.
    """
    path = Path(path)
    if not path.exists():
        raise damaged("the file does not exist", path, code="no_file")
    suffix = path.suffix.lower()
    if suffix not in READERS:
        advice = f": {ADVICE[suffix]}" if suffix in ADVICE else ""
        raise damaged(
            f"the file format is not supported{advice}",
            path.name,
            "one of " + " ".join(READERS),
            suffix or "no suffix",
            code="unknown_format",
            suffix=suffix,
        )
    require_choice("up", up, [*UpAxis])
    if units is not None:
        millimetres_in(units, path.name)
    if frame_rate_hz is not None:
        require_range("the frame rate", frame_rate_hz, above=0, unit="Hz")
    motion = read_one(path, READERS[suffix], frame_rate_hz=frame_rate_hz, units=units)
    notes, rate = list(motion.notes), motion.frame_rate_hz
    if units not in (None, motion.units):
        factor = millimetres_in(units, path.name) / millimetres_in(motion.units, path.name)
        notes.append(
            f"The file states the unit {motion.units!r}; the requested unit {units!r} is used instead."
        )
        motion = replace(motion, units=units, positions_mm=factor * motion.positions_mm)
    if frame_rate_hz is not None and abs(rate / frame_rate_hz - 1.0) >= RATE_TOLERANCE:
        notes.append(
            f"The file states {rate:g} frames per second; the requested {frame_rate_hz:g} are used instead."
        )
        motion = replace(motion, frame_rate_hz=float(frame_rate_hz))
    return replace(motion, notes=tuple(notes), up=UpAxis(up))
