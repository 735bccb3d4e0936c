"""How CPU time grows with walkers and with view angles; times are relative to the first size of each job.

With walkers: 15 eigenwalkers, so that the models of 20 walkers are as large as those of 1 280; models and
sweeps are timed on 16 folds and multiplied to all.  With angles: 16 folds of 80 walkers.  Different people
throughout.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import islice

import numpy as np

from pipeline.clips.kinds import Walks
from pipeline.clips.walks import synthetic_walks
from pipeline.core import camera, linear_model, reconstruction, viewpoint
from pipeline.ingestion.data import SyntheticData
from pipeline.studies.eigenwalkers.samples import FourierDataset, FourierSamples
from tests.benchmarks import inputs
from tests.benchmarks.inputs import NOISE_VARIANCE_MM2, VIEWS_RAD, split_by_sex
from tests.benchmarks.tables import Row
from tests.benchmarks.timing import cpu_seconds, exponent

WALKERS = (20, 80, 320, 1280)
STEPS_DEG = (6, 3, 1)
COMPONENTS, FOLDS = 15, 16
METHODS = {"least_squares": None, "map": NOISE_VARIANCE_MM2}

Folds = list[tuple[linear_model.LinearModel, int]]


def _known(rows: np.ndarray, folds: Folds, views: np.ndarray) -> None:
    for model, r in folds:
        for sigma2 in METHODS.values():
            reconstruction.from_known_views(model, rows[r], views, noise_variance=sigma2)


def _unknown(rows: np.ndarray, folds: Folds, views: np.ndarray) -> None:
    for model, r in folds:
        walker = linear_model.unflatten(rows[r])
        seen = np.stack([camera.project(walker, angle).reshape(-1) for angle in views])
        for method, sigma2 in METHODS.items():
            viewpoint.estimate(model, seen, method=method, noise_variance=sigma2)


def _with_walkers(count: int) -> dict[str, float]:
    """CPU seconds of each stage for so many walkers."""
    clips: list[Walks] = []
    samples: list[FourierSamples] = []
    folds: Folds = []
    seconds = {}

    def timed(stage: str, function: Callable[[], None], times: float = 1.0) -> None:
        seconds[stage] = times * cpu_seconds(function)

    people = split_by_sex(count)
    data = SyntheticData(name="bench", population=count, male_share=people["male"] / count)
    timed("synthesise and ingest", lambda: clips.append(synthetic_walks(data, 2007, 1)))
    timed("dataset", lambda: samples.append(FourierDataset().build(clips[0], workers=1)))
    rows = linear_model.flatten(samples[0].coefficients)
    few = min(FOLDS, count)
    timed(
        "model",
        lambda: folds.extend(islice(linear_model.leave_one_out(rows, COMPONENTS), few)),
        count / few,
    )
    timed("sweep, known view", lambda: _known(rows, folds, VIEWS_RAD), count / few)
    timed("sweep, unknown view", lambda: _unknown(rows, folds, VIEWS_RAD), count / few)
    return seconds


def run() -> list[Row]:
    """A row for each stage and each sweep, with the fitted exponent."""
    _with_walkers(20)  # warm
    by_walkers = [_with_walkers(count) for count in WALKERS]
    rows = [
        _row("walkers", stage, WALKERS, [seconds[stage] for seconds in by_walkers]) for stage in by_walkers[0]
    ]
    people = inputs.samples()
    folds = list(islice(linear_model.leave_one_out(people, 30), FOLDS))
    grids = [np.radians(np.arange(-90.0, 90.5, step)) for step in STEPS_DEG]
    counts = [len(grid) for grid in grids]
    for stage, sweep in (("sweep, known view", _known), ("sweep, unknown view", _unknown)):
        calls = [partial(sweep, people, folds, grid) for grid in grids]
        seconds = [min(cpu_seconds(call) for _ in range(3)) for call in calls]
        rows.append(_row("view angles", stage, counts, seconds))
    return rows


def _row(size: str, stage: str, sizes: tuple[int, ...] | list[int], seconds: list[float]) -> Row:
    row: Row = {"grows": size, "stage": stage}
    row["sizes"] = " ".join(str(s) for s in sizes)
    row["times_the_first"] = " ".join(f"{s / seconds[0]:.3g}" for s in seconds)
    row["exponent"] = exponent(sizes, seconds)
    return row
