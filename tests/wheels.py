"""Build and installation of the project's wheel from tracked files, with locked packages only."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tests.processes import ROOT

PIP = ("-m", "pip", "--quiet", "--disable-pip-version-check")


def build(source: Path, to: Path, umask: int) -> Path:
    """Build a wheel from a copy of the tracked files under the given umask, with the setuptools of ``.venv``."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    before = os.umask(umask)
    try:
        for name in listed.splitlines():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes((ROOT / name).read_bytes())
        options = ["--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", str(to)]
        subprocess.run(
            [sys.executable, *PIP, "wheel", *options, str(source)],
            check=True,
            env=os.environ | {"SOURCE_DATE_EPOCH": "1700000000"},
        )
    finally:
        os.umask(before)
    (wheel,) = to.glob("*.whl")
    return wheel


def install(wheel: Path, folder: Path) -> Path:
    """Install a wheel and its locked packages in a new environment; return the path of its Python."""
    subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    python = folder / "bin" / "python"
    lock = ["--require-hashes", "-r", str(ROOT / "requirements-light.lock")]
    subprocess.run([str(python), *PIP, "install", *lock], check=True)
    # pip would fetch what the wheel needs and the lock lacks: it must find nothing.
    subprocess.run([str(python), *PIP, "install", "--no-index", str(wheel)], check=True)
    return python
