"""Small defects, planted one at a time in a copy of the tree: do the tests of their rows notice?

python -m tests.planted [N | WORD ...]
    Plant every row of ``tests/planted.csv``; N of them, drawn by the commit that is checked out; or those whose file's
    name holds one of the words.  Exit status 1 if a defect survives its tests.

The tests of a row pass as long as nothing is planted, which is tried first, and none of them is a golden table.
"""

from __future__ import annotations

import csv
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
TABLE = ROOT / "tests" / "planted.csv"


class Defect(NamedTuple):
    """A row: in `file`, `old` becomes `new`; `tests` are modules or tests, separated by spaces."""

    file: str
    old: str
    new: str
    tests: str


def defects() -> list[Defect]:
    """All rows."""
    with TABLE.open(newline="", encoding="utf-8") as stream:
        return [Defect(**row) for row in csv.DictReader(stream)]


def git(*arguments: str) -> str:
    """Return the output of a git command in this tree."""
    return subprocess.run(["git", *arguments], cwd=ROOT, check=True, capture_output=True, text=True).stdout


def chosen(words: Sequence[str]) -> list[Defect]:
    """The rows that the command line asks for."""
    rows = defects()
    if len(words) == 1 and words[0].isdigit():
        commit = git("rev-parse", "HEAD")
        return random.Random(commit).sample(rows, min(int(words[0]), len(rows)))
    return [row for row in rows if not words or any(word in row.file for word in words)]


def status(tree: Path, tests: Sequence[str]) -> int:
    """Exit status of pytest in a copy of the tree: 0 if the tests pass, 1 if one fails."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-m", "not thorough", *tests]
    # With CI hypothesis draws the same examples each time.
    environment = {**os.environ, "CI": "true", "PYTHONPATH": str(tree)}
    return subprocess.run(command, cwd=tree, env=environment, capture_output=True).returncode


def caught(tree: Path, defect: Defect, number: int) -> bool:
    """Plant a defect, run its tests, and take it out again."""
    path = tree / defect.file
    whole, before = path.read_text(encoding="utf-8"), path.stat()
    try:
        path.write_text(whole.replace(defect.old, defect.new), encoding="utf-8")
        # Python and numba tell by the time whether what they compiled is stale.
        os.utime(path, (number, number))
        return status(tree, defect.tests.split()) != 0
    finally:
        path.write_text(whole, encoding="utf-8")
        os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def copied(tree: Path) -> Path:
    """A copy of this tree, as far as it is kept."""
    for name in git("ls-files", "-co", "--exclude-standard").splitlines():
        if (ROOT / name).is_file():
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, tree / name)
    return tree


def main(words: Sequence[str]) -> int:
    """Plant the rows, side by side in a tree for each core, and print what became of each."""
    rows = chosen(words)
    workers = min(os.cpu_count() or 1, 4, len(rows) + 1)
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(workers) as pool:
        trees: Queue[Path] = Queue()
        for number in range(workers):
            trees.put(copied(Path(folder) / f"tree{number}"))

        def in_a_tree(number: int) -> bool:
            tree = trees.get()
            try:
                return caught(tree, rows[number - 1], number) if number else status(tree, unplanted) == 0
            finally:
                trees.put(tree)

        unplanted = sorted({test for row in rows for test in row.tests.split()})
        holds, *result = [pool.submit(in_a_tree, number) for number in range(len(rows) + 1)]
        if not holds.result():
            pool.shutdown(cancel_futures=True)
            print("the tests fail with nothing planted", file=sys.stderr)
            return 2
        for number, (row, first) in enumerate(zip(rows, result, strict=True), start=1):
            print(
                f"{number:3} {'caught  ' if first.result() else 'SURVIVED'} {row.file}: {row.old} -> {row.new}",
                flush=True,
            )
        survived = sum(not first.result() for first in result)
    print(f"{len(rows)} planted, {len(rows) - survived} caught, {survived} survived")
    return int(survived > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
