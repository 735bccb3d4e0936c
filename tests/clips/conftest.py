"""Recordings for tests of clips: bending to the floor, with missing joints in some frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.formats.points import trc
from pipeline.skeleton import WALKER15
from pipeline.synthetic import bending


@pytest.fixture(scope="session")
def bends(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of four performances at 60 Hz; one lacks the head in the middle, another a wrist at the start."""
    folder = tmp_path_factory.mktemp("bends")
    output = bending.bending_performances(
        np.random.default_rng(5), performances=4, subjects=2, frames_mean=90, frame_rate_hz=60.0
    )
    for n, motion in enumerate(output.positions_mm):
        motion = motion.copy()
        if n == 2:
            motion[30:60, 0] = np.nan
        if n == 3:
            motion[:20, 4] = np.nan
        trc.write(folder / f"{'ab'[n % 2]}_{n}.trc", WALKER15.joints, motion, 60.0)
    return folder
