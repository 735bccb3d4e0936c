"""Readers of motion files, one for each format.

Contract
--------
Every reader is called by `read_one` as `read(path, frame_rate_hz=…, units=…)` and returns a
`pipeline.skeleton.MotionCapture`: millimetres in the file's own axes, NaN where a point was not measured.  The two
options are for what a file does not state; a reader says in its docstring what it does with them.  A file that is
damaged, contradicts itself or asks for more than its budget raises `InvalidInput` that names the file and the place in
it; what is odd but readable is listed in `notes`.
"""

from __future__ import annotations

from pathlib import Path

from pipeline.formats import acclaim, arrays, bvh, c3d, mvnx
from pipeline.formats.budget import read_one
from pipeline.formats.contract import Reader, damaged
from pipeline.formats.points import csv, trc
from pipeline.skeleton.recorded import MotionCapture

READERS: dict[str, Reader] = {
    ".amc": acclaim.read,
    ".bvh": bvh.read,
    ".c3d": c3d.read,
    ".trc": trc.read,
    ".csv": csv.read,
    ".tsv": csv.read,
    ".mvnx": mvnx.read,
    ".npz": arrays.read,
}
"""Reader of each suffix, lower case."""

_ADVICE = {
    "a skeleton without motion: name the .amc that belongs to it": [".asf"],
    "export it as BVH, in Blender for instance": [".fbx", ".glb", ".gltf", ".usd"],
    "joint angles without positions: take the TRC from which they were computed": [".mot"],
    "results of OpenSim: take the TRC from which they were computed": [".sto"],
    "a model without motion: take the TRC of a trial": [".osim"],
    "export it from QTM as C3D or TSV": [".qtm"],
    "export it from Motive as C3D or CSV": [".tak"],
    "export it from MVN as MVNX, C3D or BVH": [".mvn"],
    "export the trial from Nexus as C3D": [".x1d", ".x2d"],
    "export the trial from Cortex as TRC or C3D": [".trb"],
    "export the trial from BTS as C3D": [".tdf", ".mdx"],
    "save the points as C3D, TRC or a CSV of joint, frame, x, y, z": [".mat"],
    "save the sheet as CSV": [".xlsx", ".xls", ".ods"],
    "if it is a table of points, name it .csv or .tsv": [".txt"],
    "keypoints of a video go to `reconstruct`": [".json"],
    "a video goes through a detector of keypoints first, then to `reconstruct`": [".mp4", ".avi", ".mov"],
    "pickles can run anything and are not opened: save the points as CSV": [".pkl"],
    "an array without names: save it as NPZ with names, positions_mm, frame_rate_hz": [".npy"],
    "unpack it": [".gz", ".zip", ".7z", ".bz2", ".xz"],
}
ADVICE = {suffix: advice for advice, suffixes in _ADVICE.items() for suffix in suffixes}
"""What to do about files of other kinds, by suffix."""


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
        advice = f": {ADVICE[suffix]}" if suffix in ADVICE else ""
        raise damaged(
            f"the format is unknown{advice}", path.name, "one of " + " ".join(READERS), suffix or "no suffix"
        )
    return read_one(path, READERS[suffix], frame_rate_hz=frame_rate_hz, units=units)
