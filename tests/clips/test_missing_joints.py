"""Tests of missing joints: they are estimated from other joints, marked as estimates, and have no errors."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from pipeline.clips import missing_joints
from pipeline.clips.kinds import WALKS
from pipeline.clips.options import Missing, Skeleton, Steady
from pipeline.clips.usable import RawClip, report_row
from pipeline.clips.walks import REPORT_COLUMNS, steady_walk
from pipeline.core import walking
from pipeline.formats.points import trc
from pipeline.ingestion.data import FolderData
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.model import EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierDataset
from pipeline.studies.study import Grid, SweepInputs
from pipeline.studies.walks.known_view import KnownView
from pipeline.synthetic import walkers

HEAD, ARM = (0,), (2, 3, 4)
HZ = 40.0


@pytest.fixture(scope="module")
def people() -> np.ndarray:
    """Walks (4, T, 15, 3) of people who are not in the model of missing joints."""
    output = walkers.walking_population(
        np.random.default_rng(5), male=2, female=2, duration_s=3.0, frame_rate_hz=HZ
    )
    return np.asarray(output.positions_mm)


def hidden(walk: np.ndarray, joints: tuple[int, ...]) -> np.ndarray:
    walk = walk.copy()
    walk[:, list(joints)] = np.nan
    return walk


@pytest.mark.parametrize(("joints", "mm"), [(HEAD, 60.0), (ARM, 80.0)])
def test_a_joint_is_estimated_from_the_others(people: np.ndarray, joints: tuple[int, ...], mm: float) -> None:
    for walk in people:
        row = report_row(REPORT_COLUMNS, clip="a", person="a", source="test")
        whole = steady_walk(RawClip(row, walk, HZ), Steady())
        output = steady_walk(RawClip(row, hidden(walk, joints), HZ), Steady())
        assert whole.positions is not None
        assert output.positions is not None
        assert output.row["missing_joints"] == ", ".join(WALKER15.joints[j] for j in joints)
        off = np.linalg.norm((output.positions - whole.positions)[:, list(joints)], axis=-1)
        assert np.sqrt((off**2).mean()) < mm
        observed = [j for j in range(15) if j not in joints]
        # The frequency, and with it the heading, is that of the joints that were seen.
        np.testing.assert_allclose(output.positions[:, observed], whole.positions[:, observed], atol=0.01)


def test_what_a_missing_joint_holds_is_not_read(people: np.ndarray) -> None:
    level = walking.treadmill_equivalent(people[0], HZ, locomotion="treadmill")
    missing = np.isin(np.arange(15), ARM)
    first, _ = missing_joints.complete(level, missing, HZ)
    other, _ = missing_joints.complete(hidden(level, ARM), missing, HZ)
    np.testing.assert_array_equal(first, other)
    same, _ = missing_joints.complete(level, np.zeros(15, dtype=bool), HZ)
    assert same is level


def test_legs_are_never_estimated(people: np.ndarray) -> None:
    row = report_row(REPORT_COLUMNS, clip="a", person="a", source="test")
    refused = steady_walk(RawClip(row, hidden(people[0], (11, 14)), HZ), Steady())
    assert refused.positions is None
    assert refused.row["code"] == "legs_unseen"


@pytest.fixture(scope="module")
def folder(people: np.ndarray, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the walks of four people, one without a head."""
    path = tmp_path_factory.mktemp("walks")
    for k, walk in enumerate(people):
        joints = [j for j in range(15) if j or k]
        trc.write(path / f"p{k}_1.trc", [WALKER15.joints[j] for j in joints], walk[:, joints], HZ)
    return path


@pytest.mark.parametrize("missing", Missing)
def test_estimated_and_dropped_joints_have_no_errors(folder: Path, missing: Missing) -> None:
    data = FolderData(name="folder", path=str(folder))
    clips = data.request(WALKS, Skeleton(mapping="auto", missing=missing), 1, 1).make()
    assert clips.estimated.sum() == 1
    assert clips.dropped.tolist() == [missing is Missing.drop] + [False] * 14
    samples = FourierDataset().build(clips, workers=1)
    model = EigenwalkersModel(components=2).learn(samples, workers=1)
    sweep = KnownView(
        view_angle_deg=Grid(start=0, stop=90, step=90),
        sigma2_mm2=Grid(start=1, stop=2, step=1),
        methods=["map"],
    )
    inputs = SweepInputs(clips, samples, model, EigenwalkersModel(), 1, 1)
    result = sweep.measure(inputs)
    joints = result.joints[result.joints["method"] == "map"].set_index("joint")["absolute_error_mm2"]
    assert joints["head"].isna().tolist() == (
        [True] * 4 if missing is Missing.drop else [True, False, False, False]
    )
    assert joints.drop("head").notna().all()
    if missing is Missing.drop:  # no sample comes from it
        assert not samples.coefficients[:, :, 0].any()
        np.testing.assert_allclose(result.missing[..., 0], 0.0, atol=1e-9)


@pytest.mark.skipif(not os.environ.get("MOCAP_MIRROR"), reason="needs MOCAP_MIRROR")
@pytest.mark.parametrize(("joints", "mm"), [(HEAD, 75.0), (ARM, 70.0)])
def test_on_recorded_people(joints: tuple[int, ...], mm: float) -> None:
    from pipeline.cli.compose import compose

    experiment = compose(["experiment=zhang2007_fig5", "data=optical"])
    clips = experiment.data.request(WALKS, experiment.skeleton, 1, 1).make()
    samples = experiment.dataset.build(clips, workers=1)
    missing = np.isin(np.arange(15), joints)
    power = []
    for truth in samples.coefficients:
        result = missing_joints.conditional_mean(missing_joints.population(), truth, missing)
        distance = (result - truth)[:, list(joints)]
        power.append((distance[0] ** 2).sum(axis=-1) + 0.5 * (distance[1:] ** 2).sum(axis=(0, 2)))
    assert np.sqrt(np.mean(power)) < mm
