"""Tests with public recordings in the folder WILD_RECORDINGS: each is read, or rejected with advice."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from pipeline import formats
from pipeline.core import walking
from pipeline.mappings import rescaled, shipped, suggest
from pipeline.skeleton.mapped_joints import map_joints
from tests.formats.contract import check_contract

FOLDER = Path(os.environ.get("WILD_RECORDINGS") or "no such folder")
EXPECTED = {
    "bts.c3d": "davis",
    "camargo_levelground_legs_only.trc": "helen_hayes",
    "cmu_12_01_walk.bvh": "cmu_bvh",
    "comma_separated_not_walking.trc": "",
    "dataset-1_walk_normal_001.bvh": "bandai_namco",
    "dataset-2_walk_elderly_016.bvh": "bandai_namco",
    "figure_of_eight_walk.bvh": "mixamo",
    "mixamo_names.bvh": "named_joints",
    "moco_datarate_zero.trc": "plugin_gait",
    "nexus_pig_239_points.c3d": "plugin_gait",
    "nexus_pig_outputs_first.c3d": "plugin_gait",
    "opencap_validation_walking1.trc": "opencap",
    "opencap_validation_walkingTS1.trc": "opencap",
    "qualisys_ior.c3d": "ior",
    "rokoko_walking.bvh": "rokoko",
    "theia_rotations_only.c3d": "theia",
    "truncated_qualisys_names.trc": "ior",
}
"""Expected mapping of each file, or an empty string for files without legs."""


@pytest.mark.parametrize("name", EXPECTED)
def test_a_recording_as_people_have_it(name: str) -> None:
    path = FOLDER / name
    if not path.is_file():
        pytest.skip("needs WILD_RECORDINGS")
    motion = formats.read(path)
    check_contract(motion)
    fit = suggest(motion, shipped().values())
    assert (fit.mapping.name if fit.usable else "") == EXPECTED[name]
    if fit.usable:
        positions, _ = map_joints(motion, fit.mapping)
        factor, _ = rescaled(motion, fit.mapping, walking.leg_length(positions))
        low, high = walking.LEG_LENGTH_MM
        length = walking.leg_length(positions) * (factor)
        assert low < length < high
        ankles = positions[:, [11, 14], 2]
        assert np.nanmean(positions[:, 8, 2]) > np.nanmean(ankles)  # z is up
