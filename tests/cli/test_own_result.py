"""Tests of the first line in the summary for a user's own recordings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from pipeline.cli.own_result import own_result
from pipeline.formats.points import trc
from pipeline.skeleton import WALKER15
from pipeline.storage import tables
from pipeline.synthetic import walkers


def test_errors_of_each_method_and_people_who_were_kept(tmp_path: Path) -> None:
    tables.write(tmp_path / "table.csv", {
        "method": ["least_squares", "map", "map", "map_1"], "rms_error_mm": [40.0, 30.0, 34.0, 1.0],
    })  # fmt: skip
    clips = {"person": ["a", "a", "b", "c"], "verdict": ["kept", "kept", "kept", "refused"]}
    tables.write(tmp_path / "table_ingest.csv", clips)
    described = own_result(tmp_path).partition(": ")[2]
    assert described == (
        "error of depth, all views: MAP 32 mm, least squares 40 mm; 2 people"
        " (few to learn from: model.prior=shipped adds a model of other people)"
    )
    many = {"person": [f"p{k}" for k in range(20)], "verdict": ["kept"] * 20}
    tables.write(tmp_path / "table_ingest.csv", many)
    assert own_result(tmp_path).endswith("; 20 people")
    (tmp_path / "table.csv").write_text("component\n1\n", encoding="utf-8")
    assert own_result(tmp_path) == ""


def test_the_summary_begins_with_it(say: Callable, tmp_path: Path) -> None:
    output = walkers.walking_population(
        np.random.default_rng(8), male=2, female=2, duration_s=3.0, frame_rate_hz=40.0
    )
    for k, walk in enumerate(output.positions_mm):
        trc.write(tmp_path / f"p{k}.trc", WALKER15.joints, walk, 40.0)
    arguments = "experiment=zhang2007_fig5", "scale=smoke", "figure.picture=false", "figure.recording=false"
    message = say(*arguments, "data=folder", f"data.path={tmp_path}", f"results={tmp_path / 'results'}")
    first = next(line for line in message.out.splitlines() if "zhang2007_fig5: error" in line)
    assert message.out.index(first) < message.out.index("Claims")
    assert "; 4 people (few to learn from: model.prior=shipped " in first
    assert "average walker " in first
