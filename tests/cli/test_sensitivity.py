"""Tests of the switches for ambiguities in the papers: each is a valid option, and changed results are tabulated."""

from __future__ import annotations

import functools
from pathlib import Path

import pandas as pd
import pytest

from pipeline import papers
from pipeline.cli.compose import compose
from pipeline.cli.sensitivity import PLAIN, compare, moved_table, sensitivity, switches
from pipeline.papers import Agreement, Estimate, Evidence, Verdict
from pipeline.resources import CONF
from pipeline.storage import tables
from pipeline.storage.provenance import PROJECT
from tests.rejects import rejects

pytestmark = pytest.mark.thorough

GROUPS = papers.read_mapping(CONF / "sensitivity.yaml")


@pytest.mark.parametrize("name", GROUPS)
def test_every_switch_changes_an_option_of_its_figures(name: str) -> None:
    plain = functools.cache(lambda *given: compose(list(given)))
    observed = set()
    for data_name in ("synthetic", "optical"):
        result = list(switches(GROUPS[name], data_name))
        assert result[0].name == PLAIN
        assert len({switch.name for switch in result}) == len(result) > 5
        for switch in result[1:]:
            if switch.name in observed:
                continue
            observed.add(switch.name)
            options = (f"experiment={switch.figures[-1]}", f"data={data_name}", *switch.common)
            experiment = compose([*options, *switch.overrides])
            experiment.sweep.validate()
            assert experiment != plain(*options), switch.name


def verdict(name: str, value: float, agreement: Agreement) -> Verdict:
    return Verdict(papers.claim(name), agreement, "", Evidence(value=Estimate(value, value - 1, value + 1)))


def test_a_switch_is_compared_with_the_figures_as_they_are() -> None:
    plain = [
        verdict("zhang2007_map_thirty_percent", 30.0, Agreement.AGREES),
        verdict("zhang2007_fundamental_share", 91.0, Agreement.AGREES),
    ]
    with_it = [
        verdict("zhang2007_map_thirty_percent", 20.5, Agreement.UNDECIDED),
        verdict("zhang2007_fundamental_share", 91.5, Agreement.AGREES),
        verdict("zhang2007_second_harmonic_share", 6.0, Agreement.AGREES),
        Verdict(papers.claim("zhang2007_view_angle_mean"), Agreement.UNTESTABLE, ""),
    ]
    gain, share = compare(plain, with_it, "divisor R")
    assert (gain["value_as_it_is"], gain["value"], gain["answer_moves"]) == (30.0, 20.5, True)
    assert gain["outside_the_interval"]
    assert not share["outside_the_interval"]
    assert not share["answer_moves"]
    assert moved_table([gain, share]).row_count == 1


def test_groups_and_single_switches_are_tabulated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    few = {"figures": ["zhang2007_fig2"], "common": ["data.walkers=4"]}
    few["switches"] = {
        "short": {"overrides": ["data.duration_s=3"]},
        "level": {"overrides": ["data.offsets=0"]},
    }
    monkeypatch.setattr("pipeline.cli.sensitivity.groups", lambda: {"few": (CONF, few)})
    options = ["data=synthetic", "scale=smoke", f"results={tmp_path}", "workers=1", "few"]
    assert sensitivity(options) == 0
    folder = tmp_path / "sensitivity" / "synthetic" / "few"
    assert {row["switch"] for row in tables.read_rows(folder / "table.csv")} == {PLAIN, "short", "level"}
    for words in (["short"], ["few", "short"]):
        assert sensitivity([*options[:-1], *words]) == 0
        assert {row["switch"] for row in tables.read_rows(folder / "table.csv")} == {PLAIN, "short"}
    with rejects("unknown_choice", value="shorter"):
        sensitivity([*options[:-1], "shorter"])


def test_every_interval_that_is_judged_in_the_table_of_sensitivity_holds_its_value() -> None:
    retained = pd.read_csv(PROJECT / "results" / "sensitivity.csv").dropna(subset=["value_low"])
    # Errors of a symmetric model are asymmetric by chance, people drawn again by another: nothing is judged by it.
    retained = retained[retained["agreement"] != "untestable"]
    assert retained["value"].between(retained["value_low"], retained["value_high"]).all()
