"""Readers of 2D keypoints of people: OpenPose, AlphaPose, MMPose, RTMLib, MediaPipe, Sports2D, CSV, NumPy.

`read` takes a file or a folder and returns `Detections`: points as the file numbers or names them, of all people in all
frames.  The caller decides which joints they are, and who walks.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pipeline.formats.budget import read_one
from pipeline.formats.contract import damaged
from walk3d.film.keypoints import people_json, tables
from walk3d.film.keypoints.contract import MEDIAPIPE, Detections, detections

READERS = {
    ".json": people_json.read,
    **dict.fromkeys((".csv", ".tsv", ".txt"), tables.read_csv),
    ".trc": tables.read_trc,
    ".npy": tables.read_array,
    ".npz": tables.read_array,
    ".jsonl": people_json.read,
    ".ndjson": people_json.read,
}
"""Functions that read a file of keypoints, by the lower-case suffix of the file.

Folders are read by a separate function.
"""


def read(path: str | Path) -> Detections:
    """Read keypoints from a file or from a folder.

    The suffix of a file selects its reader.  A folder contains OpenPose files or a single table.

    Raises
    ------
    InvalidInput
        If there is no such file, no reader has this suffix, or the reader rejects the file.
    """
    path = Path(path)
    if path.is_dir():
        files = sorted(file for file in path.iterdir() if file.is_file() and file.name[0] != ".")
        metadata = [file for file in files if file.suffix.lower() == ".json"]
        # A text may be anything.
        table_files = [file for file in files if file.suffix.lower() in READERS.keys() - {".json", ".txt"}]
        if table_files and not any(map(people_json.holds_keypoints, metadata)):
            if len(table_files) > 1:
                received = f"{len(table_files)} files: {table_files[0].name}, {table_files[1].name} …"
                raise damaged(
                    "the folder contains several tables, perhaps of several films or people",
                    path.name,
                    "the path of one file",
                    received,
                    code="several_films",
                    files=[file.name for file in table_files],
                )
            table = read(table_files[0])
            unused = ", ".join(file.name for file in metadata) or "none"
            note = (
                f"Only {table_files[0].name} in the folder is read; other files, without keypoints: {unused}."
            )
            return replace(table, notes=(note, *table.notes))
        return read_one(path, people_json.read_folder)
    if not path.is_file():
        raise damaged("there is no such file or folder", path, code="no_file")
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise damaged("the format is unknown", path.name,
                      "a folder of OpenPose, or CSV as DeepLabCut and SLEAP export it: " + " ".join(READERS),
                      path.suffix or "no suffix", code="unknown_format", suffix=path.suffix)  # fmt: skip
    return read_one(path, reader)


__all__ = ["MEDIAPIPE", "READERS", "Detections", "detections", "read"]
