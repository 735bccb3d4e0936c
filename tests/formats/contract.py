"""Requirements on the result of every file reader, one correct file of each format, and functions that damage files."""

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
"""Files that can be read without an error; the skeleton of the AMC file is in the same folder."""


def check_contract(motion: MotionCapture) -> None:
    """Assert that shapes, names, gaps and frame rate of a recording are consistent."""
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
    """Replace a text that occurs exactly once in a file, so that no test passes on an unchanged file."""
    text = path.read_bytes().decode()
    assert text.count(old) == 1
    path.write_bytes(text.replace(old, new).encode())


def source_mapping(name: str) -> SourceMapping:
    """Return a copy of the mapping ``conf/skeleton/<name>.yaml``, which the test may change."""
    return copy.deepcopy(shipped()[name])


def recording(names: tuple[str, ...], positions_mm: np.ndarray) -> MotionCapture:
    """Return a recording of points (T, P, 3), mm, at 120 Hz."""
    return MotionCapture(
        names=names,
        positions_mm=positions_mm,
        valid=np.isfinite(positions_mm).all(axis=-1),
        frame_rate_hz=120.0,
        units="mm",
    )
