"""Tests of the comparison of variants: their different options, values, verdicts and curves."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.report.variants import compare_variants, variants_of
from pipeline.storage import tables
from tests.report.planted import CLAIM, plant


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """Multirun folder with three finished variants and one unfinished variant of a figure."""
    folder = tmp_path / "scratch" / "2026-11-22_06-00"
    for job, components in ((10, 30), (2, 20), (0, 10)):
        plant(
            folder / f"{job}_model.components={components}" / "zhang2007_fig5",
            claims={**CLAIM, "value": [float(components)], "agreement": ["differs" if job else "agrees"]},
            configuration={"model": {"components": components, "divisor": {"<type>": "Divisor", "name": "R-1"}},
                           "results": f"run{job}"},
        )  # fmt: skip
    (folder / "11_model.components=40" / "zhang2007_fig5").mkdir(parents=True)
    return folder


def test_only_options_that_differ_tell_variants_apart(run: Path) -> None:
    (variants,) = variants_of(run).values()
    assert [variant.options for variant in variants] == [
        {"model.components": "10"}, {"model.components": "20"}, {"model.components": "30"}
    ]  # fmt: skip
    assert variants[0].name == "components=10"


def test_the_table_has_a_row_for_each_variant_and_claim(run: Path) -> None:
    written = compare_variants(run)
    assert [path.name for path in written] == [
        "variants.csv", "variants_zhang2007_fig5.svg", "variants_zhang2007_fig5.png"
    ]  # fmt: skip
    assert all(path.is_file() for path in written)
    table = tables.read(run / "variants.csv")
    assert table["model.components"].tolist() == [10, 20, 30]
    assert table["value"].tolist() == [10.0, 20.0, 30.0]
    assert table["agreement"].tolist() == ["agrees", "differs", "differs"]
    assert set(table["claim"].tolist()) == {"zhang2007_map_thirty_percent"}


def test_a_single_variant_is_not_compared(tmp_path: Path) -> None:
    plant(tmp_path / "run" / "0_seed=1" / "zhang2007_fig5", claims=CLAIM)
    assert compare_variants(tmp_path / "run") == []
    assert not (tmp_path / "run" / "variants.csv").exists()
