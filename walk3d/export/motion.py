"""Writer of motion files: the suffix selects the format and its usual axes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.formats.points import csv, trc
from pipeline.shortened import shortened
from pipeline.storage.artefacts import packed
from pipeline.validation import require_choice
from walk3d.export.bvh import Names, character
from walk3d.export.bvh import write as write_bvh
from walk3d.export.c3d import write as write_c3d

WRITTEN = (".c3d", ".trc", ".bvh", ".csv", ".npz")
"""Suffixes of the formats that `write` supports."""

_Y_UP_FORWARD_X = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
"""Rotation to the axes of OpenSim: x forward, y up, z to the walker's right."""
_Y_UP_FORWARD_Z = np.array([[-1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
"""Rotation to the axes of BVH: z forward, y up, x to the walker's left."""


@shortened
class Motion:
    """Motion of points over time, with the information that motion files need.

    Attributes
    ----------
    names : tuple of str
    positions : (T, P, 3)
        Millimetres, z up unless `own_axes`.
    frame_rate_hz : float
    parents : tuple of int or None
        Index of each point's parent, for formats with a hierarchy.
    own_axes : bool
        Keep the axes of the recording.
    character : Names or None
        Naming scheme of a BVH character for retargeting, made from the joints of WALKER15.
    """

    names: tuple[str, ...]
    positions: np.ndarray
    frame_rate_hz: float
    parents: tuple[int, ...] | None
    own_axes: bool = False
    character: Names | None = None


def write(target: Path, motion: Motion, *, wide: bool = False) -> None:
    """Write points in the format of the file's suffix.

    TRC has y up and x forward, as in OpenSim; BVH has y up and z forward.

    Parameters
    ----------
    target : Path
    motion : Motion
    wide : bool
        Give a CSV one column for each coordinate, instead of one row for each point and frame.

    Raises
    ------
    InvalidInput
        If the suffix has no writer, or the writer rejects the points.
    """
    suffix = require_choice("the suffix of a motion file", target.suffix.lower(), WRITTEN)
    names, positions, rate = motion.names, motion.positions, motion.frame_rate_hz
    if suffix == ".c3d":
        write_c3d(target, names, positions, rate)
    elif suffix == ".trc":
        trc.write(target, names, positions if motion.own_axes else positions @ _Y_UP_FORWARD_X.T, rate)
    elif suffix == ".bvh":
        turned = positions if motion.own_axes else positions @ _Y_UP_FORWARD_Z.T
        if motion.character is None:
            write_bvh(target, names, turned, rate, motion.parents)
        else:
            rig = character(turned, motion.character)
            write_bvh(target, rig.names, rig.positions, rate, rig.parents, rig.rest)
    elif suffix == ".csv":
        csv.write(target, names, positions, rate, wide=wide)
    else:
        arrays = {"names": np.array(names), "positions_mm": positions, "frame_rate_hz": np.array(rate)}
        target.write_bytes(packed(arrays))
