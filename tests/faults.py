"""Test of commands in which one call to the file system fails, for each call of each command.

``python -m tests.faults [N=…] [SEED=…] [COMMAND …]`` counts the calls of a figure, a reconstruction and an archive,
and lets the n-th ``open``, ``write``, ``rename``, ``fsync``, ``mkdir`` or ``unlink`` fail with ENOSPC, EIO or EINTR:
every one, or N of them.  Afterwards the old result or the new one is there and whole, the command has printed why in
one sentence, and the same command without a fault gives the new result and leaves nothing else.
"""

from __future__ import annotations

import builtins
import errno
import io
import json
import os
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.cli import main as program
from pipeline.storage.sealed_folders import MANIFEST, complaints_about, read_manifest, write_manifest
from tests.hostile import forked
from tests.hostile_targets import FIGURE, command, kept_run, make_figure, of_commit
from tests.walk3d.film.reconstruct.walks import alphapose, in_layout
from tests.walk3d.film.walk.walkers import clip
from walk3d.film import keypoints as keypoints_of_a_file
from walk3d.film.reconstruct import writing
from walk3d.film.reconstruct.clip import Input, reconstruct_clip
from walk3d.film.reconstruct.model_file import SHIPPED

CALLS = ("open", "write", "rename", "fsync", "mkdir", "unlink")
ERRORS = (errno.ENOSPC, errno.EIO, errno.EINTR)
OURS, THEIRS = "old.csv", "notes.txt"
"""Name of a file in the older result, and name of a file that the user put next to it."""


class _Raw(io.FileIO):
    """File that counts its write operations, and fails at the operation that the test has chosen."""

    def write(self, data: Any) -> int:
        _Faults.now.call("write", self.name)
        return super().write(data)


class _Faults:
    """Counter of file-system calls below a folder, with the one call that is to fail."""

    now: _Faults

    def __init__(self, root: Path, call: str = "", turn: int = -1, error: int = 0) -> None:
        self.root, self.fails, self.counts = root, (call, turn, error), Counter[str]()

    def call(self, name: str, path: Any) -> None:
        """Count a file-system call, and raise the error if this call is to fail."""
        if isinstance(path, int):
            path = Path(f"/proc/self/fd/{path}").readlink()
        if not Path.cwd().joinpath(os.fsdecode(path)).is_relative_to(self.root):
            return
        self.counts[name] += 1
        failing, turn, error = self.fails
        if (name, self.counts[name]) == (failing, turn):
            raise OSError(error, os.strerror(error), None if name in ("write", "fsync") else path)

    @contextmanager
    def injected(self) -> Iterator[None]:
        """Replace Python's file-system functions by functions that count their calls and fail once."""
        _Faults.now = self
        plain_open, plain = io.open, {name: getattr(os, name) for name in _SYSTEM}

        def opened(file: Any, mode: str = "r", *rest: Any, **options: Any) -> Any:
            if isinstance(file, int):
                return plain_open(file, mode, *rest, **options)
            self.call("open", file)
            if not set(mode) & set("wxa") or "+" in mode:
                return plain_open(file, mode, *rest, **options)
            stream: Any = io.BufferedWriter(_Raw(file, mode.replace("b", "").replace("t", "")))
            if "b" in mode:
                return stream
            names = ("buffering", "encoding", "errors", "newline")
            options = dict(zip(names, rest, strict=False)) | options
            return io.TextIOWrapper(stream, *(options.get(name) for name in names[1:]))

        def counted(name: str) -> Callable[..., Any]:
            def function(path: Any, *rest: Any, **options: Any) -> Any:
                if options.get("dir_fd") is None:
                    self.call(_SYSTEM[name], path)
                return plain[name](path, *rest, **options)

            return function

        builtins.open = io.open = opened
        for name in _SYSTEM:
            setattr(os, name, counted(name))
        try:
            yield
        finally:
            builtins.open = io.open = plain_open
            for name, function in plain.items():
                setattr(os, name, function)


_SYSTEM = {"open": "open", "rename": "rename", "replace": "rename", "fsync": "fsync", "mkdir": "mkdir",
           "unlink": "unlink", "remove": "unlink"}  # fmt: skip
"""Functions of `os` that are counted, each with the kind of call under which it is counted."""


@dataclass(frozen=True)
class Case:
    """Command to test, with its result folder and a function that prepares an older result.

    Attributes
    ----------
    name : str
    build : callable
        Writes the inputs and the old result into a folder.
    result : str
        Path of the result in that folder.
    run : callable
        Runs the command on that folder and returns the exit status.
    """

    name: str
    build: Callable[[Path], object]
    result: str
    run: Callable[[Path], int]


def cases(folder: Path) -> list[Case]:
    """Return the commands to test; their inputs are written to `folder`."""
    whole = make_figure(folder / "whole")
    figure = whole / "synthetic" / "smoke" / FIGURE
    walk = folder / "walk"
    reconstruct = _film(walk)

    def figure_before(to: Path) -> None:
        _old(figure, to / "synthetic" / "smoke" / FIGURE)

    def walk_before(to: Path) -> None:
        shutil.copytree(walk, to)
        _old(walk / "out", to / "out")

    def run_before(to: Path) -> None:
        shutil.copytree(figure, to / "synthetic" / FIGURE)
        of_commit(to / "synthetic" / FIGURE)

    small = ("scale=smoke", f"experiment={FIGURE}")
    return [
        Case("figure", figure_before, f"synthetic/smoke/{FIGURE}", lambda to: command(*small, to)),
        Case("reconstruct", walk_before, "out", reconstruct),
        Case("archive", run_before, "archive/a/synthetic", kept_run),
    ]


def _film(to: Path) -> Callable[[Path], int]:
    """Write keypoints of a simulated walk, and return a command that uses a reconstruction computed in advance."""
    to.mkdir()
    alphapose(to / "walk.json", in_layout(clip(60.0), "coco17"))
    options = Input(path=str(to / "walk.json"), frame_rate_hz=30.0, width=1920, height=1080)
    walk = reconstruct_clip(options, SHIPPED)

    def reconstruct(inside: Path) -> int:
        def again(keypoints: Input, model: Path) -> Any:
            keypoints_of_a_file.read(keypoints.path)
            return walk

        writing.reconstruct_clip = again
        return _reconstruct(inside)

    assert _reconstruct(to) == 0
    return reconstruct


def _reconstruct(to: Path) -> int:
    facts = ["input.frame_rate_hz=30", "input.width=1920", "input.height=1080", "output.recording=false"]
    return program.main(["reconstruct", str(to / "walk.json"), f"output.path={to / 'out'}", *facts])


def _old(result: Path, to: Path) -> None:
    """Write an older result that contains a further file of the program and a file of the user."""
    shutil.copytree(result, to, dirs_exist_ok=True)
    (to / OURS).write_text("a\n1\n")
    facts = read_manifest(to)
    del facts["files"]
    write_manifest(to, facts)
    (to / THEIRS).write_text("mine\n")


def failures(case: Case, template: Path, arena: Path, fault: tuple[str, int, int]) -> list[str]:
    """Run a command with one failing call, run it again without a failure, and return the errors of both runs."""
    inside, log = arena / "inside", arena / "log"
    shutil.rmtree(inside, ignore_errors=True)
    shutil.copytree(template, inside, symlinks=True)
    result = inside / case.result
    before = result.exists()

    def with_fault(folder: Path) -> int:
        with _Faults(folder, *fault).injected():
            return case.run(folder)

    wrong = []
    status = os.waitstatus_to_exitcode(forked(with_fault, inside, arena, log))
    words = log.read_text("utf-8", "replace").strip()
    if status not in (0, 1) or "Traceback" in words:
        wrong.append(f"status {status}: {words[-1500:]}")
    elif status and not words:
        wrong.append("nothing is printed")
    if before != result.exists() and status:
        wrong.append(
            f"the result was {'there' if before else 'missing'} and is {'there' if not before else 'missing'}"
        )
    if result.exists() and (complaints := complaints_about(result)):
        wrong.append(f"neither old nor new: {complaints[0]}")
    if before and not _mine(result):
        wrong.append("a person's file is lost")
    status = os.waitstatus_to_exitcode(forked(case.run, inside, arena, log))
    words = log.read_text("utf-8", "replace").strip()
    if status or not (result / MANIFEST).is_file() or complaints_about(result) or (result / OURS).exists():
        wrong.append(f"the same command does not continue: {status}: {words[-1500:]}")
    if before and not _mine(result):
        wrong.append("a person's file is lost in the end")
    if left := [str(path.relative_to(inside)) for path in inside.rglob(".*") if ".lock" not in path.name]:
        wrong.append(f"left: {left}")
    return wrong


def _mine(result: Path) -> bool:
    """Return whether the user's file is still in the result, or in the older result that was renamed."""
    return any(path.read_text() == "mine\n" for path in result.parent.glob(f"*{result.name}/{THEIRS}"))


def calls_of(case: Case, template: Path, arena: Path) -> Counter[str]:
    """Return the number of file-system calls of each kind in a run without failing calls."""
    shutil.rmtree(arena / "inside", ignore_errors=True)
    inside = Path(shutil.copytree(template, arena / "inside"))

    def counting(folder: Path) -> int:
        faults = _Faults(folder)
        with faults.injected():
            status = case.run(folder)
        (arena / "counts").write_text(json.dumps(faults.counts))
        return status

    status = forked(counting, inside, arena, arena / "log")
    assert status == 0, (case.name, (arena / "log").read_text("utf-8", "replace"))
    return Counter(json.loads((arena / "counts").read_text()))


def inject(n: int, seed: int, folder: Path, names: list[str]) -> list[str]:
    """Let `n` file-system calls of each command fail, one per run (all calls if `n` is 0); return the errors."""
    wrong = []
    for case in cases(folder):
        if names and case.name not in names:
            continue
        template, arena = folder / f"template-{case.name}", folder / "arena"
        (arena / "tmp").mkdir(parents=True, exist_ok=True)
        case.build(template)
        counts = calls_of(case, template, arena)
        faults = [
            (call, turn, error)
            for call in CALLS
            for turn, error in product(range(1, counts[call] + 1), ERRORS)
        ]
        if n:
            drawn = np.random.default_rng(seed).permutation(len(faults))[:n]
            faults = [faults[k] for k in sorted(drawn)]
        bad: Counter[str] = Counter()
        for fault in faults:
            for complaint in failures(case, template, arena, fault):
                call, turn, error = fault
                bad[call] += 1
                wrong.append(
                    f"{case.name}, {call} {turn} of {counts[call]}, {errno.errorcode[error]}: {complaint}"
                )
                print(wrong[-1], flush=True)
        done = Counter(call for call, _, _ in faults)
        words = ", ".join(f"{call} {done[call]} ({bad[call]} wrong)" for call in CALLS)
        print(f"{case.name}: {len(faults)} faults: {words}", flush=True)
        shutil.rmtree(arena)
    return wrong


def main(arguments: list[str]) -> int:
    """Run the test with the given arguments; return 1 if a command behaved wrongly."""
    options = dict(item.split("=", 1) for item in arguments if "=" in item)
    with tempfile.TemporaryDirectory(prefix="faults-") as folder:
        names = [item for item in arguments if "=" not in item]
        return int(
            bool(inject(int(options.get("N", "0")), int(options.get("SEED", "1")), Path(folder), names))
        )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
