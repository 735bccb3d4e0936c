"""NPZ files of numpy: names, positions in millimetres and the rate, as motion is exported; nothing in them is run."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np

from pipeline.formats.contract import LARGEST, damaged, motion_capture, read_bytes
from pipeline.formats.text import millimetres_in
from pipeline.skeleton.recorded import MotionCapture

_LARGEST_ARRAY = 1_000_000_000
"""Bytes of one array when unpacked."""

_BODY_MODEL = {"poses", "betas", "trans"}
"""Arrays of AMASS and of other parameters of body models."""


def read(path: str | Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read points from the arrays ``names`` (P,), ``positions_mm`` (T, P, 3) and ``frame_rate_hz`` of an NPZ file.

    Parameters
    ----------
    path : str or Path
    frame_rate_hz : float, optional
        Used if the file has no array of that name.
    units : str, optional
        Unit of length to use in place of the millimetres in the array's name.

    Raises
    ------
    InvalidInput
        If the file is no NPZ, lacks an array, or their shapes do not fit each other.
    """
    where, data = Path(path).name, read_bytes(Path(path))
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if any(entry.file_size > _LARGEST_ARRAY for entry in archive.infolist()):
                raise damaged("an array is too large", where, f"{_LARGEST_ARRAY} bytes at most")
        with np.load(io.BytesIO(data), allow_pickle=False) as stored:
            wanted = ("names", "positions_mm", "frame_rate_hz")
            arrays = {name: stored[name] for name in wanted if name in stored.files}
            held = stored.files
    except (zipfile.BadZipFile, OSError, EOFError, KeyError, NotImplementedError, RuntimeError):
        raise damaged("this is not an NPZ file, or it is cut short", where) from None
    except ValueError as error:
        if hasattr(error, "where"):
            raise
        raise damaged("an array holds what are not plain numbers or names", where) from None
    if "positions_mm" not in arrays or "names" not in arrays:
        what = "the file holds no arrays names and positions_mm"
        if set(held) & _BODY_MODEL:
            what = "the file holds parameters of a body model: export its joints as CSV or C3D first"
        raise damaged(what, where, received=", ".join(held[:8]) or "none")
    names, positions = arrays["names"], arrays["positions_mm"]
    fits = positions.ndim == 3 and positions.shape[1:] == (names.size, 3) and 0 not in positions.shape
    if not fits or names.dtype.kind != "U" or positions.dtype.kind not in "fiu":
        expected = f"positions_mm (frames, {names.size}, 3) of numbers, names of text"
        raise damaged("the arrays do not fit each other", where, expected, f"{positions.shape}")
    rate = arrays.get("frame_rate_hz", np.array(frame_rate_hz or np.nan))
    if rate.size != 1 or rate.dtype.kind not in "fiu" or not 0 < float(rate.reshape(())) < 1e6:
        raise damaged("the frame rate is unknown", where, "frame_rate_hz, in the file or the option")
    unit = units or "mm"
    positions = positions.astype(float) * millimetres_in(unit, where)
    with np.errstate(invalid="ignore"):
        positions[~(np.abs(positions) <= LARGEST)] = np.nan
    return motion_capture([str(name) for name in names.ravel()], positions, float(rate.reshape(())), unit, [])
