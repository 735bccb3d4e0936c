"""The public recordings, where they are: every clip with a verdict, nobody on both sides of a fold."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from pipeline.__main__ import compose
from pipeline.cli.figures import Outcome
from pipeline.stages import dataset, ingest, model
from pipeline.storage import tables
from pipeline.storage.store import Store
from pipeline.studies.options import RecordedData

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
    options = compose(["experiment=zhang2007_fig2", "data=cmu", f"data.mirror={mocap_mirror}"]).data
    assert isinstance(options, RecordedData)
    assert ["cmu12", "cmu37"] in options.same_person
    rows = tables.read_rows(ROOT / options.table)
    few = [row for row in rows if row["subject"] in ("cmu12", "cmu37", "cmu07", "cmu08")]
    options.table = str(tmp_path / "sources.csv")
    tables.write(Path(options.table), {name: [row[name] for row in few] for name in few[0]}, sort_by=["path"])
    config = compose(["experiment=zhang2007_fig2", "dataset.walks=all"])
    store = Store(tmp_path)
    walks = ingest.run(options, config.skeleton, 2007, 2, store)
    samples = dataset.run(config.dataset, walks, 2, store)
    learnt = model.run(config.model, samples, 2, store)
    person, clip = samples.arrays["person"], samples.arrays["clip"]
    subjects = {name: name.split("_")[0] for name in map(str, clip)}
    assert {"12", "37"} <= set(subjects.values())
    assert {str(p) for p, c in zip(person, clip, strict=True) if subjects[str(c)] in ("12", "37")} == {
        "cmu12"
    }
    for r, who in enumerate(person):
        others = learnt.arrays["samples"][person != who]
        np.testing.assert_allclose(learnt.arrays["fold_mean"][r], others.mean(axis=0), atol=1e-9)
