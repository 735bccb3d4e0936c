"""Tests of the digit check: it measures the differences between numerical settings, and names a table that differs."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.storage import tables
from tests import golden_digits
from tests.golden_digits import KERNELS, measure, moved, settings

FIGURE = "zhang2007_fig6"


@pytest.fixture
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Path]:
    """Folders of one figure under two settings, with values equal to its golden table and different durations."""
    golden = tmp_path / "golden"
    golden.mkdir()
    result = {name: tmp_path / name for name in ("one", "two")}
    for number, folder in enumerate(result.values()):
        (folder / FIGURE).mkdir(parents=True)
        tables.write(folder / FIGURE / "table.csv", {"method": ["map"], "error_mm": [40.0]}, sort_by=[])
        tables.write(folder / FIGURE / "table_walkers.csv", {"error_mm": [1.0, 2.0]}, sort_by=[])
        tables.write(folder / FIGURE / "table_timing.csv", {"seconds": [1.0 + number]}, sort_by=[])
    tables.write(golden / f"{FIGURE}.csv", {"method": ["map"], "error_mm": [40.0]}, sort_by=[])
    digits = {"figure": [FIGURE], "table": ["table_walkers"], "tolerance": ["1e-03"]}
    tables.write(golden / "digits.csv", digits, sort_by=[])
    monkeypatch.setattr(golden_digits, "GOLDEN", golden)
    monkeypatch.setattr(golden_digits, "DIGITS", golden / "digits.csv")
    return result


def test_seconds_may_differ_and_digits_within_the_tolerance(folders: dict[str, Path]) -> None:
    assert moved([FIGURE], folders) == []
    tables.write(folders["two"] / FIGURE / "table_walkers.csv", {"error_mm": [1.0, 2.001]}, sort_by=[])
    assert moved([FIGURE], folders) == []
    assert [(row["table"], row["column"]) for row in measure([FIGURE], folders)] == [
        ("table", ""),
        ("table_walkers", "error_mm"),
    ]
    row = measure([FIGURE], folders)[1]
    assert (row["relative_difference"], row["tolerance"], row["settings"]) == ("5.0e-04", "1e-02", "one two")


def test_a_digit_that_moved_is_named_with_figure_column_and_values(folders: dict[str, Path]) -> None:
    tables.write(folders["two"] / FIGURE / "table.csv", {"method": ["map"], "error_mm": [40.001]}, sort_by=[])
    tables.write(folders["two"] / FIGURE / "table_walkers.csv", {"error_mm": [1.0, 2.1]}, sort_by=[])
    assert moved([FIGURE], folders) == [
        "two: zhang2007_fig6/table.csv, line 2, error_mm: 40 is not 40.001 (tolerance 1e-06)",
        "two: zhang2007_fig6/table_walkers.csv, line 3, error_mm: 2 is not 2.1 (tolerance 0.001)",
    ]


def test_text_that_differs_is_no_matter_of_digits(folders: dict[str, Path]) -> None:
    tables.write(folders["two"] / FIGURE / "table.csv", {"method": ["ls"], "error_mm": [40.0]}, sort_by=[])
    assert measure([FIGURE], folders)[0]["tolerance"] == "1e-06"
    assert len(moved([FIGURE], folders)) == 1


def test_only_what_the_processor_knows_is_tried() -> None:
    assert {"default", "generic"} <= set(settings()) <= {"default", "generic", "no_simd", *KERNELS}
    knows = {name for name, start in golden_digits.simd.__cpu_features__.items() if start}
    assert all(KERNELS[name] in knows for name in settings() if name in KERNELS)


def test_a_figure_that_is_none_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        golden_digits.main(["newton1687_fig1"])
    assert "there is no figure newton1687_fig1" in capsys.readouterr().err
