"""Fixtures with a model of synthetic walkers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.walk3d.film.walk.walkers import walks
from walk3d.film.reconstruct import model_file
from walk3d.film.walk import compact, moments
from walk3d.film.walk.calibration import ANYBODY, AS_OURS, Calibration


@pytest.fixture(scope="session")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a model of synthetic walkers, with error bars 1.5 times as wide for `anybody`."""
    small = compact(moments(walks()[1:], np.arange(len(walks()) - 1)), 6)
    folder = tmp_path_factory.mktemp("model")
    shapes = ((8, 3, 3), (6, 3), (20, 3), (2, 3))
    calibrations = {
        group: Calibration(*(np.full(shape, wide) for shape in shapes))
        for group, wide in ((AS_OURS, 1.0), (ANYBODY, 1.5))
    }
    model_file.save(
        model_file.TrainedModel(small, calibrations, {"people_by_source": {"synthetic": 1}}), folder
    )
    return folder
