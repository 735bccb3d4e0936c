"""Tests of the upward axis: the user's option has priority, then the data, then the axis of the mapping."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import pipeline
from pipeline import formats
from pipeline.cli.compose import compose
from pipeline.cli.inspect import inspect
from pipeline.clips.kinds import PERFORMANCES, WALKS
from pipeline.formats.points import trc
from pipeline.ingestion.joints import joints_of
from pipeline.skeleton import WALKER15
from pipeline.skeleton.source_mapping import UpAxis
from pipeline.synthetic.walkers import walking_population
from tests.conftest import CommandResult
from tests.rejects import rejects
from walk3d.export import bvh as writing
from walk3d.export.command import export

HZ = 60.0
HEAD, PELVIS = WALKER15.index("head"), WALKER15.index("pelvis")


@pytest.fixture(scope="module")
def person() -> np.ndarray:
    """Joints (T, 15, 3), mm, of a walker, with z up."""
    people = walking_population(np.random.default_rng(3), male=1, female=0, duration_s=4.0, frame_rate_hz=HZ)
    joints = np.asarray(people.positions_mm[0])
    joints[:, PELVIS] = joints[:, [9, 12]].mean(axis=1)  # as the mapping has it
    return joints


def cmu_bvh(path: Path, person: np.ndarray, cycled: int) -> Path:
    """Write a BVH file with CMU's joint names and y up, or with cyclically exchanged axes."""
    joints = dict(zip(WALKER15.joints, np.moveaxis(person, 1, 0), strict=True))
    points = {"Hips": joints["pelvis"], "LowerBack": joints["pelvis"], "Spine": joints["sternum"]}
    points |= {"Spine1": joints["sternum"], "Neck1": joints["sternum"], "Head_end": joints["head"]}
    for side in ("Left", "Right"):
        shoulder, elbow, wrist, hip, knee, ankle = (
            joints[f"{side.lower()}_{part}"]
            for part in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
        )
        points |= {
            f"{side}Arm": shoulder,
            f"{side}ForeArm": elbow,
            f"{side}Hand": (2.0 * wrist + elbow) / 3.0,
        }
        points |= {f"{side[0]}HipJoint": hip, f"{side}UpLeg": hip, f"{side}Leg": knee, f"{side}Foot": ankle}
    z_up = np.stack([*points.values()], axis=1)
    y_up = np.roll(z_up, -1, axis=-1)  # (y, z, x)
    writing.write(path, [*points], np.roll(y_up, cycled, axis=-1), HZ)
    return path


@pytest.mark.parametrize(("cycled", "up"), [(0, "y"), (1, "z"), (2, "x")])
def test_a_bvh_with_the_names_of_cmu_stands_upright_whatever_its_axes(
    person: np.ndarray, tmp_path: Path, cycled: int, up: str, recwarn: pytest.WarningsRecorder
) -> None:
    motion = pipeline.read(cmu_bvh(tmp_path / "a.bvh", person, cycled), units="cm")
    positions, valid = pipeline.joints(motion)
    assert valid.all()
    np.testing.assert_allclose(positions, person, atol=0.01)
    sentence = f"cmu_bvh declares that y points up, but the body stands along {up}, which is used"
    assert [str(warning.message) for warning in recwarn.list] == [sentence] * (up != "y")
    read, _, _ = joints_of(motion, None)
    assert [complaint.code for complaint in read.complaints] == ["axis"] * (up != "y")


@pytest.mark.parametrize("up", ["y", "-x"])
def test_what_the_user_states_counts_before_what_the_joints_say(
    person: np.ndarray, tmp_path: Path, up: str
) -> None:
    path = cmu_bvh(tmp_path / "a.bvh", person, 1)  # z up
    motion = pipeline.read(path, units="cm")
    with pytest.warns(UserWarning, match="the body stands along"):
        lying, _ = pipeline.joints(motion, up=up)
    reference = (person[:, HEAD] - person[:, PELVIS]) * 1.0
    observed = {"y": reference[:, 1], "-x": -reference[:, 0]}[up]  # heights along that axis
    np.testing.assert_allclose((lying[:, HEAD] - lying[:, PELVIS])[:, 2], observed, atol=0.01)
    stated = pipeline.read(path, units="cm", up=up)
    np.testing.assert_array_equal(stated.positions_mm, motion.positions_mm)
    with pytest.warns(UserWarning, match="the body stands along"):
        np.testing.assert_array_equal(pipeline.joints(stated)[0], lying)
    with rejects("unknown_choice", "up", value="up"):
        pipeline.read(path, up="up")
    with rejects("unknown_choice", "up", value="w"):
        pipeline.joints(motion, up="w")


def test_a_walk_is_represented_alike_in_any_axes(person: np.ndarray, tmp_path: Path) -> None:
    paths = [cmu_bvh(tmp_path / f"{k}.bvh", person, k) for k in range(3)]
    expected = pipeline.represent(paths[0], units="cm")
    for path, up in zip(paths[1:], "zx", strict=True):
        with pytest.warns(UserWarning, match=f"stands along {up}"):
            representation = pipeline.represent(path, units="cm")
        np.testing.assert_allclose(representation.coefficients, expected.coefficients, atol=0.01)
        np.testing.assert_allclose(
            pipeline.represent(path, units="cm", up=up).coefficients, expected.coefficients, atol=0.01
        )


@pytest.mark.parametrize(("cycled", "up"), [(0, "y"), (1, "z"), (2, "x")])
def test_export_writes_joints_and_points_upright(
    person: np.ndarray, tmp_path: Path, cycled: int, up: str
) -> None:
    source = str(cmu_bvh(tmp_path / "a.bvh", person, cycled))
    for options, names in ((["skeleton=auto"], ("head", "pelvis")), ([f"up={up}"], ("Head_end", "Hips"))):
        target = export([source, "units=cm", *options, f"to={tmp_path / options[0]}.trc"])  # y up in OpenSim
        written = formats.read(target)
        heights = [written.positions_mm[:, written.names.index(name), 1] for name in names]
        reference = (person[:, HEAD] - person[:, PELVIS])[:, 2]
        np.testing.assert_allclose(heights[0] - heights[1], reference, atol=0.1)


def test_inspect_says_which_axis_is_used_and_takes_another(person: np.ndarray, tmp_path: Path) -> None:
    source = str(cmu_bvh(tmp_path / "a.bvh", person, 1))
    (result,) = inspect([source, "units=cm"])
    assert "axis up: z" in result.lines
    assert "cmu_bvh declares that y points up, but the body stands along z, which is used" in result.lines
    assert result.strides > 2
    (result,) = inspect([source, "units=cm", "up=-x"])
    assert "axis up: -x" in result.lines
    assert any(line.startswith("the body stands along") for line in result.lines)
    assert result.strides == 0


def test_a_point_light_walker_takes_the_axis(
    person: np.ndarray, tmp_path: Path, say: Callable[..., CommandResult]
) -> None:
    source = str(cmu_bvh(tmp_path / "a.bvh", person, 1))
    heights = []
    for options in ([], ["up=z"]):
        target = tmp_path / f"{len(options)}.csv"
        message = say("pointlight", source, "units=cm", *options, f"to={target}")
        assert message.status == 0, message.err
        assert ("stands along z, which is used" in message.out) is (not options)
        heights.append(target.read_bytes())
    assert heights[0] == heights[1]
    lying = say("pointlight", source, "units=cm", "up=y", f"to={tmp_path / 'c.csv'}")
    assert "the body stands along x" in lying.out


@pytest.mark.parametrize(("up", "kept"), [("auto", True), ("z", True), ("-y", False), ("-x", False)])
def test_the_axis_of_a_folder_is_a_closed_choice_that_ingest_takes(
    person: np.ndarray, tmp_path: Path, up: str, kept: bool
) -> None:
    for name in ("a", "b", "c"):
        trc.write(tmp_path / f"{name}_1.trc", WALKER15.joints, person * (1.0 + 0.03 * (ord(name) - 97)), HZ)
    options = ["data=folder", f"data.path={tmp_path}", f"data.up={up}", "skeleton=auto"]
    experiment = compose(["experiment=zhang2007_fig5", *options])
    assert experiment.data.up is UpAxis(up)
    request = experiment.data.request(WALKS, experiment.skeleton, 1, 1)
    assert {clip["up"] for clip in request.options["clips"]} == {UpAxis(up)}
    if kept:
        assert len(request.make()) == 3
    else:
        with rejects("too_few_clips", count=0):
            request.make()


def test_another_word_for_an_axis_is_refused_with_the_choices(say: Callable[..., CommandResult]) -> None:
    message = say("experiment=zhang2007_fig5", "data=folder", "data.up=w")
    assert message.status == 1
    assert "data.up" in message.err
    assert "data.up: Invalid value 'w', expected one of [x, y, z, -x, -y, -z, auto]" in message.err


def test_an_action_in_other_axes_is_upright_as_a_performance(person: np.ndarray, tmp_path: Path) -> None:
    for k in range(3):
        cmu_bvh(tmp_path / f"actor{k}_1.bvh", person * (1.0 + 0.02 * k), 1)
    options = ["data=folder", f"data.path={tmp_path}", "data.units=cm", "skeleton=auto"]
    experiment = compose(["experiment=mozerov2006_fig2", *options])
    clips = experiment.data.request(PERFORMANCES, experiment.skeleton, 1, 1).make()
    for k in range(3):
        np.testing.assert_allclose(clips.motion(k), person * (1.0 + 0.02 * k), atol=0.01)
    assert all("stands along z, which is used" in row["reason"] for row in clips.report)
