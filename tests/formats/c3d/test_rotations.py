"""Tests of C3D files with rotations of body segments and without points, as markerless systems write them."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from pipeline.formats import c3d
from tests.formats.c3d.test_c3d import INTEL, integers, parameter, reals
from tests.formats.contract import check_contract
from tests.rejects import rejects

NAMES = ["pelvis_4X4", "l_thigh_4X4"]


def made(origins: np.ndarray, processor: int = INTEL, **changed: object) -> bytes:
    """Return a C3D file with the poses of segments that rotate about z and have the given origins (T, S, 3)."""
    frames, segments = origins.shape[:2]
    matrices = np.zeros((frames, segments, 4, 4))
    matrices[..., 3, 3] = 1
    angle = np.arange(frames)[:, None]
    matrices[..., 0, 0], matrices[..., 1, 1] = np.cos(angle), np.cos(angle)
    matrices[..., 1, 0], matrices[..., 0, 1] = np.sin(angle), -np.sin(angle)
    matrices[..., 2, 2] = 1
    matrices[..., :3, 3] = origins
    columns = np.swapaxes(matrices, -1, -2).reshape(frames, segments, 16)
    numbers = np.concatenate([columns, np.zeros((frames, segments, 1))], axis=-1)
    rotation = {"USED": segments, "LABELS": NAMES, "RATE": 85.0, "RATIO": 1, "DATA_START": 3} | changed
    records = b""
    for group, (name, values) in enumerate(
        [("POINT", {"USED": 0, "UNITS": "m", "SCALE": -1.0}), ("ROTATION", rotation)], start=1
    ):
        records += struct.pack("bb", len(name), -group) + name.encode() + integers(3, processor) + b"\0"
        for key, value in values.items():
            records += parameter(key, group, value, processor)
    section = (b"\1\x50" + bytes([1, processor]) + records).ljust(512, b"\0")
    assert len(section) == 512
    head = b"\2\x50" + integers([0, 0, 1, frames, 10], processor) + reals(-1.0, processor)
    head += integers([3, 0], processor) + reals(85.0, processor)
    return head.ljust(512, b"\0") + section + reals(numbers, processor)


ORIGINS = np.arange(24.0).reshape(4, 2, 3)


def test_positions_are_the_origins_of_the_matrices(tmp_path: Path) -> None:
    path = tmp_path / "a.c3d"
    path.write_bytes(made(ORIGINS))
    motion = c3d.read(path)
    check_contract(motion)
    assert motion.names == ("pelvis", "l_thigh")
    assert (motion.frame_rate_hz, motion.units) == (85.0, "m")
    np.testing.assert_array_equal(motion.positions_mm, 1000 * ORIGINS)
    assert "no points" in motion.notes[0]


def test_ezc3d_sees_the_same_matrices(tmp_path: Path) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    path = tmp_path / "a.c3d"
    path.write_bytes(made(ORIGINS).ljust(4 * 512, b"\0"))
    theirs = ezc3d.c3d(str(path))["data"]["rotations"]
    np.testing.assert_array_equal(theirs[:3, 3].transpose(2, 1, 0), ORIGINS)


@pytest.mark.parametrize("changed", [{"DATA_START": 9}, {"USED": 5}, {"RATE": 0.0}])
def test_matrices_that_are_not_there_are_refused(changed: dict[str, object], tmp_path: Path) -> None:
    path = tmp_path / "a.c3d"
    path.write_bytes(made(ORIGINS, **changed))
    with rejects("truncated", "a.c3d, ROTATION"):
        c3d.read(path)


def test_a_file_of_neither_points_nor_segments_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.c3d"
    path.write_bytes(made(ORIGINS, USED=0))
    with rejects("no_points", "a.c3d"):
        c3d.read(path)


def test_every_cut_is_refused(tmp_path: Path) -> None:
    data = made(ORIGINS)
    path = tmp_path / "a.c3d"
    for size in range(1024, len(data)):
        path.write_bytes(data[:size])
        with rejects("truncated"):
            c3d.read(path)
