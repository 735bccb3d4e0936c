"""Published tables in, verdicts out; and threads that change nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline import papers
from pipeline.storage import tables
from pipeline.studies.ledger import judge_figure, judge_folder, write_claims
from pipeline.threads import map_threads

SPECTRUM = {
    "table": (
        {
            "component": np.arange(1, 32),
            "eigenvalue_mm2": np.ones(31),
            "variance_fraction": np.full(31, 1 / 31),
            "cumulative_fraction": np.concatenate([np.linspace(0.5, 0.955, 30), [1.0]]),
        },
        ["component"],
    ),
    "table_harmonics": (
        {
            "walker": ["a", "a", "b", "b"],
            "harmonic": [1, 2, 1, 2],
            "variance_fraction": [0.92, 0.06, 0.918, 0.06],
            "residual_fraction": [0.02, 0.02, 0.022, 0.022],
            "frequency_hz": [1.0, 1.0, 0.9, 0.9],
        },
        ["walker", "harmonic"],
    ),
}


def by_name(verdicts: list[papers.Verdict]) -> dict[str, papers.Verdict]:
    return {v.claim.name: v for v in verdicts}


def test_a_figure_is_judged_on_its_own_tables() -> None:
    found = by_name(judge_figure("zhang2007_fig2", SPECTRUM, "synthetic"))
    thirty = found["zhang2007_thirty_components"]
    assert thirty.ours == pytest.approx(95.5)
    assert thirty.verdict == "reproduced"
    assert found["zhang2007_fundamental_share"].ours == pytest.approx(91.9)


def test_a_folder_is_judged_like_its_figures(tmp_path: Path) -> None:
    folder = tmp_path / "zhang2007_fig2"
    folder.mkdir()
    for name, (columns, sort_by) in SPECTRUM.items():
        tables.write(folder / f"{name}.csv", columns, sort_by=sort_by)
    alone = by_name(judge_figure("zhang2007_fig2", SPECTRUM, "synthetic"))
    found = by_name(judge_folder(tmp_path, "synthetic", ["zhang2007_fig2", "zhang2007_fig5"]))
    for name, verdict in alone.items():
        assert found[name].verdict == verdict.verdict
    assert found["zhang2007_map_thirty_percent"].verdict == "cannot be tested on this data"

    write_claims(tmp_path / "claims.csv", list(found.values()))
    written = tables.read(tmp_path / "claims.csv")
    row = written["claim"].tolist().index("zhang2007_thirty_components")
    assert written["published"][row] == 95.5
    assert written["verdict"][row] == "reproduced"


@pytest.mark.parametrize("workers", [1, 2, 5])
def test_threads_keep_the_order(workers: int) -> None:
    assert map_threads(lambda n: n * n, range(20), workers) == [n * n for n in range(20)]


@pytest.mark.parametrize("workers", [1, 3])
def test_the_first_error_comes_through(workers: int) -> None:
    def fail(n: int) -> int:
        if n == 3:
            raise ValueError("three")
        return n

    with pytest.raises(ValueError, match="three"):
        map_threads(fail, range(6), workers)
