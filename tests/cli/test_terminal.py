"""Tests of terminal output at 80 and 100 columns: names and folders are not cut, and the first line appears at once."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from pipeline.cli.inspect import look
from pipeline.cli.output import exists
from pipeline.cli.summary import Outcome, claims_table, summarise
from pipeline.skeleton import WALKER15
from pipeline.synthetic import walkers
from tests.processes import python

ROW = {
    "agreement": "agrees", "beyond baseline": "yes", "paper": "zhang2007", "claim": "view angle, mean error",
    "name": "zhang2007_view", "quote": "“small”", "published": "3", "ours": "1.771 [1.2, 2.3]", "unit": "%",
    "baseline": "9.5", "kind": "result", "why": "",
}  # fmt: skip


def printed(width: int, *parts: object) -> list[str]:
    """Return the lines that a terminal of this width shows."""
    stream = io.StringIO()
    Console(file=stream, width=width, highlight=False).print(*parts)
    return [line.rstrip() for line in stream.getvalue().splitlines()]


def write(path: Path, names: Sequence[str], positions: np.ndarray) -> None:
    """Write positions (T, J, 3), mm, at 60 Hz as a table with a column for each coordinate."""
    heading = ["time_s", *(f"{name}_{axis}" for name in names for axis in "xyz")]
    rows = np.column_stack([np.arange(len(positions)) / 60.0, positions.reshape(len(positions), -1)])
    np.savetxt(path, rows, "%.4f", ",", header=",".join(heading), comments="")


@pytest.mark.parametrize(("width", "baseline"), [(80, False), (100, False), (110, True)])
def test_claims_stand_on_one_line_by_their_short_names(width: int, baseline: bool) -> None:
    smoke = {**ROW, "claim": "variance of the second harmonic", "agreement": "not judged at smoke scale"}
    lines = printed(width, claims_table([ROW, smoke], width))
    assert max(map(len, lines)) <= width
    (first,) = (line for line in lines if ROW["claim"] in line)
    assert first.split("  ")[0] == "agrees"
    assert "1.771 [1.2, 2.3] %" in first
    assert ("9.5" in first) == baseline
    (second,) = (line for line in lines if smoke["claim"] in line)
    assert second.startswith("not judged ")
    assert sum("results" in line and "zhang2007" in line for line in lines) == 1


@pytest.mark.parametrize("width", [80, 100])
def test_the_folder_of_the_results_is_whole_on_a_line_of_its_own(width: int, tmp_path: Path) -> None:
    folder = tmp_path / ("a_folder_with_a_long_name_" * 6) / "zhang2007_fig5"
    folder.mkdir(parents=True)
    for name in ("table.csv", "table_views.csv", "figure.svg", "recording.rrd"):
        (folder / name).touch()
    seconds = dict.fromkeys(("ingest", "dataset", "model", "sweep", "figure"), 1.0)
    stream = io.StringIO()
    outcome = Outcome("zhang2007_joint_angles", folder, seconds, ("ingest", "sweep"), [], (), 2.0)
    summarise([outcome], [], Console(file=stream, width=width), seconds=5.0)
    lines = stream.getvalue().splitlines()
    assert f"{folder}/" in lines
    assert any(line.startswith("zhang2007_joint_angles ") for line in lines)
    assert "Files: 2 tables, 1 picture, 1 recording." in lines


@pytest.mark.parametrize("width", [80, 100])
def test_inspect_shows_a_folder_as_one_table_with_one_next_command(
    width: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    names = ("anna_1", "ben_1", "eva_with_a_name_that_is_longer_than_half_of_the_line_1")
    people = walkers.walking_population(
        np.random.default_rng(3), male=2, female=1, duration_s=3.0, frame_rate_hz=60.0
    )
    for person, positions in zip(names, people.positions_mm, strict=True):
        write(tmp_path / f"{person}.csv", WALKER15.joints, positions)
    write(tmp_path / "odd.csv", ("a", "b"), people.positions_mm[0][:, :2])
    look([str(tmp_path)])
    table, _, following = capsys.readouterr().out.partition("summary")
    lines = table.splitlines()
    assert lines[0].split() == ["file", "mapping", "joints", "strides", "walk"]
    assert max(map(len, lines)) <= width
    assert [line.split()[1:3] for line in lines if line.startswith("anna_1.csv")] == [["walker15", "15"]]
    assert any(line.startswith("odd.csv") and "no mapping" in line for line in lines)
    assert "points:" not in table
    assert following.count("next: ") == 1
    look([str(tmp_path), "details=true"])
    assert capsys.readouterr().out.count("points: ") >= 4


@pytest.mark.parametrize(
    ("command", "line"),
    [("inspect", "reading"), ("reconstruct", "reading"), ("export", "reading"), ("pointlight", "setting up")],
)
def test_a_first_line_comes_before_any_library(command: str, line: str, tmp_path: Path) -> None:
    script = """if True:
        import sys, pipeline.cli.main as main
        def command(name):
            print([name for name in ("numpy", "scipy", "pandas", "hydra", "rich") if name in sys.modules])
            return lambda arguments: 0
        main.command = command
        main.main(sys.argv[1:])
    """
    source = str(tmp_path) if line == "reading" else "synthetic"
    first, second = python("-c", script, command, source).stdout.splitlines()
    assert first == f"{line} {tmp_path if line == 'reading' else command}"
    assert second == "[]"


def test_an_argument_too_long_for_a_file_name_is_no_file() -> None:
    assert not exists("experiment=" + "zhang2007_fig5," * 40)
    assert exists(".")
