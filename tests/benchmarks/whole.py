"""Time to compute zhang2004 and zhang2007 at full scale from an empty cache, without pictures and recordings.

To hold: under 5 s on two cores and under 1 GB.  Wall seconds, but for `cpu_s`.  `start` is importing the program
and composing the nine presets; every row is a process of its own.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.benchmarks.tables import Row

WORKERS = (1, 2)
OVERRIDES = (
    "data=synthetic",
    "scale=full",
    "scale.populations=0",
    "figure.picture=false",
    "figure.recording=false",
)


def run() -> list[Row]:
    """Return one row for each number of worker processes."""
    return [
        json.loads(
            subprocess.run(
                [sys.executable, "-m", "tests.benchmarks.whole", str(workers)],
                check=True,
                stdout=subprocess.PIPE,
                text=True,
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
            ).stdout
        )
        for workers in WORKERS
    ]


def _here(workers: int) -> Row:
    """Compute the figures in this process, and return the row with their times."""
    started = time.perf_counter()
    from pipeline.cli.compose import compose
    from pipeline.cli.figures import make_figure
    from pipeline.cli.presets import presets
    from pipeline.cli.summary import STAGES
    from pipeline.storage.store import Store

    figures = [name for name in presets() if name.startswith("zhang") and "_fig" in name]
    experiments = [compose([f"experiment={name}", f"workers={workers}", *OVERRIDES]) for name in figures]
    begun = time.perf_counter()
    seconds = dict.fromkeys(STAGES, 0.0)
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder))
        for name, experiment in zip(figures, experiments, strict=True):
            outcome = make_figure(experiment, Path(folder) / "figures" / name, store=store)
            for stage in STAGES:
                seconds[stage] += outcome.seconds[stage]
    ended = time.perf_counter()
    per_megabyte = 2**20 if sys.platform == "darwin" else 2**10
    return {
        "workers": workers,
        "figures": len(figures),
        **{stage: round(value, 2) for stage, value in seconds.items()},
        "total_s": round(ended - begun, 2),
        "bound_s": 5,
        "start": round(begun - started, 2),
        "cpu_s": round(time.process_time(), 2),
        "peak_mb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / per_megabyte),
        "bound_mb": 1000,
    }


if __name__ == "__main__":
    print(json.dumps(_here(int(sys.argv[1]))))
