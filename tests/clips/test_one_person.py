"""Test that copies of a recording under other names cause a remark and prevent verdicts."""

from __future__ import annotations

import functools
import os
from pathlib import Path

import numpy as np
import pytest

from pipeline import fetch, mappings, papers
from pipeline.clips import one_person
from pipeline.clips.kinds import WALKS
from pipeline.clips.options import Locomotion, Skeleton, Steady
from pipeline.core.likeness import Likeness, likeness
from pipeline.formats.points import trc
from pipeline.ingestion.corpus import Listing, listed_clips
from pipeline.ingestion.data import FolderData
from pipeline.ingestion.joints import read_clip
from pipeline.skeleton import WALKER15
from pipeline.stages.ingest import report_table
from pipeline.studies.ledger import judge
from pipeline.studies.registry import all_measures
from pipeline.synthetic.walkers import walking_population
from tests.studies.test_ledger import errors_of

MEASURES = all_measures()

HZ = 60.0
ROOT = Path(__file__).parents[2]
MIRROR = os.environ.get("MOCAP_MIRROR", "")


@functools.cache
def people() -> np.ndarray:
    return walking_population(
        np.random.default_rng(2), male=5, female=5, duration_s=6.0, frame_rate_hz=HZ
    ).positions_mm


def disguised(walk: np.ndarray) -> dict[str, tuple[np.ndarray, float]]:
    noise = np.random.default_rng(8).normal(0.0, 5.0, walk.shape)
    return {
        "cut": (walk[100:], HZ),
        "noisy": (walk + noise, HZ),
        "resampled": (walk[::2], HZ / 2),
        "mirrored": (walk[:, WALKER15.mirror] * [-1.0, 1.0, 1.0], HZ),
        "shifted": (np.roll(walk, 70, axis=0)[70:], HZ),
        "larger": (1.15 * walk[:300] + noise[:300], HZ),
    }


def test_disguised_copies_bear_a_remark_that_names_the_other_and_people_bear_none(tmp_path: Path) -> None:
    for n, walk in enumerate(people()):
        trc.write(tmp_path / f"p{n}_1.trc", WALKER15.joints, walk, HZ)
    for name, (walk, rate) in disguised(people()[0]).items():
        trc.write(tmp_path / f"{name}_1.trc", WALKER15.joints, walk, rate)
    trc.write(tmp_path / "p1_2.trc", WALKER15.joints, people()[1][120:], HZ)  # the same person's
    data = FolderData(name="folder", path=str(tmp_path), steady=Steady(locomotion=Locomotion.treadmill))
    walks = data.request(WALKS, Skeleton(), 1, 1).make()
    result = {row["clip"].partition("_1.trc")[0]: row["reason"] for row in walks.report}
    remarked = {name for name, reason in result.items() if one_person.REMARK in reason}
    assert remarked == {"p0", *disguised(people()[0])}
    assert all(row["verdict"] == "kept" for row in walks.report)
    assert "may be the person of p0 in p0_1.trc: limbs differ by 0." in result["mirrored"]

    tables = errors_of(20, 0.3 + 0.05 * np.sin(np.arange(20)), -0.2)
    claim = papers.claim("zhang2007_map_thirty_percent")
    outcomes = {}
    for named in ("as they are", "with copies"):
        rows = [row for row in walks.report if named == "with copies" or row["person"] in ("p1", "p2")]
        ingest = report_table(rows, walks.report_columns)
        many = {name: np.tile(column, 10) for name, column in ingest.items()}
        many["person"] = np.array([f"{person} {n}" for n, person in enumerate(many["person"])])
        output = {"zhang2007_fig5": tables["table"], "zhang2007_fig5/table_people": tables["table_people"]}
        (verdict,) = judge(
            [claim], output | {"zhang2007_fig5/table_ingest": many}, "folder", measures=MEASURES
        )
        outcomes[named] = (str(verdict.agreement), verdict.why)
    assert outcomes["as they are"][0] == "agrees"
    described, why = outcomes["with copies"]
    assert described == "untestable"
    assert "who is who is not known: " in why
    assert "_1.trc may be the person of" in why


def test_people_on_one_skeleton_cannot_be_told_apart() -> None:
    walk, other = people()[:2]
    valid = np.ones(walk.shape[:2], dtype=bool)
    first, second = likeness(walk, valid, HZ), likeness(other, valid, HZ)
    assert one_person.remarks(["a", "b"], ["x", "y"], [first, second]) == ["", ""]
    same = Likeness(first.limbs_mm, second.postures_mm)
    assert one_person.remarks(["a", "b"], ["x", "y"], [first, same]) == [
        "may be the person of b in y: limbs differ by 0.00 %",
        "may be the person of a in x: limbs differ by 0.00 %",
    ]
    assert one_person.remarks(["a", "a"], ["x", "y"], [first, same]) == ["", ""]
    assert one_person.remarks([], [], []) == []


@pytest.mark.skipif(not Path(MIRROR, "cmu").is_dir() or not MIRROR, reason="needs MOCAP_MIRROR")
@pytest.mark.parametrize("source", ["cmu", "biomechzoo", "hdm05"])
def test_no_recording_of_the_public_ones_is_taken_for_another_persons(source: str, tmp_path: Path) -> None:
    table = ROOT / "data" / "sources.csv"
    actions = {
        row["action"].partition(":")[0] for row in fetch.read_sources(table) if row["source"] == source
    } - {"skeleton"}
    listing = Listing(table, tmp_path, [Path(MIRROR)], mappings.shipped(), [["cmu12", "cmu37"]])
    clips = [clip for action in sorted(actions) for clip in listed_clips(listing, [source], action)[0]]
    kinds = []
    for clip in clips:
        motion, positions, valid = read_clip(clip)
        kinds.append(likeness(positions, valid, motion.frame_rate_hz))
    output = one_person.remarks([clip.person for clip in clips], [clip.name for clip in clips], kinds)
    assert len(output) > 10
    assert not any(output)
    other = [f"{clip.person} again" if n % 2 else clip.person for n, clip in enumerate(clips)]
    if source != "biomechzoo":  # two trials of a person, whose limbs a skeleton keeps
        assert any(one_person.remarks(other, [clip.name for clip in clips], kinds))
