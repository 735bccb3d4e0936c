"""Time and peak memory of a computation in a separate process."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

PER_MEGABYTE = 2**20 if sys.platform == "darwin" else 2**10


@dataclass(frozen=True)
class Used:
    """Time and peak memory of a process and its child processes.

    Attributes
    ----------
    wall_s, cpu_s : float
    peak_mb : float
        The largest resident memory of any one process.
    output : str
    """

    wall_s: float
    cpu_s: float
    peak_mb: float
    output: str


def run(arguments: Sequence[str], folder: Path) -> Used:
    """Run Python with these arguments in a folder, from which it also imports; return its time and memory.

    Raises
    ------
    SystemExit
        If it fails: half a comparison is none.
    """
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    started = time.perf_counter()
    child = subprocess.Popen(
        [sys.executable, *arguments], cwd=folder, env=environment, stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    output = child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"python {' '.join(arguments)} ended with exit status {child.returncode}")
    wall_s = time.perf_counter() - started
    return Used(wall_s, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / PER_MEGABYTE, output)
