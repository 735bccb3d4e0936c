"""Published tables in, verdicts out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline import papers
from pipeline.storage import tables
from pipeline.storage.sealed_folders import write_manifest
from pipeline.studies.ledger import judge_figure, judge_folder, write_claims
from pipeline.validation import InvalidInput

SPECTRUM = {
    "table": {
        "component": np.arange(1, 32),
        "eigenvalue_mm2": np.ones(31),
        "variance_fraction": np.full(31, 1 / 31),
        "cumulative_fraction": np.concatenate([np.linspace(0.5, 0.955, 30), [1.0]]),
    },
    "table_harmonics": {
        "walker": ["a", "a", "b", "b"],
        "harmonic": [1, 2, 1, 2],
        "variance_fraction": [0.92, 0.06, 0.918, 0.06],
        "residual_fraction": [0.02, 0.02, 0.022, 0.022],
        "frequency_hz": [1.0, 1.0, 0.9, 0.9],
    },
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
    for name, columns in SPECTRUM.items():
        tables.write(folder / f"{name}.csv", columns)
    write_manifest(folder, {})
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


def test_a_table_that_was_edited_after_publication_is_not_judged(tmp_path: Path) -> None:
    folder = tmp_path / "zhang2007_fig2"
    folder.mkdir()
    for name, columns in SPECTRUM.items():
        tables.write(folder / f"{name}.csv", columns)
    with pytest.raises(InvalidInput, match=r"zhang2007_fig2: manifest.json is missing"):
        judge_folder(tmp_path, "synthetic", ["zhang2007_fig2"])
    write_manifest(folder, {})
    (folder / "table_mine.csv").write_text("not,a table\n1\n")
    assert by_name(judge_folder(tmp_path, "synthetic", ["zhang2007_fig2"])), (
        "a file of the reader's is not ours"
    )
    table = folder / "table_harmonics.csv"
    table.write_text(table.read_text().replace("0.92", "0.99"))
    with pytest.raises(
        InvalidInput, match=r"table_harmonics.csv: the table was changed after it was published"
    ):
        judge_folder(tmp_path, "synthetic", ["zhang2007_fig2"])
    table.unlink()
    with pytest.raises(InvalidInput, match=r"table_harmonics.csv: cannot read the table"):
        judge_folder(tmp_path, "synthetic", ["zhang2007_fig2"])


def test_timings_are_judged_by_nothing(tmp_path: Path) -> None:
    seconds = {"what": np.array(["pair", "onto_pattern"]), "performances": np.array([2, 40])}
    fast, slow = (seconds | {"seconds": np.full(2, value)} for value in (1e-6, 1e6))
    verdicts = []
    for number, columns in enumerate((fast, slow)):
        made = {"table_timing": columns}
        folder = tmp_path / str(number) / "mozerov2006_fig3"
        folder.mkdir(parents=True)
        tables.write(folder / "table_timing.csv", columns)
        write_manifest(folder, {})
        verdicts.append(judge_figure("mozerov2006_fig3", made, "synthetic"))
        verdicts.append(judge_folder(folder.parent, "synthetic", ["mozerov2006_fig3"]))
    told = [{name: v.verdict for name, v in by_name(found).items()} for found in verdicts]
    assert told[0] == told[2]
    assert told[1] == told[3]
    assert "reproduced" not in {*told[0].values(), *told[1].values()}
