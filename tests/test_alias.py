"""Tests of the package name `gait_pipeline`, and of the type annotations that a user's program is checked against."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.processes import ROOT, WAIT_S, finished

SCRIPT = """
import gait_pipeline
import gait_pipeline.core.fourier as series
from gait_pipeline import InvalidInput, fit
from gait_pipeline.core import linear_model
from pipeline.core import fourier

import pipeline.validation

assert series is fourier
assert InvalidInput is pipeline.validation.InvalidInput
assert linear_model.__name__ == "pipeline.core.linear_model"
assert gait_pipeline.__version__ == pipeline.__version__
print(fit.__module__)
"""


def test_a_pipeline_of_the_users_own_does_not_hide_ours(tmp_path: Path) -> None:
    (tmp_path / "pipeline.py").write_text("raise SystemExit('mine')\n", encoding="utf-8")
    (tmp_path / "analysis.py").write_text(SCRIPT, encoding="utf-8")
    message = finished([sys.executable, "analysis.py"], cwd=tmp_path)
    assert (message.stdout, message.stderr) == ("pipeline.api\n", "")
    message = finished([sys.executable, "-m", "gait_pipeline", "--version"], cwd=tmp_path)
    assert message.stdout.startswith("gait-pipeline "), message.stderr


def test_a_pipeline_of_the_users_own_that_is_loaded_is_reported(tmp_path: Path) -> None:
    (tmp_path / "pipeline.py").write_text("", encoding="utf-8")
    message = finished([sys.executable, "-c", "import pipeline, gait_pipeline"], cwd=tmp_path)
    assert "ImportError: another module called pipeline is loaded" in message.stderr


RIGHT = """
from pathlib import Path

import gait_pipeline
import pipeline
import walk3d
from pipeline import InvalidInput, fit, from_view, joints, read, represent

version: str = pipeline.__version__
positions, valid = joints(read(Path("a.c3d")))
walks = [represent("a.c3d"), represent("b.c3d")]
completed = from_view(fit(walks), walks[0], 30.0, hidden=["left_wrist"])
rate: float = walks[0].frequency_hz
try:
    walk, summary = walk3d.reconstruct("film.json", frame_rate_hz=30)
    print(walk.best, summary["verdict"])
except InvalidInput as error:
    print(error)
print(gait_pipeline.fit(walks).components.shape)
"""


WRONG = """
from pipeline import fit, read

fit(3)
read("a.c3d").frame_rate
"""


@pytest.mark.thorough
def test_users_programs_are_checked_against_our_types(tmp_path: Path) -> None:
    """``mypy --strict`` reports no error in the package or in a correct user program."""
    pytest.importorskip("mypy")
    for name, code in (("right", RIGHT), ("wrong", WRONG)):
        (tmp_path / f"{name}.py").write_text(code, encoding="utf-8")
    message = subprocess.run(
        [
            sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", "--ignore-missing-imports",
            "--cache-dir", str(tmp_path / "mypy_cache"), "right.py", "wrong.py",
        ],
        cwd=tmp_path, env={"MYPYPATH": str(ROOT), "PATH": ""}, capture_output=True, text=True, timeout=WAIT_S,
    )  # fmt: skip
    *errors, count = message.stdout.splitlines()
    assert [(line.partition(":")[0], line.rpartition("  ")[2]) for line in errors] == [
        ("wrong.py", "[arg-type]"),
        ("wrong.py", "[attr-defined]"),
    ], message.stdout + message.stderr
    assert count == "Found 2 errors in 1 file (checked 2 source files)"
