"""Time to synchronize all 1 560 ordered pairs of 40 performances with 100 frames in 16 dimensions, and its growth.

Peers align by dynamic time warping within the same window, and only those that are installed take part: a plain
loop and dtw-python solve the same problem (mu = 0) and are compared answer by answer; the distances of dtaidistance
and tslearn are symmetric, so half as many pairs, by another step pattern and without mu.  In the rows of growth
the peer is ours at the first size, both per node of the trellis: 1 is linear, and less is slower than that.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

import numpy as np

from pipeline.core import synchronization
from pipeline.core.synchronization import allowed_disparities
from tests.benchmarks.tables import Row
from tests.benchmarks.timing import cpu_seconds, in_turns, relative_difference

PERFORMANCES, FRAMES, DIMENSIONS, BAND = 40, 100, 16, 33
ROUNDS = 7
FEW = 5
"""Number of pairs on which a slow library is timed."""


def performances(count: int = PERFORMANCES, frames: int = FRAMES) -> np.ndarray:
    """Return performances (M, P, b) of one smooth movement, each with a different pace and a small deviation."""
    generator = np.random.default_rng(2006)
    orders = np.arange(1, 9)
    shape = generator.standard_normal((len(orders), DIMENSIONS)) / orders[:, None]
    t = np.linspace(0, 1, frames)
    bends = 0.12 * generator.uniform(-1, 1, (count, 3, 1)) / np.array([1.0, 4.0, 9.0])[:, None]
    pace = t + (bends * np.sin(np.pi * np.array([1.0, 2.0, 3.0])[:, None] * t)).sum(axis=1)
    reference = shape + 0.1 * generator.standard_normal((count, *shape.shape)) / orders[:, None]
    return np.cos(np.pi * pace[..., None] * orders) @ reference


def smoothness(sequences: np.ndarray) -> float:
    """Return the smoothness weight mu: 1/50 of the mean squared deviation of a frame from the mean frame."""
    return 0.02 * float(sequences.var(axis=(0, 1)).sum())


def plain_loop(x_n: np.ndarray, x_m: np.ndarray, band: int) -> float:
    """Return the smallest cost with both ends fixed and mu = 0, computed by a plain loop over the nodes."""
    frames = len(x_n)
    before = {0: float(((x_n[0] - x_m[0]) ** 2).sum())}
    for p in range(1, frames):
        reach = min(band, p, frames - 1 - p)
        before = {
            d: min(before.get(d + k, np.inf) for k in (0, -1, 1)) + float(((x_n[p] - x_m[p + d]) ** 2).sum())
            for d in range(-reach, reach + 1)
        }
    return before[0]


def run() -> list[Row]:
    """Return rows for each library, with a note if it is not installed, and rows for the growth of time."""
    sequences = performances()
    mu = smoothness(sequences)
    few = list(itertools.permutations(range(PERFORMANCES), 2))[:: PERFORMANCES**2 // FEW][:FEW]
    whole = PERFORMANCES * (PERFORMANCES - 1)

    def with_paths() -> synchronization.AllPairs:
        return synchronization.synchronize_all(sequences, max_disparity=BAND, smoothness=mu)

    def unpenalised(pairs: Sequence[tuple[int, int]] = few) -> np.ndarray:
        result = synchronization.synchronize_all(sequences, max_disparity=BAND, smoothness=0.0).cost
        return np.array([result[n, m] for n, m in pairs])

    def loops() -> np.ndarray:
        return np.array([plain_loop(sequences[n], sequences[m], BAND) for n, m in few])

    def with_median() -> np.ndarray:
        result = with_paths()
        return synchronization.warp(sequences, result.disparity[synchronization.median_sequence(result.cost)])

    seconds = min(cpu_seconds(with_median) for _ in range(ROUNDS))
    rows = [
        in_turns(
            f"{whole} ordered pairs with paths",
            "plain loop, costs",
            with_paths,
            loops,
            rounds=3,
            scaled=whole / FEW,
            agreement=relative_difference(unpenalised(), loops(), at_most=1e-9),
            note=f"peer: {FEW} pairs, time × {whole // FEW}; ours with median and warp {seconds:.2g} s",
        )
    ]
    peers: tuple[tuple[str, Callable[[Any], list[Row]]], ...] = (
        ("dtw", lambda dtw: _dtw_python(dtw, sequences, few, whole, with_paths, unpenalised)),
        ("dtaidistance.dtw_ndim", lambda dtw_ndim: _dtaidistance(dtw_ndim, sequences, with_paths)),
        ("tslearn.metrics", lambda metrics: _tslearn(metrics, sequences, with_paths)),
    )
    for name, measure in peers:
        try:
            peer = import_module(name)
        except ImportError:
            rows.append({**dict.fromkeys(rows[0], ""), "job": "—", "peer": name, "note": "not installed"})
            continue
        rows += measure(peer)
    return rows + _growth()


def _dtw_python(
    dtw: Any,
    sequences: np.ndarray,
    few: list[tuple[int, int]],
    whole: int,
    with_paths: Callable[[], object],
    unpenalised: Callable[[], np.ndarray],
) -> list[Row]:
    def theirs() -> np.ndarray:
        return np.array(
            [
                dtw.dtw(
                    ((sequences[n][:, None] - sequences[m][None]) ** 2).sum(axis=2),
                    step_pattern="asymmetric",
                    window_type="sakoechiba",
                    window_args={"window_size": BAND},
                ).distance
                for n, m in few
            ]
        )

    return [
        in_turns(
            f"{whole} ordered pairs with paths",
            "dtw-python, with paths",
            with_paths,
            theirs,
            rounds=3,
            scaled=whole / FEW,
            agreement=relative_difference(unpenalised(), theirs(), at_most=1e-9),
            note=f"peer: {FEW} pairs, time × {whole // FEW}",
        )
    ]


def _dtaidistance(
    dtw_ndim: Any,
    sequences: np.ndarray,
    with_paths: Callable[[], object],
) -> list[Row]:
    best_path = import_module("dtaidistance.dtw").best_path

    # Shifts smaller than its window are allowed.
    def matrix() -> np.ndarray:
        return dtw_ndim.distance_matrix(
            sequences, DIMENSIONS, window=BAND + 1, compact=True, parallel=False, use_c=True
        )

    def paths() -> None:
        for m in range(1, FEW + 1):
            _, costs = dtw_ndim.warping_paths_fast(sequences[0], sequences[m], window=BAND + 1)
            best_path(costs)

    return _another_problem("dtaidistance (C)", matrix, paths, with_paths)


def _tslearn(metrics: Any, sequences: np.ndarray, with_paths: Callable[[], object]) -> list[Row]:
    def matrix() -> np.ndarray:
        return metrics.cdist_dtw(sequences, global_constraint="sakoe_chiba", sakoe_chiba_radius=BAND)

    def paths() -> None:
        for m in range(1, FEW + 1):
            metrics.dtw_path(
                sequences[0], sequences[m], global_constraint="sakoe_chiba", sakoe_chiba_radius=BAND
            )

    return _another_problem("tslearn (numba)", matrix, paths, with_paths)


def _another_problem(
    peer: str,
    matrix: Callable[[], object],
    paths: Callable[[], object],
    with_paths: Callable[[], object],
) -> list[Row]:
    """Return rows for a library with a different distance: all pairs, and all pairs with their paths."""
    pairs = PERFORMANCES * (PERFORMANCES - 1)
    unlike = float("nan")
    rows = [
        in_turns(
            f"{pairs} ordered pairs with paths",
            f"{peer}, {pairs // 2} pairs, distances",
            with_paths,
            matrix,
            rounds=ROUNDS,
            agreement=unlike,
            note="peer: half the pairs, symmetric",
        ),
        in_turns(
            f"{pairs} ordered pairs with paths",
            f"{peer}, {pairs // 2} pairs with paths",
            with_paths,
            paths,
            rounds=ROUNDS,
            scaled=pairs / 2 / FEW,
            agreement=unlike,
            note=f"peer: {FEW} pairs, time × {pairs / 2 / FEW:g}; symmetric",
        ),
    ]
    return [{**row, "largest_difference": "other distance"} for row in rows]


def _growth() -> list[Row]:
    """Return rows with the time per node for growing numbers of performances and frames, and for a growing band."""
    jobs: list[tuple[str, Callable[..., object], list[tuple[int, int, int]]]] = [
        ("performances, paths", synchronization.synchronize_all, [(m, FRAMES, BAND) for m in (40, 100, 300)]),
        ("frames, paths", synchronization.synchronize_all, [(12, p, BAND) for p in (100, 500, 1000, 2000)]),
        (
            "frames and band, paths",
            synchronization.synchronize_all,
            [(12, p, p // 3) for p in (100, 500, 2000)],
        ),
        ("band, paths", synchronization.synchronize_all, [(12, 600, d) for d in (25, 50, 100, 200)]),
    ]
    rows: list[Row] = []
    for name, function, sizes in jobs:
        first = 0.0
        for count, frames, band in sizes:
            sequences = performances(count, frames)
            mu = smoothness(sequences)

            def job(sequences: np.ndarray = sequences, band: int = band, mu: float = mu) -> object:
                return function(sequences, max_disparity=band, smoothness=mu)  # noqa: B023

            nodes = allowed_disparities(frames, max_disparity=band, smoothness=mu)
            visited = count**2 * float((nodes.high - nodes.low + 1).sum())
            seconds = cpu_seconds(job)
            rounds = 1 if seconds > 1.0 else 5
            seconds = min([seconds, *(cpu_seconds(job) for _ in range(rounds - 1))])
            first = first or seconds / visited
            rows.append(
                {
                    "job": f"{count} × {frames} frames, band {band}",
                    "peer": f"itself: growth with {name}",
                    "times_ours": first / (seconds / visited),
                    "least": "",
                    "most": "",
                    "rounds": rounds,
                    "largest_difference": "",
                    "note": f"{seconds:.3g} s, {1e9 * seconds / visited:.2g} ns a node",
                }
            )
    return rows
