"""Reader of NumPy files (NPZ, NPY): names, positions and frame rate as arrays.

Code in the files is never run.
"""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Collection
from pathlib import Path

import numpy as np

from pipeline.formats.budget import require_memory
from pipeline.formats.contract import LARGEST, damaged, motion_capture, read_bytes
from pipeline.formats.mat import load_mat
from pipeline.formats.text import millimetres_in
from pipeline.skeleton.recorded import MotionCapture

_EXPORTED, _AMASS = ("names", "positions_mm"), ("marker_labels", "marker_data")
"""Names of the two arrays with point names and positions: in files of this package (mm), and in AMASS (m)."""
_RATES = ("frame_rate_hz", "mocap_framerate", "mocap_frame_rate")
_BODY_MODEL = {"poses", "betas", "trans"}
"""Names of arrays that contain the parameters of a body model, in AMASS and similar files."""


def read(path: Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read points from the arrays ``names`` (P,), ``positions_mm`` (T, P, 3) and ``frame_rate_hz`` of an NPZ file.

    The markers of AMASS are also read: ``marker_labels``, ``marker_data`` and ``mocap_framerate``.  A marker exactly at
    the origin is missing.

    Parameters
    ----------
    path : Path
    frame_rate_hz : float, optional
        Used if the file states no rate.
    units : str, optional
        Unit of length; if not given, millimetres for ``positions_mm`` and metres for AMASS.

    Raises
    ------
    InvalidInput
        If an array is missing, or the shapes do not match.
    """
    where = path.name
    load = load_mat if where.lower().endswith(".mat") else load_npz
    arrays, present = load(read_bytes(path), where, (*_EXPORTED, *_AMASS, *_RATES))
    is_exported = set(_EXPORTED) <= set(present)
    if not is_exported and not set(_AMASS) <= set(present):
        what, code = "the file has no arrays names and positions_mm", "no_arrays"
        if set(present) & _BODY_MODEL:
            what = "the file has parameters of a body model, not positions: export the joints as CSV or C3D first"
            code = "body_model"
        raise damaged(what, where, received=", ".join(present[:8]) or "none", code=code)
    names, positions = (arrays[name] for name in (_EXPORTED if is_exported else _AMASS))
    fits = positions.ndim == 3 and positions.shape[1:] == (names.size, 3) and 0 not in positions.shape
    if not fits or names.dtype.kind not in "US" or positions.dtype.kind not in "fiu":
        raise damaged(
            "the arrays of names and positions do not match",
            where,
            f"positions (frames, {names.size}, 3) of numbers, names of text",
            f"{positions.shape}",
            code="arrays_disagree",
        )
    rate = next((arrays[name] for name in _RATES if name in arrays), np.array(frame_rate_hz or np.nan))
    if rate.size != 1 or rate.dtype.kind not in "fiu" or not 0 < rate.item() < 1e6:
        raise damaged(
            "the frame rate is unknown",
            where,
            "frame_rate_hz, in the file or as an option",
            code="unknown_rate",
        )
    unit = units or ("mm" if is_exported else "m")
    positions = positions.astype(float)
    if not is_exported:
        positions[(positions == 0).all(axis=-1)] = np.nan
    with np.errstate(invalid="ignore"):
        positions *= millimetres_in(unit, where)
        positions[~(np.abs(positions) <= LARGEST)] = np.nan
    return motion_capture(
        names.ravel().astype(str).tolist(),
        positions,
        rate.item(),
        unit,
        [],
        units_assumed=not is_exported and units is None,
    )


def load_npz(
    data: bytes, where: str, selection: Collection[str] | None = None
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Return the selected arrays of an NPZ file (default: all arrays), and the names of all its arrays.

    Raises
    ------
    InvalidInput
        If the arrays exceed the memory budget of the clip; other errors are those of zipfile and NumPy.
    """
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        entries_by_name = {entry.filename.removesuffix(".npy"): entry for entry in archive.infolist()}
        entries = {
            name: entries_by_name[name] for name in entries_by_name if selection is None or name in selection
        }
        # zipfile never unpacks an entry beyond the size that the archive states.
        require_memory(sum(entry.file_size for entry in entries.values()), where)
        needed, arrays = 0, {}
        for name, entry in entries.items():
            data = archive.read(entry)
            needed += memory_of(data)
            require_memory(needed, f"{where}, array {name}")
            arrays[name] = _array(data)
    return arrays, list(entries_by_name)


def load_npy(path: Path) -> np.ndarray:
    """Return the array of an NPY file.  Raises the same exceptions as `load_npz`."""
    data = read_bytes(path)
    require_memory(memory_of(data), path.name)
    return _array(data)


def _array(data: bytes) -> np.ndarray:
    return np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)


def memory_of(data: bytes) -> int:
    """Return the memory, bytes, for an array and its numeric copies, estimated from the header of the array's file."""
    stream = io.BytesIO(data)
    major, _ = np.lib.format.read_magic(stream)
    shape, _, dtype = getattr(np.lib.format, f"read_array_header_{major}_0")(stream)
    return math.prod(shape) * (dtype.itemsize + 32)
