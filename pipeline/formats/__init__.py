"""Readers of motion files, one for each format.

Contract
--------
Every reader is called by `read_one` as `read(path, frame_rate_hz=…, units=…)` and returns a
`pipeline.skeleton.recorded.MotionCapture`: millimetres in the file's own axes, NaN where a point was not measured.  The
two options are for what a file does not state; a reader says in its docstring what it does with them.  A file that is
damaged, contradicts itself or asks for more than its budget raises `InvalidInput` that names the file and the place in
it; what is odd but readable is listed in `notes`.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from pipeline.formats import acclaim, arrays, bvh, c3d, fourier_walks, mvnx
from pipeline.formats.budget import read_one
from pipeline.formats.contract import Reader, damaged
from pipeline.formats.points import csv, trc
from pipeline.formats.text import millimetres_in
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
"""Reader of each suffix, lower case."""

ANOTHER_RATE = 0.01
"""Share by which a frame rate that is told differs from the file's own, from which that is said."""

ADVICE = {
    ".asf": "a skeleton without motion: name the .amc that belongs to it",
    ".fbx": "export it as BVH, in Blender for instance",
    ".glb": "export it as BVH, in Blender for instance",
    ".gltf": "export it as BVH, in Blender for instance",
    ".usd": "export it as BVH, in Blender for instance",
    ".mot": "joint angles without positions: take the TRC from which they were computed",
    ".sto": "results of OpenSim: take the TRC from which they were computed",
    ".osim": "a model without motion: take the TRC of a trial",
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
    ".mp4": "a video goes through a detector of keypoints first, then to `reconstruct`",
    ".avi": "a video goes through a detector of keypoints first, then to `reconstruct`",
    ".mov": "a video goes through a detector of keypoints first, then to `reconstruct`",
    ".pkl": "pickles can run anything and are not opened: save the points as CSV",
    ".npy": "an array without names: save it as NPZ with names, positions_mm, frame_rate_hz",
    ".gz": "unpack it",
    ".zip": "unpack it",
    ".7z": "unpack it",
    ".bz2": "unpack it",
    ".xz": "unpack it",
}
"""What to do about files of other kinds, by suffix."""


_BESIDE = re.compile(r"(.*_)?(channels|events|participants|samples|scans|sessions)\.tsv")
"""Tables of BIDS beside recordings."""
_SCRIPT_BYTES = 100_000
"""Beginning of a script or JSON file that is searched for an average walker; BMWalker.js has 42 kB."""
_WALKER = re.compile(rb"\bmeanwalker\[0\]|\"mean_walker\"")
"""Array of an average walker."""
_NUMBERS = re.compile(rb"^.*?([;,\t ]+-?\d[\d.e+-]*){3}", re.MULTILINE | re.IGNORECASE)


def is_recording(path: Path) -> bool:
    """Whether a file has a reader by its suffix; of a text of any kind, whether it begins with lines of numbers.

    Scripts and JSON files are recordings if they contain an average walker.
    """
    suffix = path.suffix.lower()
    if suffix in (".js", ".json") and path.is_file():
        with path.open("rb") as file:
            return bool(_WALKER.search(file.read(_SCRIPT_BYTES)))
    if suffix != ".txt" or not path.is_file():
        return suffix in READERS and not _BESIDE.fullmatch(path.name)
    with path.open("rb") as file:
        return len(_NUMBERS.findall(file.read(4000))) > 1


def read(
    path: str | Path, *, frame_rate_hz: float | None = None, units: str | None = None, up: str = UpAxis.auto
) -> MotionCapture:
    """Read a motion file by the reader of its suffix.

    Parameters
    ----------
    path : str or Path
    frame_rate_hz : float, optional
        Frames per second (Hz), for a file that does not state it.
    units : str, optional
        Unit of length, for a file that does not state it: ``"mm"``, ``"cm"``, ``"m"``, ``"in/0.45"``…
    up : str
        Axis of the file that points up, ``"x"``, ``"-x"``, ``"y"``…; ``"auto"``: the one along which its joints stand.
        Positions stay in the file's axes.

    Raises
    ------
    InvalidInput
        If there is no such file, no reader has this suffix, the reader refuses the file, or an option makes no sense.
    """
    path = Path(path)
    if not path.exists():
        raise damaged("there is no such file", path, code="no_file")
    suffix = path.suffix.lower()
    if suffix not in READERS:
        advice = f": {ADVICE[suffix]}" if suffix in ADVICE else ""
        raise damaged(
            f"the format is unknown{advice}",
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
        notes.append(f"The file states its unit, {motion.units}, which is used, not {units}.")
    if frame_rate_hz is not None and abs(rate / frame_rate_hz - 1.0) >= ANOTHER_RATE:
        notes.append(f"The file states {rate:g} frames a second, which are used, not {frame_rate_hz:g}.")
    return replace(motion, notes=tuple(notes), up=UpAxis(up))
