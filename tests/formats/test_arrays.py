"""Tests of NPZ files: exported files are read, other content is rejected, and no code is executed."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from pipeline import formats
from tests.formats.contract import FIXTURES, check_contract
from tests.rejects import rejects

WHOLE = {"names": np.array(["a", "b"]), "positions_mm": np.ones((3, 2, 3)), "frame_rate_hz": np.array(60.0)}


def test_the_fixture() -> None:
    motion = formats.read(FIXTURES / "npz_two_points.npz")
    check_contract(motion)
    assert (motion.names, motion.frame_rate_hz) == (("left_hip", "right_hip"), 100.0)
    np.testing.assert_array_equal(motion.positions_mm[0], [[0, 1, 2], [3, 4, 5]])
    assert motion.valid.tolist() == [[True, True], [True, False], [True, True]]


def test_the_rate_and_the_unit_may_be_given(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, **{name: WHOLE[name] for name in ("names", "positions_mm")})
    with rejects("unknown_rate"):
        formats.read(path)
    motion = formats.read(path, frame_rate_hz=30.0, units="m")
    assert (motion.frame_rate_hz, motion.positions_mm.max()) == (30.0, 1000.0)


@pytest.mark.parametrize(
    ("arrays", "code"),
    [
        (
            {"poses": np.ones((3, 156)), "trans": np.ones((3, 3))},
            "body_model",
        ),
        ({"x": np.ones(3)}, "no_arrays"),
        (WHOLE | {"positions_mm": np.ones((3, 3, 3))}, "arrays_disagree"),
        (WHOLE | {"positions_mm": np.ones((0, 2, 3))}, "arrays_disagree"),
        (WHOLE | {"names": np.array([1, 2])}, "arrays_disagree"),
        (
            WHOLE | {"names": np.array(["a", None], dtype=object)},
            "unreadable",
        ),
        (WHOLE | {"frame_rate_hz": np.array(-5.0)}, "unknown_rate"),
    ],
)
def test_other_arrays_are_refused(arrays: dict[str, np.ndarray], code: str, tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", **arrays)
    with rejects(code, "a.npz"):
        formats.read(tmp_path / "a.npz")


def test_what_is_no_archive_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    for content in (pickle.dumps(WHOLE), b"abc", (FIXTURES / "npz_two_points.npz").read_bytes()[:-30]):
        path.write_bytes(content)
        with rejects("unreadable", path.name):
            formats.read(path)


@pytest.mark.parametrize("labels", [np.array(["LANK", "RANK"]), np.array([b"LANK", b"RANK"])])
@pytest.mark.parametrize("rate", ["mocap_framerate", "mocap_frame_rate"])
def test_the_markers_of_amass(labels: np.ndarray, rate: str, tmp_path: Path) -> None:
    path = tmp_path / "stageii.npz"
    markers = np.arange(1.0, 19.0).reshape(3, 2, 3).astype(np.float32)
    markers[1, 0], markers[2, 1] = 0.0, np.nan
    body = {"poses": np.zeros((3, 156)), "trans": np.zeros((3, 3)), "gender": np.array("neutral")}
    np.savez(path, marker_data=markers, marker_labels=labels, **{rate: np.array(120.0)}, **body)
    motion = formats.read(path)
    check_contract(motion)
    assert (motion.names, motion.frame_rate_hz, motion.units) == (("LANK", "RANK"), 120.0, "m")
    assert motion.units_assumed
    assert motion.valid.tolist() == [[True, True], [False, True], [True, False]]
    np.testing.assert_array_equal(motion.positions_mm[0], [[1000, 2000, 3000], [4000, 5000, 6000]])
    assert not formats.read(path, units="mm").units_assumed
    np.testing.assert_array_equal(formats.read(path, units="mm").positions_mm[0, 0], [1, 2, 3])


@pytest.mark.parametrize(("frames", "points"), [(1, 2), (3, 1), (1, 1)])
def test_a_single_frame_and_a_single_point_are_read_but_none_is_not(
    tmp_path: Path, frames: int, points: int
) -> None:
    names, positions = np.array(["a", "b"][:points]), np.full((frames, points, 3), 2.0)
    np.savez(tmp_path / "a.npz", names=names, positions_mm=positions, frame_rate_hz=60.0)
    np.testing.assert_array_equal(formats.read(tmp_path / "a.npz").positions_mm, positions)
    np.savez(tmp_path / "b.npz", names=names, positions_mm=positions[:0], frame_rate_hz=60.0)
    with rejects("arrays_disagree"):
        formats.read(tmp_path / "b.npz")
