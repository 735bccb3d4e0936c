"""What every reader keeps to, and how the tests of text formats spoil a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.skeleton import MotionCapture


def check_contract(motion: MotionCapture) -> None:
    """Fail unless the shapes, names, gaps and rate of a reading fit each other."""
    frames, points = motion.valid.shape
    assert motion.positions_mm.shape == (frames, points, 3)
    assert motion.positions_mm.dtype == np.float64
    assert points == len(motion.names) == len(set(motion.names))
    assert frames > 0
    assert np.array_equal(motion.valid, np.isfinite(motion.positions_mm).all(axis=-1))
    assert np.isnan(motion.positions_mm[~motion.valid]).all()
    assert motion.angles_deg.shape == (frames, len(motion.channels))
    assert np.isfinite(motion.frame_rate_hz)
    assert motion.frame_rate_hz > 0


def replace(path: Path, old: str, new: str) -> None:
    """Replace exactly one occurrence, so that no test passes because nothing was changed."""
    text = path.read_bytes().decode()
    assert text.count(old) == 1
    path.write_bytes(text.replace(old, new).encode())
