"""Tests of the tables on changed options: new rows replace old rows, and uncommitted changes are rejected."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pipeline import papers
from pipeline.papers import Estimate
from pipeline.storage import tables
from pipeline.storage.sealed_folders import write_manifest
from pipeline.studies import interventions
from pipeline.studies.interventions import Numbers
from tests.rejects import rejects


def numbers(switch: str, with_it: float) -> Numbers:
    ends = Estimate(with_it, with_it - 1.0, with_it + 2.0)
    return Numbers(switch, (), ("data.walkers=3",), (), "full", {"x": Estimate(1.0)}, {"x": ends})


def test_numbers_of_a_switch_replace_its_old_ones_and_no_others(tmp_path: Path) -> None:
    path = tmp_path / papers.INTERVENTIONS
    interventions.keep_numbers(path, [numbers("few", 2.0), numbers("many", 3.0)], "synthetic", "walks")
    interventions.keep_numbers(path, [numbers("few", 4.0)], "synthetic", "walks")
    interventions.keep_numbers(path, [numbers("few", 5.0)], "optical", "walks")
    unquoted = Numbers("unquoted", (), (), (), "full", {}, {})
    interventions.keep_numbers(path, [unquoted], "optical", "walks")
    runs = papers.read_runs(path)
    result = {key: (run.with_it["x"].value, run.without["x"].value) for key, run in runs.items()}
    assert result == {
        ("synthetic", "walks", "few"): (4.0, 1.0),
        ("synthetic", "walks", "many"): (3.0, 1.0),
        ("optical", "walks", "few"): (5.0, 1.0),
    }
    few = runs["synthetic", "walks", "few"]
    assert (few.with_it["x"], few.without["x"].known) == (Estimate(4.0, 3.0, 6.0), False)
    explained = papers.Explanation(
        support=papers.Support.TESTED, text="{with:.0f}, not {without:.0f}", run=few
    )
    assert explained.in_words("x", 0.0, None).startswith("4 [3, 6], not 1 ")
    assert runs["optical", "walks", "few"].overrides == ("data.walkers=3",)


def test_what_no_switch_moves_is_left_out_of_the_table(tmp_path: Path) -> None:
    row = {"claim": "c", "switch": "few", "value": 1.0, "outside_the_interval": False, "answer_moves": False}
    rows = [
        row,
        {**row, "claim": "d", "answer_moves": True},
        {**row, "claim": "e", "outside_the_interval": True},
    ]
    interventions.keep_table(tmp_path / "kept.csv", rows, [numbers("few", 2.0)], "synthetic", "walks")
    recording = tables.read(tmp_path / "kept.csv")
    assert recording["claim"].tolist() == ["d", "e"]
    interventions.keep_table(tmp_path / "kept.csv", [row], [numbers("few", 2.0)], "synthetic", "walks")
    assert not (tmp_path / "kept.csv").exists(), "what moved once moves no more"
    many = {**row, "claim": "f", "switch": "many", "answer_moves": True}
    interventions.keep_table(tmp_path / "kept.csv", [many], [numbers("many", 2.0)], "synthetic", "walks")
    interventions.keep_table(tmp_path / "kept.csv", [row], [numbers("few", 2.0)], "synthetic", "walks")
    assert tables.read(tmp_path / "kept.csv")["claim"].tolist() == ["f"]


def test_what_was_run_is_kept_with_its_options_also_if_nothing_moves(tmp_path: Path) -> None:
    row = {"claim": "c", "switch": "few", "value": 1.0, "outside_the_interval": True, "answer_moves": False}
    interventions.keep_runs(tmp_path / "runs.csv", [], [numbers("none", 2.0)], "synthetic", "walks")
    run = dataclasses.replace(numbers("few", 2.0), common=("scale.trials=40",), figures=("a", "b"))
    runs = [run, numbers("many", 3.0)]
    interventions.keep_runs(tmp_path / "runs.csv", [row, {**row, "claim": "d"}], runs, "synthetic", "walks")
    few, many, none = tables.read_rows(tmp_path / "runs.csv")
    assert (none["switch"], none["common"], none["claims"]) == ("none", "", "0")
    assert (few["switch"], few["overrides"], few["common"]) == ("few", "data.walkers=3", "scale.trials=40")
    assert (few["figures"], few["claims"], few["outside_the_interval"]) == ("a b", "2", "2")
    assert (many["switch"], many["claims"], many["answers_moved"]) == ("many", "0", "0")


@pytest.mark.parametrize("dirty", [False, True])
def test_figures_of_a_changed_checkout_are_not_kept(tmp_path: Path, dirty: bool) -> None:
    figure = tmp_path / "few" / "zhang2007_fig5"
    figure.mkdir(parents=True)
    write_manifest(figure, {"scale": "full", "provenance": {"commit": "c" * 40, "dirty": dirty}})
    assert interventions.made_by(tmp_path / "few") == ("full", not dirty)
    if dirty:
        with rejects("uncommitted_changes", "few"):
            interventions.require_clean(tmp_path)
    else:
        interventions.require_clean(tmp_path)


def test_the_names_of_a_run_are_those_that_explanations_quote() -> None:
    names = interventions.names_quoted("synthetic", "walks", "thirty-two people")
    assert "zhang2007_optimal_variance" in names
    assert interventions.names_quoted("synthetic", "walks", "origin floor") == []
