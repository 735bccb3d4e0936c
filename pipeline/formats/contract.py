"""Contract of the readers of motion files: signature, result, errors and common checks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import compress
from pathlib import Path
from typing import Protocol

import numpy as np

from pipeline.formats.budget import count_bytes
from pipeline.skeleton.recorded import MotionCapture
from pipeline.validation import InvalidInput, harmless, listed

LARGEST = 1e9
"""Largest length (mm) or angle that is read; larger values in a damaged file would overflow in computations."""

MAX_JOINTS = 2000
"""Largest number of joints in a hierarchy; bodies with all fingers and hair have a few hundred joints."""


MIN_LEAP, MIN_DISTANCE = 0.2, 1.5
"""Smallest distances, from neighbouring samples and from the body, at which a placeholder counts as missing.

A sample that is farther is missing.  The unit is the spread of the body: the root mean square distance of its points
from their centre, about 500 mm."""


class Reader(Protocol):
    """Signature of a reader of motion files."""

    def __call__(
        self, path: Path, *, frame_rate_hz: float | None = None, units: str | None = None
    ) -> MotionCapture: ...


damaged = InvalidInput
"""Error for a file that cannot be used: the fault, its location, the expected and the received value.

>>> print(damaged("a frame has a wrong number of values", "a.bvh, line 35", 10, 9))
a.bvh, line 35: a frame has a wrong number of values (expected 10, found 9)
"""


def read_bytes(path: Path) -> bytes:
    """Read the bytes of a file, after checks of its size and of its first bytes.

    Raises
    ------
    InvalidInput
        If the file does not exist, is empty, exceeds the size of a clip, or has another format than its name.
    """
    if not path.is_file():
        raise damaged("the file does not exist", path, code="no_file")
    count_bytes(path.stat().st_size, path.name)
    data = path.read_bytes()
    if not data or data.isspace():
        raise damaged("the file is empty", path.name, code="empty_file")
    for beginning, (code, message) in _OTHER_CONTENT.items():
        if data[:64].lstrip().lower().startswith(beginning) and path.suffix.lower() != ".npz":
            raise damaged(message, path.name, code=code)
    return data


_ZIP = "the file is a zip archive or a spreadsheet: unpack it, or save it in the format of its name"
_PAGE = "this is a web page, not the file: download it again"
_OTHER_CONTENT = {
    b"\x1f\x8b": ("gzip", "the file is compressed (gzip): unpack it first"),
    b"pk\x03\x04": ("zip", _ZIP),
    b"version https://git-lfs": (
        "git_lfs",
        "this is a Git LFS placeholder without the content: fetch it with `git lfs pull`",
    ),
    b"<!doctype html": ("web_page", _PAGE),
    b"<html": ("web_page", _PAGE),
}
"""First bytes of files whose content contradicts their suffix, with error code and message."""


def require_joints(count: int, where: str) -> None:
    """Raise InvalidInput if a hierarchy has more than `MAX_JOINTS` joints."""
    if count > MAX_JOINTS:
        raise damaged(
            "the hierarchy has too many joints",
            where,
            f"{MAX_JOINTS} or fewer",
            f"{count} or more",
            code="too_many_joints",
            most=MAX_JOINTS,
        )


def compare_frames(declared: float, count: int, notes: list[str]) -> None:
    """Add a note if the number of frames in a file differs from the declared number; the file may be truncated.

    Parameters
    ----------
    declared : float
        Number of frames in the header; NaN or infinite if the file does not declare it.
    count : int
        Number of frames in the file.
    notes : list of str
    """
    if np.isfinite(declared) and declared != count:
        notes.append(f"The file declares {declared:g} frames but has {count}; all {count} are read.")


def motion_capture(
    names: Sequence[str],
    positions_mm: np.ndarray,
    frame_rate_hz: float,
    units: str,
    notes: Iterable[str],
    *,
    of_angles: bool = False,
    units_assumed: bool = False,
) -> MotionCapture:
    """Build the recording that a reader returns; samples with a non-finite coordinate become NaN.

    Parameters
    ----------
    names : sequence of str
        P point names.  Repeated names of different points are numbered (``LKNE``, ``LKNE_2``).  A name that a
        spreadsheet would run as a formula gets an apostrophe in front.  Both are noted.
    positions_mm : (T, P, 3) float64
        Millimetres.  A point that was never measured is left out and noted, unless no point was measured.
    frame_rate_hz : float
    units : str
        Unit of length of the file.
    notes : iterable of str
    of_angles : bool
        True if the file contains joint angles: frames with invalid points are noted.
    units_assumed : bool
        True if neither the file nor the caller stated the unit.
    """
    notes, stated = list(notes), set(names)
    names = list(map(harmless, names))
    valid = np.isfinite(positions_mm).all(axis=-1)
    measured = valid.any(axis=0)
    if measured.any() and not measured.all():
        notes.append(
            f"Points without any measured sample are left out: {listed([*compress(names, ~measured)])}."
        )
        names = [*compress(names, measured)]
        positions_mm, valid = positions_mm[:, measured], valid[:, measured]
    if changed := [name for name in names if name not in stated]:
        notes.append(
            f"Names that a spreadsheet would run as formulas get an apostrophe in front: {listed(changed)}."
        )
    _number_repeated_names(names, positions_mm, notes)
    if of_angles and not valid.all():
        gaps = int((~valid).any(axis=1).sum())
        notes.append(
            f"{gaps} of {len(valid)} frames contain NaN; the points that depend on them are invalid."
        )
    return MotionCapture(
        names=tuple(names),
        positions_mm=np.where(valid[..., None], positions_mm, np.nan),
        valid=valid,
        frame_rate_hz=float(frame_rate_hz),
        units=units,
        notes=tuple(notes),
        units_assumed=units_assumed,
    )


def leave_out_placeholders(positions: np.ndarray, notes: list[str], millimetres: float = 1.0) -> None:
    """Replace in place, by NaN, the numbers that stand for missing samples in positions (T, P, 3).

    A placeholder has the same number in all three coordinates, such as 0, 999, -9999 or 1e6.  It counts as missing if
    the point leaps there from its neighbouring samples.  A point that stays at one number throughout counts as missing
    if it is far from the body.  A number other than 0 must occur at least twice.  Distances are relative to the spread
    of the points, because the unit may be wrong.  `millimetres` is the size of the file's unit, for the notes.
    """
    at = (positions == positions[..., :1]).all(axis=-1)
    numbers, inverse, count = np.unique(positions[at][:, 0], return_inverse=True, return_counts=True)
    at[at] = ((count > 1) | (numbers == 0))[inverse]
    measured = ~at & np.isfinite(positions).all(axis=-1)
    frames = measured.sum(axis=1) > 1
    if not at.any() or not frames.any():
        return
    weight = measured[frames] / measured[frames].sum(axis=1, keepdims=True)
    points = np.nan_to_num(positions[frames])
    middle = np.einsum("tp,tpx->tx", weight, points)
    spread = np.sqrt(np.einsum("tp,tpx->t", weight, (points - middle[:, None]) ** 2))
    size = np.median(spread)
    placeholders: list[float] = []
    for point in np.flatnonzero(at.any(axis=0)):
        rows, measured_rows = np.flatnonzero(at[:, point]), np.flatnonzero(measured[:, point])
        at_placeholder = positions[rows, point]
        if measured_rows.size:
            k = np.searchsorted(measured_rows, rows)
            neighbours = positions[measured_rows[np.clip([k - 1, k], 0, measured_rows.size - 1)], point]
            leaps = np.linalg.norm(neighbours - at_placeholder, axis=-1).max(axis=0) > MIN_LEAP * size
        else:
            away = np.median(np.linalg.norm(middle - at_placeholder[0], axis=-1))
            leaps = (at_placeholder[:, 0] == at_placeholder[0, 0]) & (away >= MIN_DISTANCE * size)
        positions[rows[leaps], point] = np.nan
        placeholders += (at_placeholder[leaps, 0] / millimetres).tolist()
    for number, times in sorted(Counter(placeholders).items()):
        position = "lie exactly at the origin" if number == 0 else f"are {number:.6g} in every coordinate"
        notes.append(f"{times} samples {position} and count as missing.")


def _number_repeated_names(names: list[str], positions_mm: np.ndarray, notes: list[str]) -> None:
    """Number repeated names of different points, e.g. medial markers: the second ``LKNE`` becomes ``LKNE_2``.

    Names stay equal if most are repeated, because they belong to two people, or if the points coincide.
    """
    first: dict[str, int] = {}
    last: dict[str, int] = {}
    used, numbered = set(names), []
    doubled = len(names) - len(used)
    for k, name in enumerate(names if 2 * doubled <= len(used) else ()):
        at = first.setdefault(name, k)
        if at == k or not (np.abs(positions_mm[:, k] - positions_mm[:, at]) > 1.0).any():
            continue
        while names[k] in used:
            last[name] = last.get(name, 1) + 1
            names[k] = f"{name}_{last[name]}"
        used.add(names[k])
        numbered.append(names[k])
    if numbered:
        notes.append(f"Repeated names are numbered: {listed(numbered)}.")
    if doubled > len(numbered):
        notes.append(f"{doubled - len(numbered)} point names are repeated.")
