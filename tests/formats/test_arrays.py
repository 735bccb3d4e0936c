"""NPZ files: what is exported is read, what is anything else is refused, and nothing is run or unpacked without end."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from pipeline import formats
from pipeline.validation import InvalidInput
from tests.formats.contract import FIXTURES, check_contract

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
    with pytest.raises(InvalidInput, match="the frame rate is unknown"):
        formats.read(path)
    motion = formats.read(path, frame_rate_hz=30.0, units="m")
    assert (motion.frame_rate_hz, motion.positions_mm.max()) == (30.0, 1000.0)


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        (
            {"poses": np.ones((3, 156)), "trans": np.ones((3, 3))},
            "parameters of a body model: export its joints",
        ),
        ({"x": np.ones(3)}, "holds no arrays names and positions_mm .*received x"),
        (WHOLE | {"positions_mm": np.ones((3, 3, 3))}, "the arrays do not fit each other"),
        (WHOLE | {"positions_mm": np.ones((0, 2, 3))}, "the arrays do not fit each other"),
        (WHOLE | {"names": np.array([1, 2])}, "the arrays do not fit each other"),
        (
            WHOLE | {"names": np.array(["a", None], dtype=object)},
            "cannot be read .*Object arrays cannot be loaded",
        ),
        (WHOLE | {"frame_rate_hz": np.array(-5.0)}, "the frame rate is unknown"),
    ],
)
def test_other_arrays_are_refused(arrays: dict[str, np.ndarray], words: str, tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(InvalidInput, match=words):
        formats.read(tmp_path / "a.npz")


def test_what_is_no_archive_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    for content in (pickle.dumps(WHOLE), b"abc", (FIXTURES / "npz_two_points.npz").read_bytes()[:-30]):
        path.write_bytes(content)
        with pytest.raises(InvalidInput, match=r"expected a whole \.npz file"):
            formats.read(path)
