"""Growth of processor time and memory with the numbers of walkers, views, frames, performances, clips and particles.

Options: `jobs` (names with commas between), `sizes=reduced` for a quick look.  Every row is a process of its own; its
seconds are those of the work alone, its memory that of the whole process.  The exponent is the slope of log seconds
on log size, with its standard error.

figure 5         all of zhang2007_fig5 at full scale, of one population: by walkers, and by views
synchronize      all ordered pairs of performances, of 100 frames
read, represent   people × 1 000 frames from TRC files; their Fourier representations; also by frames of one person
track             one performance of 100 frames, by particles; and by frames, 500 particles
model, sweep      leave-one-out models and two methods × 19 views, by walkers: 16 folds, multiplied to all
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Callable
from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd

from tests.benchmarks import children, pictures
from tests.benchmarks.tables import Row

HERE = Path(__file__).resolve().parents[2]
FOLDS, COMPONENTS, FRAME_RATE_HZ = 16, 30, 120.0
JOBS = {
    "figure 5": ("walkers", (80, 320, 1280)),
    "figure 5 views": ("views", (31, 61, 181)),
    "synchronize": ("performances", (40, 120, 400)),
    "read": ("clips", (6, 25, 100)),
    "represent": ("clips", (6, 25, 100)),
    "read one": ("frames", (100, 1000, 3000, 16000)),
    "represent one": ("frames", (100, 1000, 3000, 16000)),
    "track frames": ("frames", (50, 200, 800)),
    "track": ("particles", (100, 400, 1600, 6400)),
    "model": ("walkers", (80, 400, 2000, 10000)),
    "sweep": ("walkers", (80, 400, 2000, 10000)),
}
"""Quantity that grows, and its sizes, for each job."""

Work = tuple[Callable[[], object], float]
"""Function that is timed, and factor from its work to the work of the whole job."""


def run(jobs: str = "", sizes: str = "full") -> list[Row]:
    """Return one row for each job and size, with the exponent of the job's growth."""
    rows: list[Row] = []
    for job in jobs.split(",") if jobs else JOBS:
        grows, each = JOBS[job]
        if sizes == "reduced":
            each = each[:3] if grows in ("walkers", "views") else tuple(size // 4 for size in each)
        used = []
        for size in each:
            if job.startswith("figure"):
                child = _figure(grows, size)
                used.append((child.cpu_s, child.peak_mb))
                continue
            child = children.run(["-m", "tests.benchmarks.growth", job, str(size)], HERE)
            used.append((json.loads(child.output)["cpu_s"], child.peak_mb))
        slope, error = slope_with_error(np.log(each), np.log([seconds for seconds, _ in used]))
        rows += [
            {"job": job, "grows": grows, "size": size, "cpu_s": seconds, "peak_mb": round(peak_mb),
             "exponent": slope, "exponent_se": error}
            for size, (seconds, peak_mb) in zip(each, used, strict=True)
        ]  # fmt: skip
        print(f"  {job}: exponent {slope:.2f} ± {error:.2f}", flush=True)
    return rows


def slope_with_error(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Return the slope of y on x by least squares, and its standard error.

    Examples
    --------
    >>> slope, error = slope_with_error(np.array([0.0, 1.0, 2.0]), np.array([1.0, 3.0, 5.0]))
    >>> round(slope, 12), round(error, 12)
    (2.0, 0.0)
    """
    from scipy.stats import linregress

    fit = linregress(x, y)
    return float(fit.slope), float(fit.stderr)


def draw(rows: list[Row], stem: Path) -> None:
    """Draw processor time and peak memory against the size of the job."""
    slopes = {str(r["job"]): f"{r['job']} {r['exponent']:.2f} ± {r['exponent_se']:.2f}" for r in rows}
    pictures.draw_growth(stem, pd.DataFrame(rows), "Exponents of time: " + ", ".join(slopes.values()) + ".")


# --- the work ---------------------------------------------------------------------------------------------


def _figure(grows: str, size: int) -> children.Used:
    """Compute figure 5 of zhang2007 for `size` walkers or views from an empty cache; return its time and memory."""
    option = (
        f"data.population={size}" if grows == "walkers" else f"sweep.view_angle_deg.step={180 / (size - 1):g}"
    )
    with tempfile.TemporaryDirectory() as results:
        fixed = ["experiment=zhang2007_fig5", "data=synthetic", "data.populations=0", f"results={results}"]
        return children.run(["-m", "pipeline", *fixed, option], HERE)


def _synchronizing(performances: int) -> Work:
    from pipeline.core import synchronization
    from tests.benchmarks import synchronization as peers

    sequences = peers.performances(performances)
    mu = peers.smoothness(sequences)
    return lambda: synchronization.synchronize_all(sequences, max_disparity=peers.BAND, smoothness=mu), 1.0


def _walks(people: int, frames: int) -> np.ndarray:
    """Return walks on the spot, (people, frames, 15, 3) mm; a few synthetic people are repeated."""
    from pipeline.core import fourier
    from tests.benchmarks.inputs import samples

    coefficients = samples(2, 4).reshape(-1, 5, 15, 3)
    times_s = np.arange(frames) / FRAME_RATE_HZ
    few = [fourier.synthesise(c, 0.9, times_s) for c in coefficients[: min(people, 6)]]
    return np.stack([few[n % len(few)] for n in range(people)])


def _reading(people: int, frames: int, folder: Path) -> Work:
    from pipeline import formats
    from pipeline.formats.points import trc
    from pipeline.skeleton import WALKER15

    paths = [folder / f"{n}.trc" for n in range(people)]
    for path, walk in zip(paths, _walks(people, frames), strict=True):
        trc.write(path, WALKER15.joints, walk, FRAME_RATE_HZ)
    return lambda: [formats.read(path) for path in paths], 1.0


def _representing(people: int, frames: int) -> Work:
    from pipeline.core import fourier

    walks = _walks(people, frames)
    return lambda: [fourier.represent(walk, FRAME_RATE_HZ) for walk in walks], 1.0


def _tracking(particles: int, frames: int) -> Work:
    from pipeline.core import camera, posture
    from pipeline.core.action_model import learn_action
    from pipeline.core.resampling import interpolate
    from pipeline.core.tracking import Dynamics, Likelihood, learnt_diffusion, track
    from pipeline.synthetic import bending

    bends = bending.bending_performances(np.random.default_rng(1), performances=8)
    body = posture.limb_lengths(bends.positions_mm[0])
    action = learn_action([posture.postures(joints) for joints in bends.positions_mm[1:]])
    model = action.model
    interpolated = interpolate(bends.positions_mm[0], np.linspace(0, len(bends.positions_mm[0]) - 1, frames))
    dynamics = Dynamics(
        nominal_rate=(len(model.mean) - 1) / (frames - 1),
        diffusion=learnt_diffusion(action.synchronized, model.mean, model.standard_deviation),
    )

    def work(count: int = particles) -> None:
        track(
            model.mean,
            model.standard_deviation,
            Likelihood(camera.project(interpolated, 0.8), 0.8, 30.0, unknown_place="across"),
            to_joints=lambda x: posture.joints_where_defined(action.space.postures(x), body),
            n_particles=count,
            generator=np.random.default_rng(2),
            dynamics=dynamics,
        )

    work(2)  # what is compiled is not the work
    return work, 1.0


def _population(walkers: int) -> np.ndarray:
    """Return random walkers (R, 225), mm, with mean and covariance of 80 synthetic walkers and added white noise."""
    from tests.benchmarks.inputs import samples

    generator, people = np.random.default_rng(3), samples()
    deviations = (people - people.mean(axis=0)) / np.sqrt(len(people) - 1)
    mixed = generator.standard_normal((walkers, len(people))) @ deviations
    return people.mean(axis=0) + mixed + generator.standard_normal((walkers, people.shape[1]))


def _modelling(walkers: int) -> Work:
    from pipeline.core import linear_model

    rows = _population(walkers)
    folds = min(FOLDS, walkers)
    return lambda: list(islice(linear_model.leave_one_out(rows, COMPONENTS), folds)), walkers / folds


def _sweeping(walkers: int) -> Work:
    from pipeline.core import linear_model, reconstruction

    rows, views = _population(walkers), np.radians(np.arange(-90.0, 91.0, 10.0))
    folds = list(islice(linear_model.leave_one_out(rows, COMPONENTS), min(FOLDS, walkers)))

    def work() -> None:
        for model, r in folds:
            for noise_variance in (None, 70.0):
                reconstruction.from_known_views(model, rows[r], views, noise_variance=noise_variance)

    return work, walkers / len(folds)


def _here(job: str, size: int) -> dict[str, float]:
    """Run one job three times in this process, and return its shortest processor time, s."""
    with tempfile.TemporaryDirectory() as name:
        prepare: dict[str, Callable[[], Work]] = {
            "synchronize": lambda: _synchronizing(size),
            "read": lambda: _reading(size, 1000, Path(name)),
            "represent": lambda: _representing(size, 1000),
            "read one": lambda: _reading(1, size, Path(name)),
            "represent one": lambda: _representing(1, size),
            "track frames": lambda: _tracking(500, size),
            "track": lambda: _tracking(size, 100),
            "model": lambda: _modelling(size),
            "sweep": lambda: _sweeping(size),
        }
        work, times = prepare[job]()
        seconds = []
        for _ in range(3):
            started = time.process_time()
            work()
            seconds.append(time.process_time() - started)
    return {"cpu_s": times * min(seconds)}


if __name__ == "__main__":
    print(json.dumps(_here(sys.argv[1], int(sys.argv[2]))))
