"""Test of commands that read the project's own files, after a file was damaged and its checksum was made to match.

``python -m tests.hostile N=5000 SEED=1 [TARGET …]`` damages N files and prints the counts by target and every failure.
A run is a fork that an alarm ends.  It fails if it prints a traceback, hangs, or changes a file outside its folder.
"""

from __future__ import annotations

import csv
import gzip
import io
import json
import os
import resource
import shutil
import signal
import sys
import tempfile
import traceback
import warnings
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.storage.archive import CHECKSUMS
from pipeline.storage.sealed_folders import MANIFEST, compact, digest
from tests.formats.samples import Damage, json_tree, npz, text

ALARM_S = 120
"""Seconds after which a run counts as hanging; a normal run takes a few seconds even on a busy machine."""
ACCEPTED, REJECTED, TRACEBACK, HANG, OUTSIDE = "accepted", "rejected", "traceback", "hang", "outside"
FAILURES = (TRACEBACK, HANG, OUTSIDE)
BOMB = gzip.compress(bytes(58_000_000))
"""Compressed data of 58 kB that expand to 58 MB."""
_CELLS = (
    "",
    "nan",
    "inf",
    "-1",
    "1e308",
    "9" * 30,
    "x",
    "=1+1",
    "'",
    "../x",
    "a,b",
    '"',
    "é",
    "True",
    "0",
    " ",
    "-0",
)


@dataclass(frozen=True)
class Target:
    """Kind of file to damage, with the command that reads it.

    Attributes
    ----------
    name : str
    build : callable
        Writes the correct files into a folder.
    damaged : str
        Pattern of the files that are damaged, in that folder.
    command : callable
        Reads the folder and returns an exit status.
    """

    name: str
    build: Callable[[Path], object]
    damaged: str
    command: Callable[[Path], int]


@dataclass(frozen=True)
class Result:
    """Outcome of one run: its seed, the damage, and the last line that the command printed."""

    target: str
    seed: int
    way: str
    outcome: str
    words: str


def table(original: bytes, rng: np.random.Generator) -> bytes:
    """Return a CSV file with a changed cell, name, row or column, or with changed bytes."""
    if rng.random() < 0.3:
        return text(original, rng)
    rows = list(csv.reader(io.StringIO(original.decode())))
    n = int(rng.integers(len(rows[0])))
    match rng.integers(5):
        case 0:
            rows = [[*row[:n], *row[n + 1 :]] for row in rows]
        case 1:
            rows = rows[: int(rng.integers(1, len(rows) + 1))]
        case 2:
            word = str(rng.choice(_CELLS))
            rows[1:] = [[*row[:n], word, *row[n + 1 :]] for row in rows[1:]]
        case _:
            rows[int(rng.integers(len(rows)))][n] = str(rng.choice(_CELLS))
    written = io.StringIO()
    csv.writer(written, lineterminator="\n").writerows(rows)
    return written.getvalue().encode()


def packed_table(original: bytes, rng: np.random.Generator) -> bytes:
    if rng.random() < 0.3:
        return text(original, rng)
    return gzip.compress(table(gzip.decompress(original), rng), mtime=0)


def manifest(original: bytes, rng: np.random.Generator) -> bytes:
    facts = json.loads(original)
    facts.pop("seal", None)
    return json_tree(json.dumps(facts).encode(), rng)


def arrays(original: bytes, rng: np.random.Generator) -> bytes:
    """Return an NPZ file with a changed array, shape or type, or with changed bytes."""
    if len(original) < 100:  # no member
        return text(original, rng)
    with zipfile.ZipFile(io.BytesIO(original)) as before:
        stored = before.infolist()[0].compress_type == zipfile.ZIP_STORED
    damaged = npz(original, rng)
    with suppress(zipfile.BadZipFile, ValueError, EOFError, NotImplementedError, zlib.error):
        with zipfile.ZipFile(io.BytesIO(damaged)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_STORED if stored else zipfile.ZIP_DEFLATED) as archive:
            for name, data in members.items():
                archive.writestr(name, data)
        return packed.getvalue()
    return damaged


def video(original: bytes, rng: np.random.Generator) -> bytes:
    """Return a film with changed bytes, mainly in its index, with a changed frame size, or with its end missing."""
    copy = bytearray(original)
    index = max(original.find(b"moov"), 0)
    for _ in range(int(rng.integers(1, 6))):
        at = int(rng.integers(index, len(copy)) if rng.random() < 0.7 else rng.integers(len(copy)))
        if rng.random() < 0.5:
            copy[at] = rng.integers(256)
        else:
            extremes = np.array([0, 1, 2**31 - 1, 2**32 - 1, 2**16], ">u4")
            copy[at : at + 4] = rng.choice(extremes).tobytes()
    if rng.random() < 0.2:
        del copy[int(rng.integers(len(copy))) :]
    return bytes(copy)


_BY_SUFFIX: dict[str, Damage] = {
    ".csv": table, ".gz": packed_table, ".npz": arrays, ".json": json_tree, ".mp4": video
}  # fmt: skip


def _as_bomb(path: Path) -> None:
    content = BOMB
    if path.suffix == ".json":
        content = b"[" * 58_000
    elif path.suffix == ".npz":
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("mean.npy", bytes(58_000_000))
        content = packed.getvalue()
    path.write_bytes(content)


SPECIAL: dict[str, Callable[[Path], object]] = {
    "pipe": os.mkfifo,
    "link to itself": lambda path: path.symlink_to(path.name),
    "link to nothing": lambda path: path.symlink_to("nothing"),
    "folder": Path.mkdir,
    "bomb": _as_bomb,
    "empty": Path.touch,
}
"""Objects that replace a file under the file's name, such as a folder; `spoil` also makes symbolic links."""


def spoil(path: Path, outside: Path, seed: int) -> str:
    """Damage a file in a random way, and return the name of the damage."""
    rng = np.random.default_rng(seed)
    if rng.random() < 0.15:
        way = str(rng.choice([*SPECIAL, "link"]))
        if way == "link":
            shutil.copyfile(path, outside / path.name)
        path.unlink()
        path.symlink_to(outside / path.name) if way == "link" else SPECIAL[way](path)
        return way
    damage = manifest if path.name == MANIFEST else _BY_SUFFIX.get(path.suffix, text)
    path.write_bytes(damage(path.read_bytes(), rng))
    return damage.__name__


def reseal(root: Path) -> None:
    """Recompute every checksum below a folder, so that it matches the damaged files."""
    nearest_last = sorted(root.rglob(MANIFEST), key=lambda path: -len(path.parts))
    for path in (each for each in nearest_last if each.parent != root):
        _reseal(path)
    sums = root / CHECKSUMS
    if sums.is_file():
        lines = [line.split("  ", 1) for line in sums.read_text("utf-8", "replace").split("\n")]
        for line in lines:
            if len(line) == 2 and "\0" not in line[1] and len(line[0]) == 64 and (root / line[1]).is_file():
                line[0] = digest((root / line[1]).read_bytes())
        sums.write_text("\n".join("  ".join(line) for line in lines), "utf-8")
    _reseal(root / MANIFEST)


def _reseal(path: Path) -> None:
    with suppress(OSError, ValueError, TypeError, AttributeError, RecursionError):
        facts = json.loads(path.read_bytes() if path.is_file() else b"")
        facts.pop("seal", None)
        for name, fact in facts["files"].items() if isinstance(facts.get("files"), dict) else ():
            with suppress(OSError, ValueError, TypeError):
                content = (path.parent / name).read_bytes() if (path.parent / name).is_file() else b""
                fact |= {"bytes": len(content), "sha256": digest(content)} if content else {}
                if name == "model.npz" and "sha256" in facts and content:
                    facts["sha256"] = digest(content)
        path.write_text(json.dumps({**facts, "seal": digest(compact(facts))}))


def run(target: Target, template: Path, arena: Path, seed: int) -> Result:
    """Damage one file in a copy of a template folder, run the command on the copy, and return the outcome."""
    inside, outside, log = arena / "a" / "b" / "inside", arena / "outside", arena / "log"
    for folder in (inside, outside, arena / "a"):
        shutil.rmtree(folder, ignore_errors=True)
    for folder in (outside, inside.parent, arena / "tmp"):
        folder.mkdir(parents=True, exist_ok=True)
    shutil.copytree(template, inside)
    files = sorted(path for path in inside.glob(target.damaged) if path.is_file())
    chosen = files[int(np.random.default_rng([seed, 1]).integers(len(files)))]
    way = f"{chosen.relative_to(inside)}, {spoil(chosen, outside, seed)}"
    reseal(inside)
    before = _state(arena, inside, log)
    status = forked(target.command, inside, arena, log)
    words = log.read_text("utf-8", "replace").strip()
    last = words.splitlines()[-1] if words else ""
    if _state(arena, inside, log) != before:
        return Result(target.name, seed, way, OUTSIDE, str(_state(arena, inside, log) ^ before))
    if os.WIFSIGNALED(status):
        hung = os.WTERMSIG(status) == signal.SIGALRM
        return Result(target.name, seed, way, HANG if hung else TRACEBACK, f"signal {os.WTERMSIG(status)}")
    if "Traceback" in words or os.WEXITSTATUS(status) not in (0, 1):
        return Result(target.name, seed, way, TRACEBACK, words[-3000:])
    return Result(target.name, seed, way, REJECTED if os.WEXITSTATUS(status) else ACCEPTED, last)


def _state(arena: Path, inside: Path, log: Path) -> set[tuple[str, str]]:
    """Return all paths outside the folder of a run, with the digests of the files."""
    paths = [path for path in arena.rglob("*") if path not in (inside, log) and inside not in path.parents]
    return {(str(path), digest(path.read_bytes()) if path.is_file() else "") for path in paths}


def forked(command: Callable[[Path], int], inside: Path, arena: Path, log: Path) -> int:
    """Run a command in a forked process, with its output in a file, and return the wait status of the process."""
    sys.stdout.flush()
    sys.stderr.flush()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of forks in a process with threads
        child = os.fork()
    if child:
        return os.waitpid(child, 0)[1]
    try:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(ALARM_S)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        output = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        for stream in (1, 2):
            os.dup2(output, stream)
        sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)  # noqa: SIM115
        tempfile.tempdir = str(arena / "tmp")
        os.chdir(inside)
        try:
            status = command(inside)
        except BaseException:
            traceback.print_exc()
            status = 70
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    finally:
        os._exit(71)


def fuzz(targets: Iterable[Target], n: int, seed: int, folder: Path) -> list[Result]:
    """Damage `n` files in total, in equal numbers for each target, and return the outcomes."""
    results = []
    targets = list(targets)
    for number, target in enumerate(targets):
        template, arena = folder / f"template{number}", folder / "arena"
        (arena / "tmp").mkdir(parents=True, exist_ok=True)
        target.build(template)
        whole = forked(target.command, shutil.copytree(template, arena / "whole"), arena, arena / "log")
        assert whole == 0, (target.name, whole, (arena / "log").read_text("utf-8", "replace"))
        shutil.rmtree(arena)
        for k in range(number, n, len(targets)):
            results.append(run(target, template, arena, seed * 1_000_003 + k))
            if results[-1].outcome in FAILURES:
                print(f"{results[-1]}\n{results[-1].words}", flush=True)
        counts = Counter(result.outcome for result in results if result.target == target.name)
        print(f"{target.name}: {dict(counts)}", flush=True)
        shutil.rmtree(arena)
    return results


def main(arguments: list[str]) -> int:
    """Run the test with the given arguments; return 1 if a command behaved wrongly."""
    from tests.hostile_targets import targets

    options = dict(item.split("=", 1) for item in arguments if "=" in item)
    words = [item for item in arguments if "=" not in item]
    with tempfile.TemporaryDirectory(prefix="hostile-") as folder:
        chosen = [t for t in targets(Path(folder)) if not words or any(word in t.name for word in words)]
        results = fuzz(chosen, int(options.get("N", "5000")), int(options.get("SEED", "1")), Path(folder))
    if "SENTENCES" in options:
        lines = sorted({f"{r.target}: {r.words}" for r in results if r.outcome == REJECTED})
        Path(options["SENTENCES"]).write_text("\n".join(lines) + "\n", "utf-8")
    counts = Counter(result.outcome for result in results)
    print(
        f"{len(results)} mutations: " + ", ".join(f"{counts[o]} {o}" for o in (ACCEPTED, REJECTED, *FAILURES))
    )
    return int(any(counts[outcome] for outcome in FAILURES))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
