"""Tests that the notebooks run without a warning in an empty folder, and print the values that they compute."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.py"))

pytestmark = pytest.mark.thorough


def run(notebook: Path, folder: Path) -> str:
    """Run a notebook in a folder, and return its printed output."""
    done = subprocess.run(
        [sys.executable, "-W", "error", str(notebook)],
        env={**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"},
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def values_of(output: str) -> dict[str, float]:
    """Return the numbers at the ends of printed lines, by the words before each number."""
    numbers = re.findall(r"^(\w[\w ]*?):? +(-?[\d.]+)(?: mm|°)?$", output, re.MULTILINE)
    return {name: float(value) for name, value in numbers}


def test_there_are_three() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["own_film", "own_method", "own_recordings"]


def test_own_recordings(tmp_path: Path) -> None:
    values = values_of(run(ROOT / "notebooks" / "own_recordings.py", tmp_path))
    assert values["shipped"] < values["map"]
    assert values["shipped model"] < values["own people"]
    assert 40 < values["largest flexion of the left knee"] < 90
    assert (tmp_path / "reconstructed.c3d").is_file()


def test_own_method(tmp_path: Path) -> None:
    values = values_of(run(ROOT / "notebooks" / "own_method.py", tmp_path))
    assert {"nearest", "map", "least_squares", "average_walker"} <= set(values)


def test_own_film(tmp_path: Path) -> None:
    output = run(ROOT / "notebooks" / "own_film.py", tmp_path)
    assert output.startswith("walk\n")
    assert "'angles.csv'" in output
    assert "steps/min" in output
