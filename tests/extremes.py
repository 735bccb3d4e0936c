"""Run of each figure with each option at the ends of its range: each run must finish or explain its error.

python -m tests.extremes [FIGURE ...]
    A run for each option and value: of all figures 1 700, an hour on two cores.  Exit status 1 if one ends
    in a traceback or a warning in place of a figure or a sentence.
"""

from __future__ import annotations

import enum
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, is_dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from pipeline.cli.compose import compose
from pipeline.cli.presets import presets
from pipeline.processes import usable_cores
from pipeline.validation import require_range, required
from tests.made_up_walker import WALKER

ROOT = Path(__file__).resolve().parent.parent
GROUPS = ("data", "dataset", "model", "sweep", "figure")
LARGEST = 100
"""Largest ratio of a range's end to the default value; a run with a more distant end would take hours."""


def tree(kind: type[Any]) -> dict[str, Any]:
    """Return what the annotations of an options class permit for each option: nested options, choices or bounds."""
    hints = get_type_hints(kind, include_extras=True)
    return {field.name: _values(hints[field.name]) for field in fields(kind)}


def _values(hint: Any) -> Any:
    hint = required(hint)
    bounds: dict[str, Any] = {}
    if get_origin(hint) is Annotated:
        hint, *checks = get_args(hint)
        bounds = {name: value for check in checks if isinstance(check, partial) and check.func is require_range
                  for name, value in check.keywords.items()}  # fmt: skip
    if is_dataclass(hint) and isinstance(hint, type):
        return tree(hint)
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return list(hint.__members__)
    return {"": hint.__name__, "bounds": bounds} if hint in (int, float) else None


def options(path: str, option: Any, known: dict[str, Any]) -> Iterator[tuple[str, Any, Any]]:
    """Yield each option of a group: its path, its value and the permitted values."""
    for name, owner in known.items():
        value = getattr(option, name)
        if isinstance(owner, dict) and "" not in owner:
            yield from options(f"{path}.{name}", value, owner)
        else:
            yield f"{path}.{name}", value, owner


def within(number: float, bounds: dict[str, float]) -> bool:
    """Return whether a number is inside a range."""
    inside = bounds.get("at_least", number) <= number <= bounds.get("at_most", number)
    return (
        inside and number > bounds.get("above", -float("inf")) and number < bounds.get("below", float("inf"))
    )


def tried(value: Any, known: Any) -> list[Any]:
    """Return the values that the program tries for an option, without the option's present value."""
    if isinstance(value, bool):
        return [not value]
    if isinstance(value, enum.Enum):
        return [name for name in known if name != value.name]
    if isinstance(value, list):
        shorter = [[], value[:1], value[-1:], value[::-1]]
        return [each for k, each in enumerate(shorter) if each != value and each not in shorter[:k]]
    if not isinstance(value, int | float):
        return []
    bounds = (known or {}).get("bounds", {})
    near = 1 if isinstance(value, int) else 1e-3
    ends = [bounds.get("at_least"), bounds.get("at_most")]
    ends += [bounds["above"] + near] if "above" in bounds else []
    ends += [bounds["below"] - near] if "below" in bounds else []
    ends += [0, 1, value * 2, value // 2 if isinstance(value, int) else value / 2]
    reach = LARGEST * max(abs(value), 1)
    return [
        each
        for each in dict.fromkeys(map(type(value), (end for end in ends if end is not None)))
        if each != value and abs(each) <= reach and within(each, bounds)
    ]


def runs(figures: list[str]) -> list[list[str]]:
    """Return the overrides of every run. An option of the data is tried only with the first figure that has it."""
    result: dict[tuple[str, str], list[str]] = {}
    for figure in figures:
        experiment = compose([f"experiment={figure}", "scale=smoke"])
        for group in GROUPS:
            option = getattr(experiment, group)
            for path, value, finite in options(group, option, tree(type(option))):
                for each in tried(value, finite):
                    word = (
                        json.dumps([getattr(v, "name", v) for v in each]) if isinstance(each, list) else each
                    )
                    override = f"{path}={str(word).replace(' ', '').replace(chr(34), '')}"
                    alone = experiment.dataset.corpus.name if group == "data" else figure
                    result.setdefault((alone, override), [f"experiment={figure}", override])
    return [*result.values()]


def main(figures: list[str]) -> int:
    """Run all overrides, and print the runs that neither finish nor explain their error."""
    os.environ.setdefault("AVERAGE_WALKER", str(WALKER))
    faults = sentences = 0
    target = runs(figures or presets())
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(usable_cores()) as pool:

        def run(overrides: list[str]) -> subprocess.CompletedProcess[str]:
            command = [
                sys.executable,
                "-m",
                "pipeline",
                "scale=smoke",
                *overrides,
                "workers=1",
                f"results={folder}",
            ]
            return subprocess.run(
                command,
                cwd=ROOT,
                capture_output=True,
                text=True,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
            )

        for count, (overrides, done) in enumerate(zip(target, pool.map(run, target), strict=True), start=1):
            print(f"\r{count} of {len(target)}", end="", file=sys.stderr, flush=True)
            message = done.stdout + done.stderr
            sentences += done.returncode == 1
            if done.returncode not in (0, 1) or "Traceback" in message or "Warning" in message:
                faults += 1
                print(
                    f"{' '.join(overrides)}: {message.strip().splitlines()[-1] if message.strip() else ''}",
                    flush=True,
                )
    print(f"{len(target)} runs: {faults} faults, {sentences - faults} refused in a sentence")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
