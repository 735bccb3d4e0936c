"""Tests of the picture of the claims: positions agree with verdicts, also for other data sets and for switches."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.papers import Interval
from pipeline.report import ledger_picture as module
from pipeline.report.ledger_picture import Abscissa, abscissae, ledger_picture
from pipeline.report.light import keep_light
from pipeline.report.published import Published, numbered_rows, read_published
from pipeline.storage import tables
from pipeline.storage.provenance import PROJECT
from pipeline.storage.sealed_folders import digest
from tests.report.planted import CLAIM, plant

BOUNDED = {
    **CLAIM,
    "bounds": ["20 to 40"],
    "close_bounds": ["over 0 and under 100"],
    "baseline_value": [-28.0],
}
SWITCHED: dict[str, Any] = {
    "data": "synthetic", "group": "walks", "scale": "full", "claim": "zhang2007_map_thirty_percent",
    "switch": "divisor R", "value": 12.5, "value_low": 10.0, "value_high": 15.0, "agreement": "differs",
    "beyond_baseline": "no", "value_as_it_is": 28.0, "agreement_as_it_is": "agrees", "beyond_baseline_as_it_is": "yes",
    "outside_the_interval": True, "answer_moves": True, "common": "",
}  # fmt: skip


def picture(tmp_path: Path, *switched: dict[str, Any], scale: str = "full") -> dict[str, Any]:
    """Return the picture data of one claim, with sensitivity rows that differ from `SWITCHED` as given."""
    folder = tmp_path / "synthetic" / scale
    if not folder.exists():
        plant(folder / "zhang2007_fig5", claims=BOUNDED, scale=scale)
    listed = tmp_path / "sensitivity.csv"
    if switched:
        rows = [{**SWITCHED, **change} for change in switched]
        tables.write(listed, {name: [row[name] for row in rows] for name in SWITCHED})
    return ledger_picture(read_published(folder, ["zhang2007_fig5"]), listed=listed)


def test_a_claim_stands_with_its_words_numbers_and_answers(tmp_path: Path) -> None:
    drawn = picture(tmp_path)
    [claim] = drawn["claims"]
    assert (claim["name"], claim["figure"], claim["published"]) == (CLAIM["claim"][0], "zhang2007_fig5", 30.0)
    result = drawn["sets"]["synthetic"][claim["name"]]
    assert (result["value"], result["ends"], result["verdict"]) == (28.7793, [22.5, 35.0], "agrees")
    assert (result["beyond"], result["simple"]) == ("yes", -28.0)
    # Within the bounds: right of the line at 45 %, the middle of the bounds within the interval, baseline left of it.
    assert result["ring"] < 45.0 < result["reach"][0] < result["at"] < result["reach"][1] == 71.5


def test_other_data_sets_beside_these_stand_on_the_same_abscissa(tmp_path: Path) -> None:
    other = {**BOUNDED, "value": [15.0], "value_low": [10.0], "value_high": [19.0], "agreement": ["close"]}
    (tmp_path / "optical" / "full").mkdir(parents=True)
    tables.write(tmp_path / "optical" / "full" / "claims.csv", other)
    result = picture(tmp_path)["sets"]
    assert next(iter(result)) == "synthetic"
    reference, far = (result[data]["zhang2007_map_thirty_percent"] for data in ("synthetic", "optical"))
    assert far["verdict"] == "close"
    assert far["reach"][1] < 45.0 < reference["reach"][0]


def test_a_switch_moves_the_claims_of_its_data_set_and_scale(tmp_path: Path) -> None:
    drawn = picture(
        tmp_path,
        {},
        {"switch": "origin floor", "answer_moves": False},
        {"switch": "x", "data": "cmu"},
        {"switch": "y", "scale": "smoke"},
        {"switch": "z", "claim": "of_old"},
    )
    assert [(first["name"], first["verdicts"]) for first in drawn["switches"]] == [
        ("divisor R", 1),
        ("origin floor", 0),
    ]
    assert drawn["switches"][0]["options"] == "model.divisor=R"
    moved = drawn["switches"][0]["moved"]["zhang2007_map_thirty_percent"]
    assert (moved["value"], moved["verdict"], moved["tone"], moved["jumps"]) == (12.5, "differs", "bad", True)
    assert moved["reach"][1] < 45.0


def test_without_claims_there_is_no_picture(tmp_path: Path) -> None:
    assert ledger_picture(Published(tmp_path, "synthetic", "full", {}, {})) == {}


def test_a_claim_of_other_bounds_or_of_another_version_has_its_verdict_and_no_place(tmp_path: Path) -> None:
    for number, change in enumerate(({"bounds": ["20 to 41"]}, {"claim": ["zhang2007_of_old"]})):
        folder = tmp_path / str(number) / "synthetic" / "full"
        plant(folder / "zhang2007_fig5", claims={**BOUNDED, **change}, scale="full")
        drawn = ledger_picture(read_published(folder, ["zhang2007_fig5"]), listed=tmp_path / "none.csv")
        (row,) = drawn["sets"]["synthetic"].values()
        assert row == {
            "value": 28.7793, "verdict": "agrees", "tone": "good", "ends": [22.5, 35.0],
            "beyond": "yes", "simple": -28.0,
        }  # fmt: skip


def test_bounds_are_those_of_the_claim_not_read_from_words() -> None:
    [axis] = abscissae(
        [{"claim": "zhang2007_map_thirty_percent", "bounds": "20 to 40", "published": 30.0}]
    ).values()
    assert (axis.low, axis.high, axis.unit) == (20.0, 40.0, 10.0)


BOUNDS = (
    Interval(low=20.0),
    Interval(high=20.0),
    Interval(low=20.0, low_open=True),
    Interval(10.0, 30.0),
    Interval(10.0, 30.0, low_open=True, high_open=True),
    Interval(15.0, 15.0),
)


@given(
    st.sampled_from(BOUNDS),
    st.floats(-100.0, 100.0),
    st.floats(0.0, 50.0),
    st.lists(st.floats(-100.0, 100.0), max_size=1),
)
def test_an_interval_right_of_the_line_is_one_within_the_bounds(
    bounds: Interval, low: float, width: float, others: list[float]
) -> None:
    axis, start, end, high = Abscissa(bounds, others=others), bounds.low, bounds.high, low + width
    left, right = axis.interval(low, high)
    assert left <= right <= 1.0 or not np.isfinite([start, end]).all()
    if start != end:
        assert (left >= 0.0) == (start <= low and high <= end)
    else:
        assert (axis.place(low) == 1.0) == (low == start)


@pytest.mark.parametrize(
    "path", sorted((PROJECT / "results" / "archive" / "light").glob("*/claims.csv")), ids=str
)
def test_claims_that_agree_in_the_ledgers_that_are_kept_lie_right_of_the_line(path: Path) -> None:
    rows = numbered_rows(path)
    axes = abscissae(rows)
    assert len(axes) > 100
    for row in rows:
        if row["claim"] in axes and row["agreement"] == "agrees" and isinstance(row["value_low"], float):
            left, _ = axes[row["claim"]].interval(row["value_low"], row["value_high"])
            assert left >= -1e-9, row["claim"]


DATA_SETS = {path.stem for path in (PROJECT / "conf" / "data").glob("*.yaml")}


def menu(page: Path) -> list[str]:
    """Return the data sets that the "Data" menu of a page offers, beginning with the page's own."""
    packed = re.search(r'id="ledger-data">(.*?)</script>', page.read_text("utf-8"), re.DOTALL)
    assert packed
    return [*json.loads(packed[1])["sets"]]


def test_the_menu_offers_data_sets_and_no_folder_that_is_being_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The menu of a page offers data sets, but not the temporary folder of an archive that is being written."""
    monkeypatch.setattr(module, "PROJECT", tmp_path)
    lock = tmp_path / "requirements.lock"
    lock.write_text("numpy==2.4.6\n")
    light, facts = tmp_path / "results" / "archive" / "light", {"date": "2026-11-22", "commit": "f" * 40}
    for data in ("optical", "synthetic"):
        folder = tmp_path / "results" / data / "full"
        plant(folder / "zhang2007_fig5", claims=BOUNDED, scale="full", lock_sha256=digest(lock.read_bytes()))
        tables.write(folder / "claims.csv", BOUNDED)
    for aside in (
        light / ".tmp-1-abc",
        light / ".old-1-abc-cmu",
        tmp_path / "results" / ".tmp-2-abc" / "full",
    ):
        aside.mkdir(parents=True)
        tables.write(aside / "claims.csv", BOUNDED)
    for data, other in (("optical", "synthetic"), ("synthetic", "optical")):
        results = tmp_path / "results" / data / "full"
        keep_light(results, light / data, ["zhang2007_fig5"], lock=lock, dirty=False, **facts)
        assert menu(light / data / "index.html") == [data, other]


@pytest.mark.parametrize(
    "page", sorted((PROJECT / "results" / "archive" / "light").glob("[!.]*/index.html")), ids=str
)
def test_the_menus_of_the_pages_that_are_kept_offer_data_sets(page: Path) -> None:
    """The menus of the pages in light archives offer only data sets; `make archive LIGHT=1 DATA=…` renews a page."""
    assert menu(page)[0] == page.parent.name
    assert set(menu(page)) <= DATA_SETS
