"""`gait_pipeline`, the package under another name, and the types that a user's own program is checked against."""

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
    said = finished([sys.executable, "analysis.py"], cwd=tmp_path)
    assert (said.stdout, said.stderr) == ("pipeline.api\n", "")
    said = finished([sys.executable, "-m", "gait_pipeline", "--version"], cwd=tmp_path)
    assert said.stdout.startswith("gait-pipeline "), said.stderr


def test_a_pipeline_of_the_users_own_that_is_loaded_is_reported(tmp_path: Path) -> None:
    (tmp_path / "pipeline.py").write_text("", encoding="utf-8")
    said = finished([sys.executable, "-c", "import pipeline, gait_pipeline"], cwd=tmp_path)
    assert "ImportError: another module called pipeline is loaded" in said.stderr


RIGHT = """
from pathlib import Path

import gait_pipeline
import pipeline
from pipeline import InvalidInput, fit, from_view, joints, read, represent

version: str = pipeline.__version__
positions, valid = joints(read(Path("a.c3d")))
walks = [represent("a.c3d"), represent("b.c3d")]
completed = from_view(fit(walks), walks[0], 30.0, hidden=["left_wrist"])
rate: float = walks[0].frequency_hz
try:
    walk, summary = pipeline.reconstruct("film.json", frame_rate_hz=30)
    print(walk.best, summary["verdict"])
except InvalidInput as error:
    print(error)
print(gait_pipeline.fit(walks).components.shape)
"""


def checked(folder: Path, code: str) -> subprocess.CompletedProcess[str]:
    """What ``mypy --strict`` says of a user's program; of the package's own sources nothing."""
    (folder / "program.py").write_text(code, encoding="utf-8")
    return subprocess.run(
        [
            sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", "--ignore-missing-imports",
            "--cache-dir", str(folder.parent / "mypy_cache"), "program.py",
        ],
        cwd=folder, env={"MYPYPATH": str(ROOT), "PATH": ""}, capture_output=True, text=True, timeout=WAIT_S,
    )  # fmt: skip


@pytest.mark.thorough
def test_a_users_program_is_checked_against_our_types(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    right = checked(tmp_path, RIGHT)
    assert right.returncode == 0, right.stdout + right.stderr
    wrong = checked(tmp_path, 'from pipeline import fit, read\n\nfit(3)\nread("a.c3d").frame_rate\n')
    assert [line.rpartition("  ")[2] for line in wrong.stdout.splitlines()[:2]] == [
        "[arg-type]",
        "[attr-defined]",
    ]
