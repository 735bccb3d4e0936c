"""A model of synthetic walkers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.core.keypoint_walk import compact, moments
from pipeline.core.keypoint_walk.calibration import Calibration
from pipeline.reconstruct import model_file
from tests.core.keypoint_walk.walkers import walks


@pytest.fixture(scope="session")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model of the synthetic walkers, its bars not calibrated."""
    small = compact(moments(walks()[1:], np.arange(len(walks()) - 1)), 6)
    folder = tmp_path_factory.mktemp("model")
    calibration = Calibration(np.ones((8, 3, 3)), np.ones((6, 3)), np.ones((20, 3)))
    model_file.save(model_file.TrainedModel(small, calibration, {"note": "synthetic"}), folder)
    return folder
