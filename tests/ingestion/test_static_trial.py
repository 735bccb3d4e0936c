"""Tests of walks with marker clusters, which get knees and ankles from a standing trial."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline import mappings
from pipeline.cli.inspect import inspect
from pipeline.clips.kinds import WALKS
from pipeline.clips.options import Skeleton
from pipeline.formats.points import trc
from pipeline.ingestion import joints, nearest_joints
from pipeline.ingestion.corpus import static_trials
from pipeline.ingestion.data import FolderData
from pipeline.skeleton import WALKER15
from pipeline.skeleton.mapped_joints import map_joints
from pipeline.skeleton.recorded import MotionCapture
from tests.clustered_walk import ANATOMICAL, HZ, trials, without
from tests.rejects import rejects

KNOWN = list(mappings.shipped().values())
LEGS = [WALKER15.index(f"{side}_{part}") for side in ("left", "right") for part in ("hip", "knee", "ankle")]


def recorded(points: dict[str, np.ndarray]) -> MotionCapture:
    positions = np.stack(list(points.values()), axis=1)
    valid = np.isfinite(positions).all(axis=-1)
    return MotionCapture(tuple(points), positions, valid, HZ, "mm")


def save(path: Path, points: dict[str, np.ndarray]) -> Path:
    path.parent.mkdir(exist_ok=True)
    trc.write(path, list(points), np.stack(list(points.values()), axis=1), HZ)
    return path


def mapped(motion: MotionCapture) -> np.ndarray:
    return map_joints(motion, mappings.shipped()["gait2392"])[0]


@pytest.mark.parametrize(("noise_mm", "within_mm"), [(0.0, 1e-6), (0.3, 1.0)])
def test_knees_and_ankles_are_where_the_missing_markers_would_have_shown_them(
    noise_mm: float, within_mm: float
) -> None:
    """Knees and ankles from the standing trial agree with those from the walk's own anatomical markers."""
    truth, _ = trials()
    walk, static = trials(noise_mm=noise_mm)
    motion = recorded(without(walk, ANATOMICAL))
    assert not mappings.suggest(motion, KNOWN).usable
    posture = recorded({name: np.median(position, axis=0)[None] for name, position in static.items()})
    carried = joints.carry(motion, posture, "static.trc", KNOWN)
    off = np.linalg.norm(mapped(carried) - mapped(recorded(truth)), axis=-1)[:, LEGS]
    assert np.sqrt(np.mean(off**2)) <= within_mm
    (note,) = carried.notes
    assert "R.Knee.Lat, R.Knee.Med by R.Thigh.Upper, R.Thigh.Front, R.Thigh.Rear" in note
    assert "L.Ankle.Lat, L.Ankle.Med by L.Shank.Upper, L.Shank.Front, L.Shank.Rear" in note
    assert note.count(f"(residual {noise_mm} mm)") == 4
    assert mappings.suggest(carried, KNOWN).missing == ()


def test_a_marker_that_is_lost_part_of_the_time_takes_no_part_then() -> None:
    """A cluster of four markers may lose one marker in some frames; with two markers left, the joint is missing."""
    walk, static = trials()
    fourth = {side: f"{side}.Thigh.Back" for side in "LR"}
    for points in (walk, static):
        for side, name in fourth.items():
            upper, knee = points[f"{side}.Thigh.Upper"], points[f"{side}.Knee.Lat"]
            points[name] = 0.5 * (upper + points[f"{side}.Thigh.Rear"]) + 0.3 * (knee - upper)
    truth = mapped(recorded(walk))
    walk["R.Thigh.Upper"][10:20] = np.nan
    walk["L.Shank.Front"][30:40] = np.nan
    posture = recorded({name: position[:1] for name, position in static.items()})
    carried = joints.carry(recorded(without(walk, ANATOMICAL)), posture, "static.trc", KNOWN)
    off = np.linalg.norm(mapped(carried) - truth, axis=-1)[:, LEGS]
    lost = np.isnan(off)
    assert np.flatnonzero(lost.any(axis=1)).tolist() == list(range(30, 40))
    assert np.nanmax(off) < 1e-6


def test_a_marker_that_was_stuck_elsewhere_leaves_the_cluster() -> None:
    walk, static = trials()
    posture = recorded(
        {name: position[:1] + (40.0 if name == "R.Thigh.Front" else 0.0) for name, position in static.items()}
    )
    with_three = without(walk, ANATOMICAL)
    carried = joints.carry(recorded(with_three), posture, "static.trc", KNOWN)
    assert not {"R.Knee.Lat", "R.Knee.Med"} & set(carried.names)
    assert {"R.Ankle.Lat", "L.Knee.Lat"} <= set(carried.names)


def test_nothing_is_carried_by_what_is_no_part_of_its_segment() -> None:
    """Markers of other segments, such as elbows, toes and pelvis, are not transferred from the standing trial."""
    walk, static = trials()
    gone = ["R.Elbow", "L.Elbow", "R.Wrist.Lat", "Sternum", "R.Toe.Tip", "L.Toe.Tip", "R.ASIS"]
    posture = recorded({name: position[:1] for name, position in static.items()})
    carried = joints.carry(recorded(without(walk, [*ANATOMICAL, *gone])), posture, "static.trc", KNOWN)
    assert not set(gone) & set(carried.names)
    # Three markers of a side of the pelvis are rigid, too, but not near a segment of the leg.
    for points in (walk, static):
        for side, sign in (("R", 1.0), ("L", -1.0)):
            across = (points["R.ASIS"] - points["L.ASIS"]) * 0.2 * sign
            points |= {f"{side}.PSIS": points["V.Sacral"] + across}
            points |= {f"{side}.Crest": 0.5 * (points[f"{side}.PSIS"] + points[f"{side}.ASIS"]) + across}
    gone = [*ANATOMICAL, *(name for name in walk if "Thigh" in name)]
    posture = recorded({name: position[:1] for name, position in static.items()})
    carried = joints.carry(recorded(without(walk, gone)), posture, "static.trc", KNOWN)
    assert not [name for name in carried.names if "Knee" in name or "Thigh" in name]


def test_a_static_trial_that_is_none_is_refused(tmp_path: Path) -> None:
    walk, static = trials()
    clustered = without(walk, ANATOMICAL)
    with rejects("not_still"):
        joints.standing(save(tmp_path / "static.trc", walk))
    posture = recorded({name: position[:1] for name, position in static.items()})
    with rejects("no_legs"):
        joints.carry(recorded(clustered), recorded(without(clustered, [])), "static.trc", KNOWN)
    unclustered = {
        name: position for name, position in clustered.items() if "Thigh" not in name and "Shank" not in name
    }
    with rejects("no_cluster"):
        joints.carry(recorded(unclustered), posture, "static.trc", KNOWN)


def test_statics_are_told_by_name_by_folder_or_tried() -> None:
    files = {
        Path("lab/anna_walk1.c3d"): "anna", Path("lab/anna_Static01.c3d"): "anna", Path("lab/anna_2.c3d"): "anna",
        Path("lab/ben_1.c3d"): "ben", Path("lab/ben_2.c3d"): "ben", Path("lab/local_1.c3d"): "local",
        Path("eve/walk.c3d"): "walk", Path("eve/static.c3d"): "static",
    }  # fmt: skip
    result = {path.name: [other.name for other in others] for path, others in static_trials(files).items()}
    assert result["anna_walk1.c3d"] == result["anna_2.c3d"] == ["anna_Static01.c3d"]
    assert result["ben_1.c3d"] == ["ben_2.c3d"]
    assert result["local_1.c3d"] == []
    assert result["walk.c3d"] == ["static.c3d"]


def test_a_folder_of_one_static_and_two_walks_a_person_loads(tmp_path: Path) -> None:
    """A static trial is recognized by its name, by its lack of motion, or as the only static trial in its folder."""
    statics = {"anna": "anna_cal.trc", "ben": "ben_3.trc", "carl": "static.trc"}
    for seed, (who, name) in enumerate(statics.items()):
        walk, static = trials(seed, noise_mm=0.4)
        for n in (1, 2):
            save(
                tmp_path / who / f"{who}_{n}.trc",
                {k: v[20 * n :] for k, v in without(walk, ANATOMICAL).items()},
            )
        save(tmp_path / who / name, static)
    request = FolderData(name="folder", path=str(tmp_path)).request(WALKS, Skeleton(mapping="auto"), 1, 1)
    walks = request.make()
    assert list(walks.person) == ["anna", "anna", "ben", "ben", "carl", "carl"]
    retained = [row for row in walks.report if row["verdict"] == "kept"]
    for row, static in zip(retained, np.repeat(list(statics.values()), 2), strict=True):
        assert f"Added from the static trial {static}" in row["reason"]
        assert not row["missing_joints"]
    refused = {row["clip"] for row in walks.report} - {row["clip"] for row in retained}
    assert refused == {f"{who}/{name}" for who, name in statics.items()}
    again = request.options["clips"][0]["statics"]
    save(tmp_path / "anna" / "anna_cal.trc", {k: v + 1.0 for k, v in trials(0)[1].items()})
    changed = FolderData(name="folder", path=str(tmp_path)).request(WALKS, Skeleton(mapping="auto"), 1, 1)
    assert changed.options["clips"][0]["statics"] != again


def test_inspect_takes_a_static_trial_and_guesses_no_joint_from_clusters(tmp_path: Path) -> None:
    walk, static = trials(noise_mm=0.4)
    clustered = without(walk, ANATOMICAL)
    alone = save(tmp_path / "walk" / "anna_1.trc", clustered)
    other = save(tmp_path / "other" / "standing.trc", static)
    (result,) = inspect([str(alone), f"write={tmp_path / 'my_lab.yaml'}"])
    assert (result.mapping, result.strides) == ("", 0.0)
    described = "\n".join(result.lines)
    assert "mark no joint: R.Thigh.Upper, R.Thigh.Front, R.Thigh.Rear; R.Shank.Upper" in described
    assert "static=" in described
    guessed = [point for rule in mappings.load(tmp_path / "my_lab.yaml").joints.values() for point in rule]
    assert not [point for point in guessed if "Thigh" in point or "Shank" in point]
    (result,) = inspect([str(alone), f"static={other}"])
    assert result.mapping == "gait2392"
    assert result.strides > 3
    assert any("15 of 15 joints" in line for line in result.lines)
    (result,) = inspect([str(alone), f"static={alone}"])
    assert "does not stand still" in result.lines[-1]
    save(tmp_path / "walk" / "anna_static.trc", static)
    (result,) = inspect([str(alone)])
    assert result.strides > 3
    moving, still = inspect([str(tmp_path / "walk")])
    assert any("15 of 15 joints" in line for line in moving.lines)
    assert any("the person does not move" in line for line in still.lines)


@pytest.mark.parametrize(
    "names",
    [
        ("RTH1", "RTH2", "RTH3"),
        ("R.Thigh.Upper", "R.Thigh.Front", "R.Thigh.Rear"),
        ("LSK_a", "LSK_b", "LSK_c"),
    ],
)
def test_points_of_a_cluster_are_known_by_moving_together(names: tuple[str, ...]) -> None:
    walk, _ = trials()
    owner = [f"{names[0][0]}.Thigh.{end}" for end in ("Upper", "Front", "Rear")]
    points = dict(zip(names, (walk[name] for name in owner), strict=True))
    motion = recorded({"V.Sacral": walk["V.Sacral"], **points})
    assert joints.technical_clusters(motion) == [[1, 2, 3]]
    loose = recorded({**points, names[0]: walk["R.Heel"]})
    assert joints.technical_clusters(loose) == []


@pytest.mark.parametrize(
    "names", [("LKNE1", "LKNE2", "LKNE3"), ("LeftLeg", "LeftLegTwist1", "LeftLegTwist2")]
)
def test_points_at_a_joint_are_no_technical_cluster(names: tuple[str, ...]) -> None:
    walk, _ = trials()
    ends = (walk[f"R.Thigh.{end}"] for end in ("Upper", "Front", "Rear"))
    assert joints.technical_clusters(recorded(dict(zip(names, ends, strict=True)))) == []


def test_nobody_is_proposed_worse_than_before_where_there_is_no_cluster() -> None:
    walk, _ = trials()
    proposal = nearest_joints.propose(recorded(walk), "my_lab")
    assert proposal.joints["right_knee"] in ({"R.Knee.Lat": 0.5, "R.Knee.Med": 0.5}, {"R.Knee.Lat": 1.0})
