"""Tests that the tutorial runs and prints its result."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.cli.compose import compose
from pipeline.storage import tables

pytestmark = pytest.mark.thorough

ROOT = Path(__file__).resolve().parent.parent
TUTORIAL = (ROOT / "tutorial.py").read_text(encoding="utf-8")


def run(folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the tutorial with one random draw in a folder, and return its output."""
    where = {"TUTORIAL_FOLDER": str(folder), "TUTORIAL_DRAWS": "1", "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.run(
        [sys.executable, "-W", "error", str(ROOT / "tutorial.py")],
        env=os.environ | where | {"PYTHONPATH": str(ROOT)},
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the files that the tutorial writes."""
    output = tmp_path_factory.mktemp("tutorial")
    done = run(output)
    assert done.returncode == 0, done.stderr
    assert "off in depth" in done.stdout
    return output


def test_more_walkers_make_a_better_model_and_few_a_worse_one_than_their_average(folder: Path) -> None:
    answer = tables.read(folder / "answer" / "answer.csv")
    mean = dict(zip(zip(answer["method"], answer["walkers"], strict=True), answer["mean"], strict=True))
    assert mean["map", 80] < 0.85 * mean["map", 10]
    assert mean["map", 80] < 0.85 * mean["baseline", 80]
    assert mean["map", 3] > mean["baseline", 3]
    assert {path.name for path in folder.glob("*/*.svg")} == {"answer.svg", "one_walker.svg"}


def test_it_keeps_files_of_others(folder: Path, tmp_path: Path) -> None:
    names = [
        path.relative_to(folder) for part in ("answer", "one_walker") for path in (folder / part).rglob("*.*")
    ]
    assert names
    for name in names:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("of others")
    done = run(tmp_path)
    assert done.returncode == 1, done.stdout
    assert {(tmp_path / name).read_text() for name in names} == {"of others"}


def test_the_commands_of_its_prose_compose() -> None:
    multirun = re.findall(r'make run ARGS="-m ([^"]+)"', TUTORIAL)
    single = re.findall(r"`python -m pipeline ([^`]+)`", TUTORIAL)
    assert len(multirun) == len(single) == 1
    for words in (*multirun, *single):
        assert compose(shlex.split(re.sub(r"=(\w+),\S*", r"=\1", words))).name == "zhang2007_fig5"
