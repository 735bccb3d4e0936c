"""Mutation testing: insert one generated defect at a time into a copy of the project, and record which tests fail.

python -m tests.mutants SEED N [only=core,formats] [jobs=2] [seconds=45] [again]
    Draw N functions of both packages by the seed, and change one operator, number or argument of each.  Run the
    nearest tests until one fails.  ``results/mutants/SEED.csv`` has a line for each mutant.  A second run continues
    the file; `again` repeats the mutants that survived.  Exit status 1 if fewer than a fifth are noticed, 2 if a test
    that noticed a mutant fails without one.

No golden table is compared.  As a plugin of pytest this module puts the nearest tests first, stops after 45
seconds of processor time, and checks that both packages are imported from the copy.
"""

from __future__ import annotations

import csv
import importlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from itertools import islice
from pathlib import Path
from queue import Queue

import pytest

from tests.mutations import PACKAGES, ROOT, Mutant, draw, package_of
from tests.nearest_tests import NearestTests

MAX_FILES, MAX_SECONDS, MIN_NOTICED = 12, 45, 0.2
SPENT, ELSEWHERE = 80, 81
"""Exit statuses of pytest for an exceeded time limit, and for a package that is not imported from the copy."""
MAX_WAIT_S = 600
CHOSEN, LAST_STARTED = ".mutants_chosen", ".mutants_last_started"
COLUMNS = ("package", "file", "line", "function", "operator", "before", "after", "noticed_by", "seconds")
SURVIVED, IMPORT = "", "import"


# --- plugin of pytest -----------------------------------------------------------------------------------------


def pytest_configure() -> None:
    """Check that both packages are imported from the working directory."""
    for name in PACKAGES:
        try:
            path = Path(str(importlib.import_module(name).__file__))
        except Exception:  # the mutant breaks the import: tests will notice
            continue
        if not path.is_relative_to(Path.cwd()):
            pytest.exit(f"{name} is imported from {path}", returncode=ELSEWHERE)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort the tests into the order in which they were chosen."""
    rank = {name: n for n, name in enumerate(Path(CHOSEN).read_text(encoding="utf-8").splitlines())}
    items.sort(key=lambda item: rank.get(item.nodeid.partition("[")[0], -1))


def pytest_runtest_logstart(nodeid: str) -> None:
    """Stop pytest if the time limit is exceeded; otherwise record the test that starts."""
    if sum(os.times()[:4]) > float(os.environ["MUTANTS_SECONDS"]):
        pytest.exit("the time is spent", returncode=SPENT)
    Path(LAST_STARTED).write_text(nodeid, encoding="utf-8")
    signal.alarm(MAX_WAIT_S)  # ends a test that waits without an end; the limit of processor time ends loops


# --- runner ---------------------------------------------------------------------------------------------------


def copy_tree(tree: Path) -> Path:
    """Copy the files that git tracks and the compiled numba loops to `tree`, and return `tree`."""
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.splitlines()
    compiled = [path.relative_to(ROOT) for name in PACKAGES for path in (ROOT / name).rglob("*.nb[ic]")]
    for name in (*listed, *compiled):
        if (ROOT / name).is_file():
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, tree / name)
    return tree


def first_failure(tree: Path, chosen: Sequence[str], *, seconds: int = MAX_SECONDS) -> str:
    """Return the first test that fails in a copy of the project, or an empty string if no test fails."""
    (tree / CHOSEN).write_text("\n".join(chosen), encoding="utf-8")
    (tree / LAST_STARTED).write_text(IMPORT, encoding="utf-8")
    limit = max(3 * MAX_SECONDS, 3 * seconds)
    options = ["-m", "pytest", "-x", "-q", "-n", "0", "-p", "tests.mutants", "-m", "not thorough"]
    process = subprocess.run(
        [sys.executable, *options, *chosen],
        cwd=tree,
        # With CI hypothesis draws the same examples each time.
        env={**os.environ, "CI": "true", "PYTHONPATH": str(tree), "MUTANTS_SECONDS": str(seconds)},
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit)),
    )
    if process.returncode == ELSEWHERE:
        raise RuntimeError(process.stdout + process.stderr)
    passed = process.returncode in (0, SPENT, pytest.ExitCode.NO_TESTS_COLLECTED)
    return SURVIVED if passed else (tree / LAST_STARTED).read_text(encoding="utf-8")


def plant(tree: Path, mutant: Mutant, number: int, chosen: Sequence[str], seconds: int) -> str:
    """Insert a defect into a copy of the project, return the first test that detects it, and remove the defect."""
    path = tree / mutant.file
    whole, before = path.read_text(encoding="utf-8"), path.stat()
    try:
        path.write_text(mutant.apply(whole), encoding="utf-8")
        # Python and numba know by the time whether what they compiled is stale.
        os.utime(path, (number, number))
        return first_failure(tree, chosen, seconds=seconds)
    finally:
        path.write_text(whole, encoding="utf-8")
        os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def row_of(mutant: Mutant) -> dict[str, str]:
    """Return the table columns that describe a mutant."""
    values = package_of(mutant.file), mutant.file, str(mutant.start[0]), *mutant[1:3], *mutant[5:]
    return dict(zip(COLUMNS, values, strict=False))


def key(row: dict[str, str]) -> tuple[str, ...]:
    """Return the columns that identify a mutant, even if lines above it change."""
    return row["function"], row["operator"], row["before"], row["after"]


def read(path: Path) -> dict[tuple[str, ...], dict[str, str]]:
    """Return the rows of earlier runs by the key of the mutant."""
    if not path.exists():
        return {}
    with path.open(newline="", encoding="utf-8") as stream:
        return {key(row): row for row in csv.DictReader(stream)}


def write(path: Path, rows: Iterable[dict[str, str]]) -> None:
    """Replace the table of results by the given rows."""
    part = path.with_suffix(".part")
    with part.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    part.replace(path)


def summary(rows: Sequence[dict[str, str]]) -> str:
    """Return a text with the number and percentage of detected mutants of each package, and the undetected ones."""
    drawn = Counter(row["package"] for row in rows)
    noticed = Counter(row["package"] for row in rows if row["noticed_by"])
    lines = [
        f"{name:22} {n:4} {noticed[name]:4} {noticed[name] / n:5.0%}" for name, n in sorted(drawn.items())
    ]
    survivors = [
        f"survived: {row['file']}:{row['line']} {row['operator']}: {row['before']} -> {row['after']}"
        for row in rows
        if not row["noticed_by"]
    ]
    whole = f"{'all':22} {len(rows):4} {noticed.total():4} {noticed.total() / max(len(rows), 1):5.0%}"
    return "\n".join([*survivors, f"{'package':22} drawn noticed", *lines, whole])


def main(arguments: Sequence[str]) -> int:
    """Test randomly chosen mutants that have no result yet, and print the detected share of each package."""
    seed, count, *others = arguments
    options = dict(word.partition("=")[::2] for word in others)
    only = options["only"].split(",") if "only" in options else PACKAGES
    path = ROOT / "results" / "mutants" / f"{seed}.csv"
    path.parent.mkdir(parents=True, exist_ok=True)
    drawn = islice((m for m in draw(seed) if any(f"/{word}/" in f"/{m.file}/" for word in only)), int(count))
    mutants = {key(row_of(mutant)): mutant for mutant in drawn}
    rows = read(path)
    waiting = [k for k in mutants if k not in rows or ("again" in options and not rows[k]["noticed_by"])]
    seconds = int(options.get("seconds", MAX_SECONDS))
    jobs = min(int(options.get("jobs", 1)), len(waiting)) or 1
    tests, trees = NearestTests(), Queue[Path]()

    def result(number: int) -> dict[str, str]:
        """Test one mutant in a copy of the project that no other process uses."""
        mutant, tree, start = mutants[waiting[number]], trees.get(), time.monotonic()
        try:
            nearest = tests.nearest(mutant.function, files=MAX_FILES)
            noticed = plant(tree, mutant, number + 1, nearest, seconds)
        finally:
            trees.put(tree)
        return row_of(mutant) | {"noticed_by": noticed, "seconds": f"{time.monotonic() - start:.0f}"}

    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(jobs) as pool:
        for n in range(jobs):
            trees.put(copy_tree(Path(folder) / str(n)))
        for done in as_completed([pool.submit(result, number) for number in range(len(waiting))]):
            row = done.result()
            rows[key(row)] = row
            write(path, rows.values())
            print(f"{row['noticed_by'] or 'SURVIVED':60} {' '.join(key(row))}", flush=True)
        clean = sorted({rows[k]["noticed_by"] for k in waiting} - {SURVIVED, IMPORT})
        if clean and (failure := first_failure(trees.get(), clean, seconds=MAX_SECONDS * len(clean))):
            print(f"{failure} fails without a mutant", file=sys.stderr)
            return 2
    results = [rows[k] for k in mutants]
    print(summary(results))
    return int(sum(bool(row["noticed_by"]) for row in results) < MIN_NOTICED * len(results))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
