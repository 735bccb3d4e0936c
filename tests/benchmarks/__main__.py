"""Benchmarks of speed: our code relative to other libraries, growth of the cost with size, and whole papers.

  python -m tests.benchmarks [NAME ...] [OPTION=VALUE ...]      all by default

figures         wall and processor time and memory of each figure; reference=CHECKOUT: against that commit, in turns
commands        wall time of the README's commands, which renews results/durations.csv; only=sweeps film=walk.mp4
growth          with walkers, views, frames, performances, clips, particles: exponents and peak memory; sizes=reduced
leave_one_out   80 linear models of 225 numbers, against scikit-learn
known_view      reconstruction from 181 known views, against scikit-learn and the plain loop
noise_path      the same for 625 values of sigma², against the plain loop
unknown_view    view angle and coefficients together, against SciPy's trust region
synchronization all ordered pairs of performances with their paths, against dtaidistance, tslearn and a plain loop
binary_quadratic   signs of a limb with a proof, against SCIP; growth with F and K
proofs          limbs proved to be solved, and the time, by frames, K and noise; data=optical trials=100
refinement      a skeleton of 14 limbs over 300 frames, against SciPy's trust region
articulated     a skeleton of 14 limbs from images to refined positions: stages, growth with F and K
coverage_of_intervals   95 % intervals over people: how often they hold the true mean; no times
gait_events     foot contacts and toe-offs by ankles against a laboratory's marks, ms; needs the recordings
known_people    films of people of another laboratory, with a few people known, mm, no times; needs the recordings
film_with_truth   a film to 3D, against optical joint centres, no times; needs KEYPOINTS_RECORDINGS
keypoint_offsets   MediaPipe's joints against optical centres on one film, mm, no times; needs KEYPOINTS_RECORDINGS
held_out_joints   joints of recorded people hidden and estimated: mm, no times; needs the recordings
synthetic_people   next to recorded people: sway, bob, variance, offsets; no times; needs the recordings
components      of people whose motion is disturbed: noise, soft tissue, uneven strides, overground; no times
over_range      coefficients beyond the training people's range, by image noise and components; no times
recognition     bends, squats and walks by the model of bends, no times; needs the recordings
whole           zhang2004 and zhang2007 at full scale: seconds of each stage, and memory

Each is printed and written to results/bench/NAME.csv, with versions, machine and commit in NAME.json; `figures` and
`growth` also as a picture.  Options go to the benchmarks that know them; nothing judges these numbers.  Times are CPU
times of one thread unless a column says otherwise; the two sides of a ratio alternate, and the median of a few rounds
is given.
"""

from __future__ import annotations

import os

# One BLAS thread, before numpy is loaded: two of them cost several times the CPU time on matrices so small.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["OMP_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import importlib
import inspect
import json
import subprocess
import sys
from pathlib import Path

from pipeline.storage.provenance import provenance
from tests.benchmarks.tables import show, write

BENCHMARKS = (
    "commands",
    "figures",
    "growth",
    "leave_one_out",
    "known_view",
    "noise_path",
    "unknown_view",
    "synchronization",
    "binary_quadratic",
    "proofs",
    "refinement",
    "articulated",
    "coverage_of_intervals",
    "gait_events",
    "held_out_joints",
    "known_people",
    "keypoint_offsets",
    "film_with_truth",
    "synthetic_people",
    "components",
    "over_range",
    "recognition",
    "whole",
)
RESULTS = Path(__file__).resolve().parents[2] / "results" / "bench"


def main(names: list[str]) -> int:
    """Run the named benchmarks, or all of them, and return the exit status."""
    if {"-h", "--help"} & set(names):
        print(__doc__)
        return 0
    options = dict(name.split("=", 1) for name in names if "=" in name)
    names = [name for name in names if "=" not in name]
    unknown = [name for name in names if name not in BENCHMARKS]
    if unknown:
        print(f"no benchmark {unknown[0]!r} (expected {', '.join(BENCHMARKS)})", file=sys.stderr)
        return 1
    if len(names) == 1:
        return run(names[0], options)
    # A process for each: what one leaves in memory and in caches is not the next one's.
    commands = [
        [sys.executable, "-m", "tests.benchmarks", name, *_known(name, options)]
        for name in names or BENCHMARKS
    ]
    return max(subprocess.run(command, check=False).returncode for command in commands)


def _known(name: str, options: dict[str, str]) -> list[str]:
    """Return the given options that the benchmark accepts, as ``name=value`` texts."""
    has = inspect.signature(importlib.import_module(f"tests.benchmarks.{name}").run).parameters
    return [f"{option}={value}" for option, value in options.items() if option in has]


def run(name: str, options: dict[str, str]) -> int:
    """Run one benchmark in this process, and return the exit status."""
    module = importlib.import_module(f"tests.benchmarks.{name}")
    has = inspect.signature(module.run).parameters
    wrong = [option for option in options if option not in has]
    if wrong:
        print(f"{name} has no option {wrong[0]!r} (expected {', '.join(has) or 'none'})", file=sys.stderr)
        return 1
    rows = module.run(**options)
    show(name, module.__doc__ or "", rows)
    write(RESULTS / f"{name}.csv", rows)
    # The folder of the reference stays private.
    message = {option: value for option, value in options.items() if option != "reference"}
    about = {"benchmark": name, "options": message, "cores": os.cpu_count(), **provenance()}
    (RESULTS / f"{name}.json").write_text(json.dumps(about, indent=2) + "\n", encoding="utf-8")
    if hasattr(module, "draw"):
        module.draw(rows, RESULTS / name)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
