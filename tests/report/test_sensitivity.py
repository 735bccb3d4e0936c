"""The page's section on what the conclusions depend on: from the table, for its own data set and scale."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

import pytest

from pipeline.report.published import Published
from pipeline.report.sensitivity import moved_by_switches
from pipeline.storage import tables

ROW: dict[str, Any] = {
    "data": "synthetic", "group": "walks", "scale": "full", "commit": "a" * 12, "claim": "zhang2007_map_thirty_percent",
    "switch": "divisor R", "value": 12.5, "value_low": 10.0, "value_high": 15.0, "verdict": "differs",
    "value_as_it_is": 28.0, "verdict_as_it_is": "agrees", "outside_the_interval": True, "verdict_moves": True,
    "common": "scale.populations=0",
}  # fmt: skip


def shown(folder: Path, *changes: dict[str, Any], data: str = "synthetic", scale: str = "full") -> Any:
    """What is shown of rows that differ from `ROW`."""
    rows = [{**ROW, **change} for change in changes]
    tables.write(folder / "moved.csv", {name: [row[name] for row in rows] for name in ROW})
    return moved_by_switches(Published(data, scale, {}, {}), folder / "moved.csv")


def test_switches_are_counted_and_the_strongest_comes_first(tmp_path: Path) -> None:
    found = shown(
        tmp_path,
        {"switch": "origin floor", "verdict_moves": False},
        {},
        {"claim": "zhang2007_view_angle_mean", "outside_the_interval": False},
    )
    assert [(one["name"], one["verdicts"], one["values"]) for one in found["switches"]] == [
        ("divisor R", 2, 1), ("origin floor", 0, 1)
    ]  # fmt: skip
    assert found["switches"][0]["options"] == "model.divisor=R"
    assert found["commits"] == ["a" * 12]
    assert found["common"] == [("walks", "scale.populations=0")]


def test_a_claim_stands_once_with_every_switch_that_moves_it(tmp_path: Path) -> None:
    found = shown(
        tmp_path, {}, {"switch": "origin floor", "value": 20.0}, {"switch": "x", "verdict_moves": False}
    )
    [claim] = found["claims"]
    assert claim["with"] == [("divisor R", 12.5, "differs"), ("origin floor", 20.0, "differs")]
    assert (claim["value"], claim["verdict"], claim["figure"]) == (28.0, "agrees", "zhang2007_fig5")


def test_the_downloaded_table_has_the_rows_that_are_shown(tmp_path: Path) -> None:
    found = shown(tmp_path, {"verdict": "holds, also of the null"}, {"data": "optical"}, {"scale": "smoke"})
    [row] = csv.DictReader(io.StringIO(found["text"]))
    assert row["verdict"] == "holds, also of the null"
    assert found["earlier"], "words of before the two answers are said to be so"
    assert not shown(tmp_path, {})["earlier"]
    assert (found["rows"], found["columns"]) == (1, len(row))


def test_a_claim_that_is_no_longer_there_is_shown_by_its_name(tmp_path: Path) -> None:
    assert shown(tmp_path, {"claim": "of_old"})["claims"][0]["quote"] == "of_old"


@pytest.mark.parametrize("other", [{"data": "cmu"}, {"scale": "smoke"}])
def test_other_data_sets_and_scales_show_nothing(tmp_path: Path, other: dict[str, str]) -> None:
    assert shown(tmp_path, {}, **other) is None
