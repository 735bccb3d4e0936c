"""Measurement of the digits in smoke-scale tables that are the same for all processors and BLAS kernels.

python -m tests.golden_digits [FIGURE ...]
    Make the tables of all figures (or of those named) under every setting, one process to each, and renew their rows of
    ``tests/golden/digits.csv``: the largest relative difference in each table, and the tolerance that follows from it.
python -m tests.golden_digits --check [FIGURE ...]
    Make those that iterate (or those named) under two BLAS kernels and compare them with the golden tables, to the
    tolerances of that file.  Exit status 1, with figure, table, line, column and both values, if a digit moved.

``--settings=Prescott,Haswell`` picks settings; those that this processor cannot run are left out, and named.  Tables of
seconds (`TIMING`) are never compared.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from numpy._core import _multiarray_umath as simd

from pipeline.cli.presets import presets
from pipeline.storage import tables
from pipeline.storage.agreement import DIRECT, TIMING
from tests.made_up_walker import WALKER
from tests.processes import finished

GOLDEN = Path(__file__).resolve().parent / "golden"
DIGITS = GOLDEN / "digits.csv"

LEAST = 1e-6
"""Smallest relative tolerance, used for tables without iterative computations."""
MARGIN = 10.0
"""Ratio of the tolerance to the measured difference, before the tolerance is rounded up to a power of ten."""

KERNELS = {"Prescott": "SSE3", "Nehalem": "SSE42", "Haswell": "AVX2", "Zen": "AVX2", "SkylakeX": "AVX512_SKX"}
"""Kernels of OpenBLAS, each with the processor instructions that it needs."""
CHECKED = ("Prescott", "Haswell")

VARIABLES = ("OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES", "NUMBA_CPU_NAME")


def settings() -> dict[str, dict[str, str]]:
    """Return the environment variables of each numerical setting that this processor can run, by setting."""
    has = {name for name, start in simd.__cpu_features__.items() if start}
    result: dict[str, dict[str, str]] = {"default": {}}
    result |= {kernel: {"OPENBLAS_CORETYPE": kernel} for kernel, needs in KERNELS.items() if needs in has}
    if vectors := [name for name in simd.__cpu_dispatch__ if name in has]:
        result["no_simd"] = {"NPY_DISABLE_CPU_FEATURES": " ".join(vectors)}
    return result | {"generic": {"NUMBA_CPU_NAME": "generic"}}


def make(figures: Sequence[str], environment: Mapping[str, str], results: Path, workers: int) -> Path:
    """Compute the smoke-scale tables of the figures in a separate process, and return their folder."""
    command = [
        sys.executable, "-m", "pipeline", "figures", f"experiment={','.join(figures)}", "data=synthetic", "scale=smoke",
        f"results={results}", f"workers={workers}", "figure.picture=false", "figure.recording=false",
    ]  # fmt: skip
    done = finished(command, environment=environment)
    if done.returncode:
        sys.exit(f"the tables could not be made under {dict(environment)}:\n{done.stderr}")
    (folder,) = results.glob("scratch/*")
    return folder


def make_all(
    figures: Sequence[str], chosen: Mapping[str, Mapping[str, str]], results: Path, jobs: int
) -> dict[str, Path]:
    """Compute the tables under each numerical setting, and return the folders by setting."""
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        running = {
            name: pool.submit(make, figures, environment, results / name, max(1, jobs // len(chosen)))
            for name, environment in chosen.items()
        }
        return {name: future.result() for name, future in running.items()}


def names_of(folder: Path) -> list[str]:
    """Return the names of the tables of a figure that must not depend on the processor."""
    return sorted(path.stem for path in folder.glob("table*.csv") if path.stem != TIMING)


def tolerance(difference: float) -> float:
    """Return the tolerance of a table for its measured difference. Differing text gets the smallest tolerance.

    Examples
    --------
    >>> [tolerance(measured) for measured in (0.0, 3e-8, 2e-7, 1e-3, float("inf"))]
    [1e-06, 1e-06, 1e-05, 0.01, 1e-06]
    """
    if not math.isfinite(difference) or difference * MARGIN <= LEAST:
        return LEAST
    return float(f"1e{math.ceil(math.log10(difference * MARGIN) - 1e-9)}")


def read_tolerances() -> dict[tuple[str, str], float]:
    """Return the tolerance of each figure and table; tables that are not listed have the tolerance `LEAST`."""
    return {(row["figure"], row["table"]): float(row["tolerance"]) for row in tables.read_rows(DIGITS)}


def measure(figures: Sequence[str], folders: Mapping[str, Path]) -> list[dict[str, str]]:
    """Return one row for each table, with the column that differs most between the numerical settings."""
    first, *others = folders
    rows = []
    for figure in figures:
        for table in names_of(folders[first] / figure):
            worst, column = 0.0, ""
            for other in others:
                paths = (folders[name] / figure / f"{table}.csv" for name in (first, other))
                for name, difference in tables.relative_differences(*paths).items():
                    if difference > max(worst, 1e-12):
                        worst, column = difference, name
            rows.append(
                {
                    "figure": figure,
                    "table": table,
                    "column": column,
                    "relative_difference": f"{worst:.1e}",
                    "tolerance": f"{tolerance(worst):.0e}",
                    "settings": " ".join(folders),
                }
            )
    return rows


def moved(figures: Sequence[str], folders: Mapping[str, Path]) -> list[str]:
    """Return the tables that differ by more than their tolerance from the golden table, or between two settings."""
    described, tolerances = [], read_tolerances()
    first = next(iter(folders.values()))
    for setting, folder in folders.items():
        for figure in figures:
            for table in names_of(first / figure):
                golden = GOLDEN / f"{figure}.csv"
                like = golden if table == "table" else first / figure / f"{table}.csv"
                relative = tolerances.get((figure, table), LEAST)
                output = folder / figure / f"{table}.csv"
                complaints = tables.compare(like, output, relative=relative)
                described += [
                    f"{setting}: {figure}/{table}.csv, {complaint} (tolerance {relative:g})"
                    for complaint in complaints
                ]
    return described


def main(arguments: Sequence[str]) -> int:
    """Run the check or the measurement that the arguments name, and return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("figures", nargs="*", metavar="FIGURE")
    parser.add_argument("--check", action="store_true", help="compare with the golden tables")
    parser.add_argument("--settings", default="", help=f"default, {', '.join(KERNELS)}, no_simd, generic")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes at a time")
    inputs = parser.parse_args(arguments)
    for variable in VARIABLES:
        os.environ.pop(variable, None)
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[variable] = "1"
    os.environ.setdefault("AVERAGE_WALKER", str(WALKER))
    everything = presets()
    if strange := [figure for figure in inputs.figures if figure not in everything]:
        parser.error(f"there is no figure {strange[0]}: expected one of {', '.join(everything)}")
    finite = settings()
    target = inputs.settings.split(",") if inputs.settings else list(CHECKED if inputs.check else finite)
    chosen = {name: finite[name] for name in target if name in finite}
    for name in [name for name in target if name not in finite]:
        print(f"left out: {name}, which this processor cannot run")
    if not chosen:
        return 0
    figures = inputs.figures or [f for f in everything if not inputs.check or not f.startswith(DIRECT)]
    with tempfile.TemporaryDirectory(prefix="golden-digits-") as results:
        folders = make_all(figures, chosen, Path(results), max(1, inputs.jobs))
        if inputs.check:
            described = moved(figures, folders)
            print("\n".join(described) or f"{len(figures)} figures hold under {', '.join(chosen)}")
            return 1 if described else 0
        rows = measure(figures, folders)
    for row in rows:
        if row["column"]:
            print(*(row[name] for name in ("figure", "table", "column", "relative_difference", "tolerance")))
    retained = (
        [row for row in tables.read_rows(DIGITS) if row["figure"] not in figures] if DIGITS.exists() else []
    )
    columns = {name: [row[name] for row in [*retained, *rows]] for name in rows[0]}
    tables.write(DIGITS, columns, sort_by=["figure", "table"])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
