"""Files that would ask for far more memory or time than their size: the clip is refused before it is taken."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import pytest

from pipeline import formats
from pipeline.validation import InvalidInput

ENDS = "End Site\n{\nOFFSET 0 1 0\n}\n"
BVH = (
    "HIERARCHY\nROOT a\n{{\nOFFSET 0 0 0\nCHANNELS 1 Xposition\n{ends}}}\n"
    "MOTION\nFrames: {frames}\nFrame Time: 0.01\n"
)
ASF = """:version 1.10
:name A
:units
  mass 1.0
  length 1.0
  angle deg
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
"""


def bone(k: int) -> str:
    return f"begin\nid {k}\nname b{k}\ndirection 1 0 0\nlength 1\naxis 0 0 0 XYZ\nend\n"


def refused(path: Path, words: str) -> None:
    tracemalloc.start()
    try:
        with pytest.raises(InvalidInput, match=words):
            formats.read(path)
        assert tracemalloc.get_traced_memory()[1] < 64 * 2**20
    finally:
        tracemalloc.stop()


def test_joints_that_do_not_move_are_out_of_proportion(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(BVH.format(ends=ENDS * 1500, frames=20000) + "0\n" * 20000, encoding="utf-8")
    refused(path, "a.bvh: too many frames and points")


def test_too_many_joints_are_refused_at_once(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(BVH.format(ends=ENDS * 20000, frames=1) + "0\n", encoding="utf-8")
    refused(path, r"a\.bvh, line \d+: the hierarchy has too many joints \(expected 2000 or fewer")


def test_bones_that_do_not_move_are_out_of_proportion(tmp_path: Path) -> None:
    names = [f"b{k}" for k in range(1500)]
    hierarchy = ":hierarchy\nbegin\nroot " + " ".join(names) + "\nend\n"
    (tmp_path / "a.asf").write_text(ASF + "".join(map(bone, range(1500))) + hierarchy, encoding="utf-8")
    frames = "".join(f"{k}\nroot 0 0 0 0 0 0\n" for k in range(1, 5001))
    (tmp_path / "a.amc").write_text(":FULLY-SPECIFIED\n:DEGREES\n" + frames, encoding="utf-8")
    refused(tmp_path / "a.amc", "a.amc: too many frames and points")
