"""Tests of the report page: labels are complete, nothing moves or overflows, and numbers agree with tables."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pipeline.report.document import write_page
from pipeline.storage import tables
from tests.report.counted import LIMITS, WIDTHS, contradictions, counts, printed
from tests.report.planted import CLAIM, plant

FIGURES = ["zhang2007_fig5", "zhang2007_fig6"]
NAME = "zhang2007_map_thirty_percent"
LONG = "gain of the prior, of forty letters wide"


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """Report page with two figures and one claim with a long name."""
    folder = tmp_path / "synthetic" / "smoke"
    claims = {**CLAIM, "short": [LONG]}
    for name in FIGURES:
        plant(folder / name, claims=claims if name == FIGURES[0] else None)
    tables.write(folder / "claims.csv", claims)
    return write_page(folder, FIGURES)


@pytest.mark.parametrize("width", [WIDTHS[0], WIDTHS[-1]])
def test_labels_are_whole_and_nothing_moves_or_overflows(page: Path, browser: str, width: int) -> None:
    counted = counts(browser, page, width)
    assert counted["rows"] == 1
    assert [counted[name] for name in ("cut", "wider")] == [0, 0]
    assert counted["shift"] < 0.02  # the browser rounds; 0.1 is the limit of a good page
    assert 0 < counted["ledger"] < counted["story"] < LIMITS["story"]
    assert contradictions(page.parent, page.read_text(encoding="utf-8"), counted, {}) == []


def test_a_cut_label_is_counted(page: Path, browser: str) -> None:
    text = page.read_text(encoding="utf-8")
    page.write_text(text.replace(f'ledger-name">{LONG}', 'ledger-name">gain of th…'), encoding="utf-8")
    assert counts(browser, page, WIDTHS[0])["cut"] == 1


def test_a_figure_is_printed_open(page: Path, browser: str) -> None:
    assert 1 <= printed(browser, page) <= 4


SEEN: dict[str, Any] = {"values": {NAME: "29 %"}, "sentences": ["ours is 29 % smaller"], "alive": ""}


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({}, ""),
        ({"values": {NAME: "28 %"}}, f"ledger, {NAME}: 28 %, table 28.7792742"),
        (
            {"sentences": ["ours is 27.5 % smaller"]},
            "sentence: no 27.5 in the tables: ours is 27.5 % smaller",
        ),
        ({"alive": "computing"}, "live errors: computing"),
    ],
)
def test_a_number_that_no_table_has_is_found(page: Path, change: dict[str, Any], found: str) -> None:
    problems = contradictions(page.parent, page.read_text(encoding="utf-8"), SEEN | change, {})
    assert problems == [found] * bool(found)


def test_live_errors_are_compared_with_the_figure(tmp_path: Path) -> None:
    table = {
        "method": ["average_walker", "least_squares", "map"],
        "view_angle_deg": [0, 0, 0],
        "rms_error_mm": [32.93, 33.08, 25.54],
    }
    plant(tmp_path / "zhang2007_fig5", table=table)
    tables.write(tmp_path / "claims.csv", CLAIM)
    words = "33.1 mm by least squares, 25.5 mm with the prior, 32.9 mm by the average walker."
    assert contradictions(tmp_path, "", SEEN | {"alive": words}, {}) == []
    problems = contradictions(tmp_path, "", SEEN | {"alive": words.replace("25.5", "23.8")}, {})
    assert problems == ["live error with the prior: 23.8, table 25.54"]


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("Bands: one standard deviation.", ""),
        ("The blue line.", ""),
        ("The purple line.", "zhang2007_fig6: its caption names purple"),
    ],
)
def test_a_caption_names_what_is_drawn(page: Path, words: str, found: str) -> None:
    text = page.read_text(encoding="utf-8")
    start = text.index('id="zhang2007_fig6"')
    at = text.index('<div class="curves">', start)
    changed = f'{text[:at]}<p class="meta">{words}</p>{text[at:]}'
    assert contradictions(page.parent, changed, SEEN, {}) == [found] * bool(found)
    if words.startswith("Bands"):
        bare = changed.replace("&#34;lo&#34;", "&#34;none&#34;").replace("&#34;low&#34;", "&#34;none&#34;")
        assert bare != changed
        problems = contradictions(page.parent, bare, SEEN, {})
        assert problems == ["zhang2007_fig6: its caption names bands"]
