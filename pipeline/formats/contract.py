"""What every reader of a motion file shares: its signature, its result and its refusals."""

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
"""Largest length (mm) or angle that is read; a damaged file may hold larger ones, which would overflow later."""

MOST_JOINTS = 2000
"""Joints of a hierarchy that are read; bodies with every finger and strand of hair have a few hundred."""


LEAP, ABOUT = 0.2, 1.5
"""Distance from a placeholder to where a point is before or after, and to the middle of the body, above which a point
there was not seen: over the root mean square distance of points from their middle, some 500 mm of a body."""


class Reader(Protocol):
    """Signature of every reader."""

    def __call__(
        self, path: Path, *, frame_rate_hz: float | None = None, units: str | None = None
    ) -> MotionCapture: ...


damaged = InvalidInput
"""The error for a file that cannot be used: what is wrong, where, what was expected, what was received.

>>> print(damaged("a frame has a wrong number of values", "a.bvh, line 35", 10, 9))
a.bvh, line 35: a frame has a wrong number of values (expected 10, received 9)
"""


def read_bytes(path: Path) -> bytes:
    """Read a file.

    Raises
    ------
    InvalidInput
        If there is no such file, it is empty or larger than one clip may be.
    """
    if not path.is_file():
        raise damaged("there is no such file", path, code="no_file")
    count_bytes(path.stat().st_size, path.name)
    data = path.read_bytes()
    if not data or data.isspace():
        raise damaged("the file is empty", path.name, code="empty_file")
    for beginning, (code, what) in _OTHER_CONTENT.items():
        if data[:64].lstrip().lower().startswith(beginning) and path.suffix.lower() != ".npz":
            raise damaged(what, path.name, code=code)
    return data


_ZIP = "the file is a zip archive or a spreadsheet: unpack it, or save it in the format of its name"
_PAGE = "this is a web page, not the file: download it again"
_OTHER_CONTENT = {
    b"\x1f\x8b": ("gzip", "the file is compressed (gzip): unpack it first"),
    b"pk\x03\x04": ("zip", _ZIP),
    b"version https://git-lfs": (
        "git_lfs",
        "this is a placeholder of git LFS, without the content: fetch it by `git lfs pull`",
    ),
    b"<!doctype html": ("web_page", _PAGE),
    b"<html": ("web_page", _PAGE),
}
"""Code and sentence on what files hold, by how they begin, that are not what their names say."""


def require_joints(count: int, where: str) -> None:
    """Raise InvalidInput if a hierarchy has more than `MOST_JOINTS` joints."""
    if count > MOST_JOINTS:
        raise damaged(
            "the hierarchy has too many joints",
            where,
            f"{MOST_JOINTS} or fewer",
            f"{count} or more",
            code="too_many_joints",
            most=MOST_JOINTS,
        )


def compare_frames(declared: float, count: int, notes: list[str]) -> None:
    """Note that a file has another number of frames than it declares; it may be cut.

    Parameters
    ----------
    declared : float
        NaN or infinite if the file declares none.
    count : int
        Frames of the file.
    notes : list of str
    """
    if np.isfinite(declared) and declared != count:
        notes.append(f"The file declares {declared:g} frames and has {count}; all {count} were read.")


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
    """Build the result of a reader: a point with a coordinate that is not finite is invalid, and NaN throughout.

    Parameters
    ----------
    names : sequence of str
        P point names.  A few that stand twice for different points are told apart as ``LKNE``, ``LKNE_2``, and a
        name that a spreadsheet would run as a formula gets an apostrophe in front; both are noted.
    positions_mm : (T, P, 3) float64
        Millimetres.  A point that was never measured, while others were, is left out and noted.
    frame_rate_hz : float
    units : str
        Unit of length of the file.
    notes : iterable of str
    of_angles : bool
        Whether the file holds joint angles: frames with invalid points are noted.
    units_assumed : bool
        Whether neither the file nor the caller stated the unit.
    """
    notes, stated = list(notes), set(names)
    names = list(map(harmless, names))
    valid = np.isfinite(positions_mm).all(axis=-1)
    measured = valid.any(axis=0)
    if measured.any() and not measured.all():
        notes.append(f"Points in name only, never measured: {listed([*compress(names, ~measured)])}.")
        names = [*compress(names, measured)]
        positions_mm, valid = positions_mm[:, measured], valid[:, measured]
    if changed := [name for name in names if name not in stated]:
        notes.append(f"Names that a spreadsheet would run begin with an apostrophe: {listed(changed)}.")
    _tell_apart(names, positions_mm, notes)
    if of_angles and not valid.all():
        gaps = int((~valid).any(axis=1).sum())
        notes.append(f"{gaps} of {len(valid)} frames have NaN; the points that depend on them are invalid.")
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
    """Make samples (T, P, 3) of one number in all coordinates NaN, in place, where a point leaps there.

    Many programs write gaps so: as 0, 999, -9999 or 1e6.  A root that begins there is kept, and one that stays there if
    the body is about it, and so is what stands only once, unless it is 0.  All are lengths over the spread of the
    points, for their unit may be another; `millimetres` are those of one unit of the file, for the notes.
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
            leaps = np.linalg.norm(neighbours - at_placeholder, axis=-1).max(axis=0) > LEAP * size
        else:
            away = np.median(np.linalg.norm(middle - at_placeholder[0], axis=-1))
            leaps = (at_placeholder[:, 0] == at_placeholder[0, 0]) & (away >= ABOUT * size)
        positions[rows[leaps], point] = np.nan
        placeholders += (at_placeholder[leaps, 0] / millimetres).tolist()
    for number, times in sorted(Counter(placeholders).items()):
        where = "lie exactly at the origin" if number == 0 else f"are {number:.6g} in every coordinate"
        notes.append(f"{times} samples {where} and are taken as missing.")


def _tell_apart(names: list[str], positions_mm: np.ndarray, notes: list[str]) -> None:
    """Number the later ones of equal names, as of medial markers of a standing trial: ``LKNE``, ``LKNE_2``.

    Where most names stand twice they are two people's, and copies of one point lie in one place: these stay equal.
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
        notes.append(f"Names that stand twice are numbered: {listed(numbered)}.")
    if doubled > len(numbered):
        notes.append(f"{doubled - len(numbered)} names of points stand more than once.")
