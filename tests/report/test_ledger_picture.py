"""The ledger as a picture: places agree with verdicts, other data sets and switches stand on the same abscissa."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.report import ledger_picture as module
from pipeline.report.ledger_picture import Abscissa, ends_of, ledger_picture
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
    """What is drawn of one claim, with rows of switches that differ from `SWITCHED`."""
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
    found = drawn["sets"]["synthetic"][claim["name"]]
    assert (found["value"], found["ends"], found["said"]) == (28.7793, [22.5, 35.0], "agrees")
    assert (found["beyond"], found["simple"]) == ("yes", -28.0)
    # Within the bounds: right of the line at 45 %, the middle of the bounds within the interval, baseline left of it.
    assert found["ring"] < 45.0 < found["reach"][0] < found["at"] < found["reach"][1] == 71.5


def test_other_data_sets_beside_these_stand_on_the_same_abscissa(tmp_path: Path) -> None:
    other = {**BOUNDED, "value": [15.0], "value_low": [10.0], "value_high": [19.0], "agreement": ["close"]}
    (tmp_path / "optical" / "full").mkdir(parents=True)
    tables.write(tmp_path / "optical" / "full" / "claims.csv", other)
    found = picture(tmp_path)["sets"]
    assert next(iter(found)) == "synthetic"
    own, far = (found[data]["zhang2007_map_thirty_percent"] for data in ("synthetic", "optical"))
    assert far["said"] == "close"
    assert far["reach"][1] < 45.0 < own["reach"][0]


def test_a_switch_moves_the_claims_of_its_data_set_and_scale(tmp_path: Path) -> None:
    drawn = picture(
        tmp_path,
        {},
        {"switch": "origin floor", "answer_moves": False},
        {"switch": "x", "data": "cmu"},
        {"switch": "y", "scale": "smoke"},
        {"switch": "z", "claim": "of_old"},
    )
    assert [(one["name"], one["verdicts"]) for one in drawn["switches"]] == [
        ("divisor R", 1),
        ("origin floor", 0),
    ]
    assert drawn["switches"][0]["options"] == "model.divisor=R"
    moved = drawn["switches"][0]["moved"]["zhang2007_map_thirty_percent"]
    assert (moved["value"], moved["said"], moved["tone"], moved["jumps"]) == (12.5, "differs", "bad", True)
    assert moved["reach"][1] < 45.0


def test_without_claims_there_is_no_picture(tmp_path: Path) -> None:
    assert ledger_picture(Published(tmp_path, "synthetic", "full", {}, {})) == {}


BOUNDS = ("at least 20", "at most 20", "over 20", "10 to 30", "over 10 and under 30", "exactly 15")


@given(
    st.sampled_from(BOUNDS),
    st.floats(-100.0, 100.0),
    st.floats(0.0, 50.0),
    st.one_of(st.none(), st.floats(-100.0, 100.0)),
)
def test_an_interval_right_of_the_line_is_one_within_the_bounds(
    bounds: str, low: float, width: float, baseline: float | None
) -> None:
    axis, (start, end), high = (
        Abscissa({"bounds": bounds, "baseline_value": baseline}),
        ends_of(bounds),
        low + width,
    )
    left, right = axis.interval(low, high)
    assert left <= right <= 1.0 or not np.isfinite([start, end]).all()
    if start != end:
        assert (left >= 0.0) == (start <= low and high <= end)
    else:
        assert (axis.place(low) == 1.0) == (low == start)


@pytest.mark.parametrize(
    "path", sorted((PROJECT / "results" / "archive" / "light").glob("*/claims.csv")), ids=str
)
def test_the_ledgers_that_are_kept_have_bounds_that_are_understood(path: Path) -> None:
    rows = [row for row in numbered_rows(path) if row["bounds"]]
    assert len(rows) > 100
    for row in rows:
        assert np.isfinite(ends_of(row["bounds"])).any(), row["bounds"]
        if row["agreement"] == "agrees" and isinstance(row["value_low"], float):
            left, _ = Abscissa(row).interval(row["value_low"], row["value_high"])
            assert left >= -1e-9, row["claim"]


DATA_SETS = {path.stem for path in (PROJECT / "conf" / "data").glob("*.yaml")}


def menu(page: Path) -> list[str]:
    """Names that the ledger of a page offers under "Data", that of its own first."""
    packed = re.search(r'id="ledger-data">(.*?)</script>', page.read_text("utf-8"), re.DOTALL)
    assert packed
    return [*json.loads(packed[1])["sets"]]


def test_the_menu_offers_data_sets_and_no_folder_that_is_being_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The page of a light archive is written in a temporary folder among the light archives."""
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
    """`make archive LIGHT=1 DATA=…` renews a page."""
    assert menu(page)[0] == page.parent.name
    assert set(menu(page)) <= DATA_SETS
