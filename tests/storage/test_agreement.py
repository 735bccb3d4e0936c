"""Tests that recomputed tables are compared within an archive's tolerances, and that other differences are reported."""

from __future__ import annotations

import gzip
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.storage import tables
from pipeline.storage.agreement import CLOSED_FORM, DIGITS, SEARCHED, compare_again, write_rule
from tests.rejects import rejects

TABLE = {"method": ["map", "null"], "error_mm": [20.0, 30.0]}
CLAIM = {
    "claim": ["one", "two"],
    "agreement": ["agrees", "differs"],
    "beyond_baseline": ["yes", "worse"],
    "value": [20.0, np.nan],
}


def figure(folder: Path, table: dict[str, Any] | None = None, claims: dict[str, Any] | None = None) -> Path:
    """Write a figure folder with a table, a table of durations and two claims; return its path."""
    folder.mkdir(parents=True)
    tables.write(folder / "table.csv", table or TABLE)
    tables.write(folder / "table_timing.csv", {"seconds": [1.0]})
    tables.write(folder / "claims.csv", claims or CLAIM)
    return folder


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    """Figure of an archive with a compressed table, next to the file with the tolerances."""
    folder = figure(tmp_path / "archive" / "zhang2007_fig5")
    write_rule(folder.parent, ["zhang2007_fig5"])
    content = (folder / "table.csv").read_bytes()
    (folder / "table.csv").unlink()
    (folder / "table.csv.gz").write_bytes(gzip.compress(content))
    return folder


def test_the_rule_names_every_table_but_that_of_times(kept: Path) -> None:
    assert tables.read_rows(kept.parent / DIGITS) == [
        {"figure": "zhang2007_fig5", "table": "table.csv", "relative_difference_allowed": "1e-05"}
    ]
    assert CLOSED_FORM < SEARCHED < 0.01


@pytest.mark.parametrize(("share", "agrees"), [(0.0, True), (0.5, True), (1.5, False)])
def test_numbers_agree_within_the_rule(kept: Path, tmp_path: Path, share: float, agrees: bool) -> None:
    off = {**TABLE, "error_mm": [20.0, 30.0 * (1 + share * CLOSED_FORM)]}
    result = compare_again(kept, figure(tmp_path / "made" / "zhang2007_fig5", off))
    assert [first.table for first in result] == ["table.csv", "claims.csv"]
    assert [not first.complaints for first in result] == [agrees, True]
    assert result[0].difference == pytest.approx(share * CLOSED_FORM, rel=0.02)


@pytest.mark.parametrize(
    ("stated", "share", "agrees"),
    [("1e9", 3.0, False), ("1e9", 0.5, True), ("1e-07", 0.5, False), ("", 3.0, False), ("none", 3.0, False)],
)
def test_the_archive_may_allow_less_and_never_more(
    kept: Path, tmp_path: Path, stated: str, share: float, agrees: bool
) -> None:
    off = {**TABLE, "error_mm": [20.0, 30.0 * (1 + share * CLOSED_FORM)]}
    output = figure(tmp_path / "made" / "zhang2007_fig5", off)
    path = kept.parent / DIGITS
    lines = path.read_text().splitlines()
    if stated == "none":
        path.unlink()
    else:  # without a row of its own, a table is compared all the same
        path.write_text(
            "\n".join([lines[0], lines[1].replace("1e-05", stated)] if stated else lines[:1]) + "\n"
        )
    result = compare_again(kept, output)
    assert [first.table for first in result] == ["table.csv", "claims.csv"]
    assert (result[0].complaints == ()) == agrees


@pytest.mark.parametrize("stated", ["nan", "inf", "-1", "much"])
def test_a_tolerance_that_is_none_is_refused(kept: Path, tmp_path: Path, stated: str) -> None:
    path = kept.parent / DIGITS
    path.write_text(path.read_text().replace("1e-05", stated))
    with rejects("out_of_range", "digits.csv: table.csv"):
        compare_again(kept, figure(tmp_path / "made" / "zhang2007_fig5"))


def test_a_claim_that_only_the_new_figure_has_is_named(kept: Path, tmp_path: Path) -> None:
    output = figure(tmp_path / "made" / "zhang2007_fig5")
    tables.write(kept / "claims.csv", {name: values[:1] for name, values in CLAIM.items()})
    assert compare_again(kept, output)[1].complaints == ("two: not in the archive",)
    (output / "claims.csv").rename(output.parent / "claims.csv")
    with rejects("no_file", "claims.csv"):
        compare_again(kept, output)
    (kept / "claims.csv").unlink()
    assert [result.table for result in compare_again(kept, output)] == ["table.csv"]
    (output.parent / "claims.csv").rename(output / "claims.csv")
    with rejects("no_file", "claims.csv"):
        compare_again(kept, output)


@pytest.mark.parametrize(
    ("claims", "complaint"),
    [
        ({**CLAIM, "agreement": ["agrees", "undecided"]}, "two, agreement: differs is not undecided"),
        ({**CLAIM, "beyond_baseline": ["no", "worse"]}, "one, beyond_baseline: yes is not no"),
        ({**CLAIM, "value": [20.1, np.nan]}, "one: 20 is not 20.1"),
        ({**CLAIM, "value": [np.nan, np.nan]}, "one: 20 is not nan"),
        ({name: values[:1] for name, values in CLAIM.items()}, "two: missing"),
    ],
)
def test_another_verdict_or_value_is_named(
    kept: Path, tmp_path: Path, claims: dict[str, Any], complaint: str
) -> None:
    result = compare_again(kept, figure(tmp_path / "made" / "zhang2007_fig5", claims=claims))
    assert [first.complaints for first in result] == [(), (complaint,)]


def test_claims_of_another_rule_are_refused(kept: Path, tmp_path: Path) -> None:
    output = figure(tmp_path / "made" / "zhang2007_fig5")
    (kept / "claims.csv").write_text("claim,verdict,value\none,differs,20\n")
    with rejects("other_rule", "claims.csv", lacking=["agreement", "beyond_baseline"]):
        compare_again(kept, output)


def test_other_rows_are_a_difference_and_no_tables_are_refused(kept: Path, tmp_path: Path) -> None:
    longer = {"method": ["map", "null", "more"], "error_mm": [20.0, 30.0, 40.0]}
    result = compare_again(kept, figure(tmp_path / "made" / "zhang2007_fig5", longer))
    assert "the numbers of rows differ: 2 and 3" in result[0].complaints
    empty = tmp_path / "archive" / "zhang2007_fig6"
    empty.mkdir()
    with rejects("no_table", "zhang2007_fig6"):
        compare_again(empty, kept)
    shutil.rmtree(kept)
    with rejects("no_file", "table.csv"):
        compare_again(figure(tmp_path / "again" / "zhang2007_fig5"), kept)
