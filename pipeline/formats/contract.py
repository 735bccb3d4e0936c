"""What every reader of a motion file shares: its signature, its result and its refusals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from pipeline.skeleton.recorded import MotionCapture
from pipeline.validation import InvalidInput

LARGEST = 1e9
"""Largest length (mm) or angle that is read; a damaged file may hold larger ones, which would overflow later."""

MOST_JOINTS = 2000
"""Joints of a hierarchy that are read; bodies with every finger and strand of hair have a few hundred."""


class Reader(Protocol):
    """Signature of every reader."""

    def __call__(
        self, path: str | Path, *, frame_rate_hz: float | None = None, units: str | None = None
    ) -> MotionCapture: ...


def damaged(what: str, where: str, expected: object = "", received: object = "") -> InvalidInput:
    """Build the error for a file that cannot be used.

    Examples
    --------
    >>> print(damaged("a frame has a wrong number of values", "a.bvh, line 35", 10, 9))
    a.bvh, line 35: a frame has a wrong number of values (expected 10, received 9)
    """
    return InvalidInput(what, where=where, expected=str(expected), received=str(received))


def read_bytes(path: Path) -> bytes:
    """Read a file.

    Raises
    ------
    InvalidInput
        If there is no such file, it cannot be read or it is empty.
    """
    if not path.is_file():
        raise damaged("there is no such file", str(path))
    try:
        data = path.read_bytes()
    except OSError as error:
        raise damaged("the file cannot be read", str(path), received=error.strerror or "") from None
    if not data or data.isspace():
        raise damaged("the file is empty", path.name)
    for beginning, what in _OTHER_CONTENT.items():
        if data[:64].lstrip().lower().startswith(beginning) and path.suffix.lower() != ".npz":
            raise damaged(what, path.name)
    return data


_OTHER_CONTENT = {
    b"\x1f\x8b": "the file is compressed (gzip): unpack it first",
    b"pk\x03\x04": "the file is a zip archive or a spreadsheet: unpack it, or save it in the format of its name",
    b"version https://git-lfs": "this is a placeholder of git LFS, without the content: fetch it by `git lfs pull`",
    b"<!doctype html": "this is a web page, not the file: download it again",
    b"<html": "this is a web page, not the file: download it again",
}
"""What files hold, by how they begin, that are not what their names say."""


def require_joints(count: int, where: str) -> None:
    """Raise InvalidInput if a hierarchy has more than `MOST_JOINTS` joints."""
    if count > MOST_JOINTS:
        raise damaged(
            "the hierarchy has too many joints", where, f"{MOST_JOINTS} or fewer", f"{count} or more"
        )


def require_proportion(frames: int, points: int, size: int, where: str) -> None:
    """Raise InvalidInput if so many positions are out of proportion to a file of `size` characters.

    Joints without channels cost a line each, but a position in every frame: a small file could ask for more memory
    than there is.  In a file of motion every third joint at most has no channels, and each channel takes two
    characters or more.
    """
    if frames * points > 10_000 + size:
        what = "the hierarchy is out of proportion to the motion: most of its joints do not move"
        received = f"{frames} frames of {points} in {size} characters"
        raise damaged(what, where, "joints with channels", received)


def motion_capture(
    names: Sequence[str],
    positions_mm: np.ndarray,
    frame_rate_hz: float,
    units: str,
    notes: Iterable[str],
    *,
    channels: Sequence[str] = (),
    angles_deg: np.ndarray | None = None,
    units_assumed: bool = False,
) -> MotionCapture:
    """Build the result of a reader: a point with a coordinate that is not finite is invalid, and NaN throughout.

    Parameters
    ----------
    names : sequence of str
        P point names; doubled ones are noted.
    positions_mm : (T, P, 3) float64
        Millimetres.
    frame_rate_hz : float
    units : str
        Unit of length of the file.
    notes : iterable of str
    channels : sequence of str
        Names of C angle channels, for files of joint angles.
    angles_deg : (T, C) float64, optional
        Degrees, for files of joint angles; frames with invalid points are noted.
    units_assumed : bool
        Whether neither the file nor the caller stated the unit.
    """
    notes = list(notes)
    valid = np.isfinite(positions_mm).all(axis=-1)
    if doubled := len(names) - len(set(names)):
        notes.append(f"{doubled} names of points stand more than once.")
    if angles_deg is not None and not valid.all():
        gaps = int((~valid).any(axis=1).sum())
        notes.append(f"{gaps} of {len(valid)} frames have NaN; the points that depend on them are invalid.")
    return MotionCapture(
        names=tuple(names),
        positions_mm=np.where(valid[..., None], positions_mm, np.nan),
        valid=valid,
        frame_rate_hz=float(frame_rate_hz),
        units=units,
        channels=tuple(channels),
        angles_deg=np.empty((len(valid), 0)) if angles_deg is None else angles_deg,
        notes=tuple(notes),
        units_assumed=units_assumed,
    )
