"""The contract of every reader, one correct file of each format, and ways to damage a file."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np

from pipeline.formats import READERS
from pipeline.mappings import shipped
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import SourceMapping

ROOT = Path(__file__).parents[2]
FIXTURES = ROOT / "tests" / "fixtures"
READABLE = sorted(p for p in FIXTURES.iterdir() if p.suffix in READERS)
"""Files that are read without complaint; the skeleton of the AMC file is in the same folder."""


def check_contract(motion: MotionCapture) -> None:
    """Fail unless the shapes, names, gaps and rate of a recording fit each other."""
    frames, points = motion.valid.shape
    assert motion.positions_mm.shape == (frames, points, 3)
    assert motion.positions_mm.dtype == np.float64
    assert points == len(motion.names)
    assert len(set(motion.names)) == points or any("more than once" in note for note in motion.notes)
    assert frames > 0
    assert points > 0
    assert np.array_equal(motion.valid, np.isfinite(motion.positions_mm).all(axis=-1))
    assert np.isnan(motion.positions_mm[~motion.valid]).all()
    assert np.isfinite(motion.frame_rate_hz)
    assert motion.frame_rate_hz > 0
    assert motion.units


def replace(path: Path, old: str, new: str) -> None:
    """Replace exactly one occurrence, so that no test passes because nothing was changed."""
    text = path.read_bytes().decode()
    assert text.count(old) == 1
    path.write_bytes(text.replace(old, new).encode())


def source_mapping(name: str) -> SourceMapping:
    """The mapping of ``conf/skeleton/<name>.yaml``, the test's own copy."""
    return copy.deepcopy(shipped()[name])


def recording(names: tuple[str, ...], positions_mm: np.ndarray) -> MotionCapture:
    """A recording (T, P, 3) of points in millimetres at 120 Hz."""
    return MotionCapture(
        names=names,
        positions_mm=positions_mm,
        valid=np.isfinite(positions_mm).all(axis=-1),
        frame_rate_hz=120.0,
        units="mm",
    )
