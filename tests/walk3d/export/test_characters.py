"""Tests of characters for animation: one root, rotations only, a T-pose at rest, feet, and recognised names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline import mappings
from pipeline.core import fourier
from pipeline.formats import bvh
from pipeline.ingestion.joints import joints_of
from pipeline.skeleton import WALKER15
from pipeline.synthetic import walkers
from tests.formats.bvh import independent
from walk3d.export.bvh import Names, character
from walk3d.export.bvh import write as write_bvh

HZ = 50.0
J = {joint: j for j, joint in enumerate(WALKER15.joints)}


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    """Return a walk (T, 15, 3), mm, along z with y up."""
    output = walkers.walking_population(
        np.random.default_rng(3), male=1, female=0, duration_s=3.0, frame_rate_hz=HZ
    )
    series = fourier.represent(output.positions_mm[0], HZ)
    x, y, z = np.moveaxis(
        fourier.synthesise(series.coefficients, series.frequency_hz, np.arange(60) / HZ), -1, 0
    )
    return np.stack([-x, z, y + 1200.0 * np.arange(60)[:, None] / HZ], axis=-1)


def written(walk: np.ndarray, names: Names, path: Path) -> Path:
    """Write the character of a walk to a BVH file, and return its path."""
    output = character(walk, names)
    write_bvh(path, output.names, output.positions, HZ, output.parents, output.rest)
    return path


@pytest.mark.parametrize("names", Names)
def test_joints_are_known_again_by_their_names(walk: np.ndarray, names: Names, tmp_path: Path) -> None:
    read = bvh.read(written(walk, names, tmp_path / "a.bvh"))
    assert not any("estimated" in name for name in read.names)
    _, positions, valid = joints_of(read, mappings.chosen(mappings.AUTO), "")
    assert valid.all()
    lifted = (character(walk, names).positions[:, 0] - walk[:, J["pelvis"]])[0, [2, 0, 1]]
    assert lifted[2] > 30  # soles below ankles
    # z up again; limbs have constant lengths, and mappings approximate head and pelvis.
    off = np.linalg.norm(positions - walk[..., [2, 0, 1]] - lifted, axis=-1)
    limbs = [j for joint, j in J.items() if joint not in ("head", "pelvis")]
    assert off[:, limbs].mean() < 25
    assert off[:, limbs].max() < 90
    assert off.max() < 140


@pytest.mark.parametrize(("names", "share"), [(Names.ours, 1.0), (Names.mixamo, 0.6), (Names.rokoko, 0.6)])
def test_the_head_is_its_centre_in_our_names_and_the_base_of_the_skull_in_others(
    walk: np.ndarray, names: Names, share: float, tmp_path: Path
) -> None:
    output = character(walk, names)
    called = ("head", "head_end", "pelvis") if share == 1.0 else ("Head", "HeadEnd", "Hips")
    head, end, hips = map(output.names.index, called)
    sternum, centre, pelvis = (walk[:, J[joint]] for joint in ("sternum", "head", "pelvis"))
    lift = output.positions[:, hips] - pelvis
    np.testing.assert_allclose(output.positions[:, head] - lift, sternum + share * (centre - sternum))
    np.testing.assert_allclose(output.positions[:, end] - lift, sternum + 1.4 * (centre - sternum))
    read = bvh.read(written(walk, names, tmp_path / "a.bvh"))
    position = read.names.index(output.names[head])
    off = np.linalg.norm(read.positions_mm[:, position] - output.positions[:, head], axis=-1)
    assert off.max() < 10.0  # limbs of constant length


def test_one_root_turns_and_moves_and_the_rest_turns(walk: np.ndarray, tmp_path: Path) -> None:
    text = written(walk, Names.mixamo, tmp_path / "a.bvh").read_text(encoding="utf-8")
    assert text.count("ROOT ") == 1
    assert text.count("CHANNELS 6") == 1
    assert text.count("CHANNELS 3 Zrotation Xrotation Yrotation") == text.count("JOINT ")
    assert text.count("End Site") == 5  # head, hands, toes
    rotations, seconds = independent.read(tmp_path / "a.bvh", rotations_only=True)
    assert seconds == pytest.approx(1 / HZ)
    ours = bvh.read(tmp_path / "a.bvh")
    for name, positions in rotations.items():
        if name in ours.names:
            result = ours.positions_mm[:, ours.names.index(name)]
            np.testing.assert_allclose(result, np.array(positions) * 10, atol=1e-6)


def test_at_rest_it_stands_in_a_t_pose(walk: np.ndarray) -> None:
    output = character(walk, Names.rokoko)
    rest = dict(zip(output.names, output.rest, strict=True))
    for side, outwards in (("Left", 1.0), ("Right", -1.0)):
        for joint in ("Arm", "ForeArm", "Hand"):
            np.testing.assert_array_equal(rest[f"{side}{joint}"], [outwards, 0, 0])
        for joint in ("Shin", "Foot"):
            np.testing.assert_array_equal(rest[f"{side}{joint}"], [0, -1, 0])
        assert rest[f"{side}Toe"][2] > 0.8
    assert output.parents.count(-1) == 1


def test_feet_point_forwards_and_stand_flat_below_an_upright_shank(walk: np.ndarray) -> None:
    output = character(walk, Names.ours)
    at = dict(zip(output.names, np.moveaxis(output.positions, 1, 0), strict=True))
    for side in ("left", "right"):
        foot, shank = at[f"{side}_toes"] - at[f"{side}_ankle"], at[f"{side}_ankle"] - at[f"{side}_knee"]
        assert (foot[:, 2] > 0).mean() > 0.9
        length = np.linalg.norm(foot, axis=-1)
        np.testing.assert_allclose(length, length[0])
        assert 100 < length[0] < 180
        upright = np.abs(np.arctan2(shank[:, 2], -shank[:, 1])).argmin()
        assert at[f"{side}_toes_end"][upright, 1] == pytest.approx(at[f"{side}_toes"][upright, 1], abs=15)
