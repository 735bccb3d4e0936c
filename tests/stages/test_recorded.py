"""Tests of the public recordings, if they are present: each clip has a verdict, and folds separate people."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli.compose import compose
from pipeline.cli.summary import Outcome
from pipeline.ingestion.data import RecordedData
from pipeline.stages import chain, ingest
from pipeline.storage import tables
from pipeline.storage.store import Store

ROOT = Path(__file__).resolve().parent.parent.parent


def test_the_optical_recordings_make_a_figure_and_every_clip_has_a_verdict(
    figure: Callable[..., Outcome], mocap_mirror: Path, tmp_path: Path
) -> None:
    outcome = figure(tmp_path, "zhang2007_fig5", "data=optical", f"data.mirror={mocap_mirror}")
    report = tables.read_rows(outcome.folder / "table_ingest.csv")
    options = compose(["experiment=zhang2007_fig5", "data=optical"]).data
    listed = [
        row for row in tables.read_rows(ROOT / options.table)
        if row["source"] in options.sources and row["action"] == "walk" and row["skeleton"] in options.skeletons
    ]  # fmt: skip
    people = {row["person"] for row in report}
    assert len(people) == 12
    assert {row["clip"] for row in report} == {row["trial"] for row in listed if row["subject"] in people}
    for row in report:
        assert row["verdict"] in ("kept", "refused")
        assert row["verdict"] == "kept" or row["reason"], row["clip"]
        assert str(mocap_mirror) not in row["reason"]
    manifest = (outcome.folder / "manifest.json").read_text(encoding="utf-8")
    assert str(mocap_mirror) not in manifest
    inputs = json.loads(manifest)["inputs"]
    assert set(inputs) == {row["clip"] for row in report}
    for row in listed:
        if row["trial"] in inputs and row["path"].endswith(
            ".c3d"
        ):  # an AMC is hashed together with its skeleton
            assert inputs[row["trial"]] == row["sha256"]


def test_the_same_man_under_two_numbers_never_straddles_a_fold(mocap_mirror: Path, tmp_path: Path) -> None:
    experiment = compose(
        ["experiment=zhang2007_fig2", "data=cmu", "dataset.walks=all", f"data.mirror={mocap_mirror}"]
    )
    data = experiment.data
    assert isinstance(data, RecordedData)
    assert ["cmu12", "cmu37"] in data.same_person
    rows = tables.read_rows(ROOT / data.table)
    few = [row for row in rows if row["subject"] in ("cmu12", "cmu37", "cmu07", "cmu08")]
    data.table = str(tmp_path / "sources.csv")
    tables.write(Path(data.table), {name: [row[name] for row in few] for name in few[0]}, sort_by=["path"])
    store = Store(tmp_path)
    _, samples, learnt = (retained.value for retained in chain.run(experiment, store, through="model"))
    subject = [str(clip).split("_")[0] for clip in samples.clip]
    assert {"12", "37"} <= set(subject)
    one_man = {str(p) for p, s in zip(samples.person, subject, strict=True) if s in ("12", "37")}
    assert one_man == {"cmu12"}
    for r, who in enumerate(samples.person):
        others = learnt.samples[samples.person != who]
        np.testing.assert_allclose(learnt.folds.mean[r], others.mean(axis=0), atol=1e-9)


@pytest.mark.parametrize(("data", "count", "people"), [("hdm05", 32, 5), ("hdm05_squat", 52, 5)])
def test_the_recorded_actions_are_read_whole(
    data: str, count: int, people: int, mocap_mirror: Path, tmp_path: Path
) -> None:
    experiment = compose(["experiment=mozerov2006_fig3", f"data={data}", f"data.mirror={mocap_mirror}"])
    output = ingest.run(experiment, Store(tmp_path)).value
    assert len(output) == count
    assert len(set(output.person)) == people
    assert set(output.frame_rate_hz) == {120.0}
