"""Test of smoke-scale sweeps that are killed repeatedly: their tables must equal those of an uninterrupted sweep.

``python -m tests.kills [COUNT] [FIGURE,FIGURE …]``: makes figures once undisturbed, then kills sweeps, COUNT in all, by
turns with Ctrl-C, SIGTERM and SIGKILL, each after another number of finished stages.  After each kill no process is
left and whatever stands under its final name is whole; after each sweep that ends by itself its bytes are those of the
first, and nothing temporary is left.  Moments are counted in finished stages, not in seconds.
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pipeline.storage.agreement import TIMING
from pipeline.storage.sealed_folders import complaints_about
from tests.processes import WAIT_S, started

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)


def finished(results: Path) -> Iterator[Path]:
    """Yield the folders of finished artefacts and figures."""
    for pattern in ("cache/[!.]*", "*/smoke/[!.]*"):
        yield from (path for path in results.glob(pattern) if path.is_dir() and path.name != "damaged")


def tables(results: Path) -> dict[str, bytes]:
    """Return tables and arrays of all figures as bytes, without tables of durations."""
    result = {}
    for path in results.glob("*/smoke/*/*"):
        name = path.relative_to(results).as_posix()
        if path.suffix == ".csv" and not path.name.startswith(TIMING):
            result[name] = path.read_bytes()
        elif path.suffix == ".npz":
            with np.load(path, allow_pickle=False) as stored:
                result |= {f"{name}: {owner}": stored[owner].tobytes() for owner in stored.files}
    return result


def require_whole(results: Path) -> None:
    """Require that every finished folder contains all files that its manifest lists."""
    wrong = {path.name: described for path in finished(results) if (described := complaints_about(path))}
    assert not wrong, wrong


def require_tidy(results: Path) -> None:
    """Require that no temporary file, lock or damaged artefact remains."""
    assert not list(results.rglob(".*"))
    assert not (results / "cache" / "damaged").exists()


def running(group: int) -> list[str]:
    """Return the running processes of a process group, without zombies."""
    result = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            pid, _, rest = path.read_text(encoding="utf-8").partition(" ")
        except OSError:
            continue
        state, _, its_group, *_ = rest.rpartition(")")[2].split()
        if int(its_group) == group and state not in "ZX":
            result.append(pid)
    return result


def sweep(results: Path, figures: str, *, kill_after: int | None, number: int) -> bool:
    """Compute the figures and kill the sweep after a number of stages; return whether it ended before the kill."""
    command = [sys.executable, "-m", "pipeline", "figures", "scale=smoke", f"results={results}", "workers=2"]
    command += [f"experiment={figures}"] if figures else []
    before = len(list(finished(results)))
    with started(command) as process:
        while process.poll() is None:
            if kill_after is not None and len(list(finished(results))) >= before + kill_after:
                # Ctrl-C of a terminal goes to all processes, the others to the program alone.
                (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
                kill_after = None
                process.wait(WAIT_S)
                break
            time.sleep(0.005)
        else:
            assert process.returncode == 0, process.stderr.read() if process.stderr else ""
            return True
        for _ in range(2000):  # a worker whose parent was killed ends with it
            if not (left := running(process.pid)):
                break
            time.sleep(0.01)
        assert not left, f"left running: {left}"
        require_whole(results)
        # By the signal itself: before the program had begun, or by SIGKILL.
        assert process.returncode in (0, 130, -number), process.returncode
        if process.returncode >= 0:
            require_tidy(results)
    return False


def main(count: int, figures: str) -> None:
    """Kill sweeps `count` times, and print the numbers of kills and sweeps."""
    draw = np.random.default_rng(count)
    with tempfile.TemporaryDirectory(prefix="kills-") as folder:
        whole = Path(folder) / "whole"
        assert sweep(whole, figures, kill_after=None, number=0)
        expected = tables(whole)
        require_tidy(whole)
        share = len(list(finished(whole))) // 3  # of the stages, at most, before the next kill
        kills = sweeps = 0
        while kills < count:
            results = Path(folder) / f"killed{sweeps}"
            while True:
                number = SIGNALS[kills % len(SIGNALS)]
                after = int(draw.integers(0, share)) if kills < count else None
                if sweep(results, figures, kill_after=after, number=number):
                    break
                kills += 1
                print(f"{kills}: {signal.Signals(number).name} after {after} stages", flush=True)
            require_whole(results)
            require_tidy(results)
            output = tables(results)
            assert output.keys() == expected.keys()
            differ = [name for name in output if output[name] != expected[name]]
            assert not differ, differ
            sweeps += 1
        print(f"{kills} kills, {sweeps} sweeps to the end: the same bytes in {len(expected)} files")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40, sys.argv[2] if len(sys.argv) > 2 else "")
