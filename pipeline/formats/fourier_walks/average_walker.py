"""Reader of published average walkers, stored as Fourier series in a JavaScript, JSON or MAT file.

The second author of zhang2007 published an average walker and its axes (gender, weight, nervous, happy) in
BMWalker.js.  Its source text contains arrays of 230 numbers: five blocks of 46, see `series.from_blocks`.  The text is
searched for these arrays and is never run.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.formats import arrays
from pipeline.formats.contract import LARGEST, damaged, read_bytes
from pipeline.formats.fourier_walks.series import (
    BLOCKS,
    RATE_HZ,
    FourierWalk,
    from_blocks,
    from_world,
    motion_of,
)
from pipeline.formats.mat import load_matrices
from pipeline.formats.text import read_numbers
from pipeline.reading import read_json
from pipeline.skeleton import WALKER15
from pipeline.skeleton.recorded import MotionCapture
from pipeline.validation import require_choice, require_range

AXES = {
    "gender": "bodyStructureaxis",
    "weight": "weightaxis",
    "nervous": "nervousaxis",
    "happy": "happyaxis",
}
"""Name of each attribute axis, and the name of the axis's array in BMWalker.js."""

SOURCE = (
    "BMWalker.js 0.6.1, CC BY-NC-SA 4.0, copyright 2022 Tetsunori Nakayama and Nikolaus Troje:"
    " attribution, no commercial use, share alike"
)
"""Source and licence of BMWalker.js, which is recognised by the name of its second author in the file."""

_AUTHOR = "Nikolaus Troje"

MAX_WORDS = 400
"""Largest number of characters that are kept of a file's statement of its source."""

OTHER_JSON = "run `reconstruct` on keypoints of a video; save 3D points as CSV: frame, time, joint, x, y, z"
"""Advice for a JSON file that is not an average walker."""

MAX_VALUE = 6.0
"""Largest absolute value on an attribute axis; BMWalker.js has the same bound."""

_MAT_JOINTS = (
    "head", "right_wrist", "right_elbow", "right_shoulder", "sternum", "left_shoulder", "left_elbow", "left_wrist",
    "right_ankle", "right_knee", "right_hip", "pelvis", "left_hip", "left_knee", "left_ankle",
)  # fmt: skip
"""Order of the joints in MAT files of average walkers."""

_ROWS = 3 * len(WALKER15.joints)
_COUNT = BLOCKS * (_ROWS + 1)
_ASSUMED_PERIOD = RATE_HZ
"""Stride period, frames, that is assumed if a file states none: one stride per second."""


@dataclass(frozen=True)
class AverageWalker:
    """Average walker, and the axes of attributes (such as mood) along which walkers differ from the average.

    Attributes
    ----------
    mean : (5, 46)
        Blocks p0, p1, q1, p2, q2 of 15 x, 15 y, 15 z, mm, and a 46th number: period, size or speed.
    axes : mapping of str to (5, 46)
        Change of the blocks per unit of the value.
    source : str
        Source and licence, repeated with every use of the walker; empty if the file does not state them.
    """

    mean: np.ndarray
    axes: Mapping[str, np.ndarray]
    source: str = ""

    def at(self, **values: float) -> FourierWalk:
        """Return the walker with the given values, each from -6 to 6, on the attribute axes.

        Raises
        ------
        InvalidInput
            If an axis does not exist, or a value is out of range.
        """
        blocks = self.mean
        for name, value in values.items():
            require_choice("axis", name, list(self.axes))
            require_range(name, value, at_least=-MAX_VALUE, at_most=MAX_VALUE)
            blocks = blocks + value * self.axes[name]
        return from_blocks(blocks, "the average walker")


def average_walker(path: Path) -> AverageWalker:
    """Read the average walker from the source text of BMWalker.js, or from JSON with the same arrays.

    The JSON has arrays of 230 numbers: ``mean_walker``, and ``axes`` with the names of `AXES`.

    Raises
    ------
    InvalidInput
        If an array is missing or does not have 230 numbers.
    """
    data, name = read_bytes(path), path.name
    arrays_by_name, source = (_of_json if path.suffix.lower() == ".json" else _of_javascript)(data, name)
    mean = arrays_by_name.pop("mean")
    from_blocks(mean, name)
    return AverageWalker(mean, arrays_by_name, source)


def read(path: Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read the average walker in BMWalker.js, or in JSON with the same arrays, as a recording of several strides.

    Parameters
    ----------
    path : Path
    frame_rate_hz, units
        Not used: periods are in frames at 120 Hz, coordinates in millimetres.

    Raises
    ------
    InvalidInput
        If the file does not contain the arrays.
    """
    walker = average_walker(path)
    axes = ", ".join(walker.axes)
    notes = [f"Average walker with axes: {axes}."]
    notes += [f"Source: {walker.source}."] if walker.source else []
    return motion_of({"": walker.at()}, notes, path.name)


def mean_walkers(path: Path) -> dict[str, FourierWalk]:
    """Read the walkers in a MAT file by the names of their matrices (45, 5), and ignore other matrices.

    Columns are mean, sine 1, cosine 1, sine 2, cosine 2.  Rows are all x (to the right), all y (forwards), all z (up)
    of fifteen joints.  The file has no period: one stride per second is assumed.

    Raises
    ------
    InvalidInput
        If the file cannot be read, or contains no walker.
    """
    order = [_MAT_JOINTS.index(joint) for joint in WALKER15.joints]
    walks = {}
    for name, matrix in load_matrices(read_bytes(path), path.name).items():
        if matrix.shape == (_ROWS, BLOCKS):
            by_axis = matrix.astype(float).T.reshape(BLOCKS, 3, -1)[:, :, order]
            coefficients = from_world(by_axis.swapaxes(1, 2))
            if not (np.abs(coefficients) <= LARGEST).all():
                raise damaged("a coefficient is not a usable number", path.name, code="not_number")
            walks[name] = FourierWalk(coefficients, _ASSUMED_PERIOD)
    if not walks:
        expected = f"matrices ({_ROWS}, {BLOCKS})"
        raise damaged("the file contains no walkers", path.name, expected, code="no_walkers")
    return walks


def read_mat(path: Path, *, frame_rate_hz: float | None = None, units: str | None = None) -> MotionCapture:
    """Read a MAT file: either markers, or walkers as Fourier series, which are returned as one person each.

    Parameters
    ----------
    path : Path
    frame_rate_hz, units
        Options of `arrays.read`, for a trial; walkers are in millimetres.

    Raises
    ------
    InvalidInput
        If the file contains neither walkers nor a trial.
    """
    shapes = {matrix.shape for matrix in load_matrices(read_bytes(path), path.name).values()}
    if (_ROWS, BLOCKS) not in shapes:
        return arrays.read(path, frame_rate_hz=frame_rate_hz, units=units)
    walks = mean_walkers(path)
    note = "Fourier series; the file states no stride frequency: one stride per second is assumed."
    return motion_of(walks, [note], path.name)


def _of_javascript(data: bytes, where: str) -> tuple[dict[str, np.ndarray], str]:
    """Return the arrays of the average walker and its axes, and source and licence, from the text of BMWalker.js."""
    text = data.decode("utf-8", "replace")
    named = {"mean": r"meanwalker\[0\]", **{axis: rf"{name}(?:\[0\])?" for axis, name in AXES.items()}}
    blocks = {}
    for name, pattern in named.items():
        match = re.search(rf"\bthis\.{pattern}\s*=\s*new Array\(([^()]*)\)", text)
        if not match:
            raise _no_walker(where, name)
        line = text.count("\n", 0, match.start()) + 1
        words = [word.strip() for word in match[1].rstrip().removesuffix(",").split(",")]
        location = f"{where}, line {line}"
        numbers = read_numbers(words, lambda _, location=location: location)  # type: ignore[misc]
        blocks[name] = _blocks(numbers, name, where)
    return blocks, SOURCE if _AUTHOR in text else ""


def _of_json(data: bytes, where: str) -> tuple[dict[str, np.ndarray], str]:
    """Return the arrays of the average walker and its axes from JSON, and the stated ``source`` and ``terms``."""
    content: Any = read_json(Path(where), content=data)
    axes = content.get("axes") if isinstance(content, dict) else None
    if not isinstance(axes, dict) or "mean_walker" not in content:
        raise _no_walker(where, "mean", OTHER_JSON)
    blocks = {}
    for name, values in {"mean": content["mean_walker"], **{axis: axes.get(axis) for axis in AXES}}.items():
        numbers = isinstance(values, list) and all(type(value) in (int, float) for value in values)
        if not numbers:
            raise _no_walker(where, name)
        blocks[name] = _blocks(np.array(values, float), name, where)
    stated = [content[key] for key in ("source", "terms") if isinstance(content.get(key), str)]
    words = " ".join("; ".join(stated).split())
    return blocks, SOURCE if _AUTHOR in words else "".join(filter(str.isprintable, words))[:MAX_WORDS]


def _no_walker(where: str, name: str, advice: str = "") -> Exception:
    return damaged(
        "the file does not contain an average walker" + (f": {advice}" if advice else ""),
        where,
        f"an array {'of the mean' if name == 'mean' else f'of the axis {name}'}, {_COUNT} numbers",
        code="no_walkers",
    )


def _blocks(numbers: np.ndarray, name: str, where: str) -> np.ndarray:
    """Return the numbers of a walker's array as five blocks of coefficients (5, 46), after checking their count."""
    if numbers.size != _COUNT or not np.isfinite(numbers).all():
        raise damaged(
            f"the array of {name} cannot be used",
            where,
            f"{_COUNT} numbers",
            numbers.size,
            code="wrong_count",
            count=numbers.size,
        )
    return numbers.reshape(BLOCKS, -1)
