"""Tests of the displayed synthetic population: its error is the median, within the range of all populations."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from pipeline.cli.figures import make_figure
from pipeline.storage.store import Store
from tests.stages.run import smoke

POPULATIONS = 5


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    results = tmp_path_factory.mktemp("populations")
    for name in ("zhang2007_fig5", "zhang2004_fig2", "zhang2004_fig5"):
        quiet = ("figure.picture=false", "figure.recording=false", f"scale.populations={POPULATIONS}")
        make_figure(smoke(name, *quiet, f"results={results}"), results / name, store=Store(results))
    return results


def number_shown(folder: Path) -> int:
    return int(json.loads((folder / "manifest.json").read_text())["population"])


@pytest.mark.parametrize(
    ("figure", "of", "column"),
    [
        ("zhang2007_fig5", "least_squares", "absolute_error_mm2"),
        ("zhang2004_fig2", "", "cumulative_fraction"),
        ("zhang2004_fig5", "least_squares", "error_deg"),
    ],
)
def test_as_many_populations_have_a_smaller_error_as_a_larger(
    made: Path, figure: str, of: str, column: str
) -> None:
    rows = pd.read_csv(made / figure / "table_populations.csv")
    rows = rows[rows["method"] == of] if of else rows
    mean = {number: part[column].abs().mean() for number, part in rows.groupby("population")}
    displayed = mean[number_shown(made / figure)]
    assert len(mean) == POPULATIONS
    assert (
        sum(first < displayed for first in mean.values())
        == sum(first > displayed for first in mean.values())
        == POPULATIONS // 2
    )


def test_the_table_is_that_of_the_population_and_its_intervals_hold_all(made: Path) -> None:
    folder, column = made / "zhang2007_fig5", "absolute_error_mm2"
    table, every = (pd.read_csv(folder / f"{name}.csv") for name in ("table", "table_populations"))
    reference = every[every["population"] == number_shown(folder)].reset_index(drop=True)
    pd.testing.assert_series_equal(table[column], reference[column])
    each = every.groupby(["method", "view_angle_deg"])[column]
    ends = pd.DataFrame({"low": each.min(), "high": each.max()}).reset_index()
    assert (table[["method", "view_angle_deg"]] == ends[["method", "view_angle_deg"]]).all(axis=None)
    for end in ("low", "high"):
        pd.testing.assert_series_equal(table[f"{column}_{end}"], ends[end], check_names=False, rtol=1e-8)


def test_between_the_views_of_all_populations_the_range_is_around_the_one_shown(made: Path) -> None:
    table = pd.read_csv(made / "zhang2004_fig5" / "table.csv")
    drawn = table[table["method"] == "least_squares"]
    assert (drawn["estimated_mean_deg_low"] <= drawn["estimated_mean_deg"] + 1e-9).all()
    assert (drawn["estimated_mean_deg_high"] >= drawn["estimated_mean_deg"] - 1e-9).all()
