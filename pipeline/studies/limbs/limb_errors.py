"""Error of one limb against errors of what is given: its parent's trajectory, its radius; park2011 section 5.1."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.core.articulated_trajectory.limb_choice import Smoothness, SmoothnessByRule
from pipeline.core.articulation import ray_sphere
from pipeline.core.binary_quadratic import BinarySolution
from pipeline.core.reconstructibility import reconstructibility
from pipeline.storage.store import Artefact, derive_generator
from pipeline.studies.limbs.scores import distance, limb_score, true_signs
from pipeline.studies.limbs.trials import (
    LimbTrial,
    adjustment,
    choose,
    fixed_smoothness,
    limb_trial,
    smoothness,
    wrong_trajectory,
)
from pipeline.studies.options import RadiusScaleSweep, RootErrorSweep, TrajectoryBasisModel
from pipeline.studies.sweep_checks import check_sweep, check_values
from pipeline.threads import map_threads

Numbers = dict[str, Any]


def measure_root_error(
    options: RootErrorSweep,
    dataset: Artefact,
    model_options: TrajectoryBasisModel,
    workers: int,
    seed: int,
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Error of every trial for every error of its parent's trajectory, whose course is the same at all sizes.

    Parameters
    ----------
    options : RootErrorSweep
    dataset : Artefact
    model_options : TrajectoryBasisModel
    workers : int
    seed : int

    Returns
    -------
    arrays : dict
        ``cameras`` (C,), ``values`` (V,) the ratios, ``stretch``, ``limb`` (T,); (C, V, T): ``limb_error``,
        ``relative_error``, ``error_up_to_mirror``, ``child_error_ratio``, ``child_error_up_to_mirror``,
        ``parent_error_ratio``, ``reconstructibility``, ``proved``, ``objective``, ``lower_bound`` mm²; of the first
        camera's trial ``shown``: ``paths`` (V, 2, F, 3), the child as it is and as estimated, less its true parent,
        over the limb's length.
    notes : dict
        ``unproved``, the share of programmes whose time ran out.

    Raises
    ------
    InvalidInput
        Options that cannot be.
    """
    check_sweep(options, adjusts=[options.adjust])
    check_values("ratios", options.ratios, 0.0)
    smooth = fixed_smoothness(model_options, "a wrong parent trajectory in the basis")

    def one(item: tuple[str, int]) -> list[Numbers]:
        trial = limb_trial(options, dataset, item[1], item[0], seed)
        return [_with_root_error(options, trial, smooth, ratio, seed) for ratio in options.ratios]

    return _gathered(
        options.cameras, options.trials, options.ratios, map_threads(one, _items(options), workers)
    )


def _with_root_error(
    options: RootErrorSweep, trial: LimbTrial, smooth: Smoothness, ratio: float, seed: int
) -> Numbers:
    generator = derive_generator(seed, f"sweep:root_error:{trial.number}")
    components = smooth.components if options.smooth else None
    wrong = wrong_trajectory(generator, len(trial.parent), ratio * trial.length, components=components)
    parent = trial.parent + wrong
    choice = choose(trial, smooth, options, adjust=options.adjust, noise_px=options.noise_px, parent=parent)
    score = limb_score(trial, choice, parent=parent)
    used, hits = choice.used, choice.hits
    signs = true_signs(choice, trial.child - parent)[used]
    eta = reconstructibility(smooth.rows(len(used), used), hits.middle[used], hits.half_chord[used], signs)
    return {
        "limb_error": score.limb_error,
        "relative_error": score.relative_error,
        "error_up_to_mirror": score.error_up_to_mirror,
        "child_error_ratio": distance(parent + choice.relative, trial.child) / trial.length,
        "parent_error_ratio": distance(parent, trial.parent) / trial.length,
        "reconstructibility": eta.ratio,
        **_certificate(choice.solution),
        "paths": np.stack([trial.relative, parent + choice.relative - trial.parent]) / trial.length,
        "trial": trial,
    }


def measure_radius_scale(
    options: RadiusScaleSweep,
    dataset: Artefact,
    model_options: TrajectoryBasisModel,
    workers: int,
    seed: int,
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Error of every trial for every scale of the radius, with every way of adjusting it to the rays.

    Parameters
    ----------
    options : RadiusScaleSweep
    dataset : Artefact
    model_options : TrajectoryBasisModel
    workers : int
    seed : int

    Returns
    -------
    arrays : dict
        As `measure_root_error`, with ``adjusts`` (A,) and values (V,) of scales; (C, V, A, T): ``limb_error``,
        ``relative_error``, ``error_up_to_mirror``, ``adjusted_share`` of frames whose ray misses the sphere,
        ``radius_ratio`` after adjustment, ``proved``, ``objective``, ``lower_bound``; ``paths`` (V, 2, F, 3) with the
        first adjustment.
    notes : dict
        ``unproved``, the share of programmes whose time ran out.

    Raises
    ------
    InvalidInput
        Options that cannot be.
    """
    check_sweep(options, adjusts=options.adjusts)
    check_values("scales", options.scales, 1e-9)
    smooth = smoothness(model_options)
    points = [(scale, adjust) for scale in options.scales for adjust in options.adjusts]

    def one(item: tuple[str, int]) -> list[Numbers]:
        trial = limb_trial(options, dataset, item[1], item[0], seed)
        known: dict[float, Numbers] = {}  # by the radius after adjustment, which is all that matters
        return [_with_radius(options, trial, smooth, scale, adjust, known) for scale, adjust in points]

    found = map_threads(one, _items(options), workers)
    arrays, notes = _gathered(options.cameras, options.trials, range(len(points)), found)
    ways = len(options.adjusts)

    def apart(values: np.ndarray) -> np.ndarray:
        """(C, V, A, T) of (C, V * A, T)."""
        return values.reshape(len(values), -1, ways, values.shape[2])

    split = {name: apart(values) for name, values in arrays.items() if name in _MEASURED}
    return {
        **arrays,
        **split,
        "values": np.array(options.scales),
        "adjusts": np.array(options.adjusts),
        "paths": arrays["paths"][::ways],
    }, notes


_MEASURED = (
    "limb_error", "relative_error", "error_up_to_mirror", "adjusted_share", "radius_ratio", "proved", "objective",
    "lower_bound",
)  # fmt: skip


def _with_radius(
    options: RadiusScaleSweep,
    trial: LimbTrial,
    smooth: Smoothness | SmoothnessByRule,
    scale: float,
    adjust: str,
    known: dict[float, Numbers],
) -> Numbers:
    pixels = trial.images + options.noise_px * trial.noise
    hits = ray_sphere(
        trial.view.matrix, pixels, trial.parent, scale * trial.length, adjust=adjustment(adjust)
    )
    if hits.radius not in known:
        ratio = hits.radius / trial.length
        choice = choose(trial, smooth, options, noise_px=options.noise_px, scale=ratio)
        score = limb_score(trial, choice)
        known[hits.radius] = {
            "limb_error": score.limb_error,
            "relative_error": score.relative_error,
            "error_up_to_mirror": score.error_up_to_mirror,
            "radius_ratio": ratio,
            **_certificate(choice.solution),
            "paths": np.stack([trial.relative, choice.relative]) / trial.length,
        }
    return {**known[hits.radius], "adjusted_share": float(hits.adjusted.mean()), "trial": trial}


def _certificate(solution: BinarySolution) -> Numbers:
    return {name: getattr(solution, name) for name in ("proved", "objective", "lower_bound")}


def _items(options: RootErrorSweep | RadiusScaleSweep) -> list[tuple[str, int]]:
    return [(camera, number) for camera in options.cameras for number in range(options.trials)]


def _gathered(
    cameras: list[str], trials: int, values: Any, found: list[list[Numbers]]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Arrays (C, V, T) of what was found for each camera and trial at every value."""
    points = len(values)
    arrays: dict[str, Any] = {}
    for name in found[0][0]:
        if name not in ("trial", "paths"):
            table = np.array([[numbers[name] for numbers in row] for row in found])
            arrays[name] = np.moveaxis(table.reshape(len(cameras), trials, points), 1, 2)
    # The first camera's trial whose errors are, over all values, nearest to the medians.
    errors = np.log(np.maximum(arrays["limb_error"][0], 1e-3))
    off = np.abs(errors - np.median(errors, axis=1, keepdims=True)).sum(axis=0)
    shown = int(np.argmin(off))
    first = [row[0]["trial"] for row in found[:trials]]
    return {
        "cameras": np.array(cameras),
        "values": np.array(list(values), dtype=float),
        "stretch": np.array([trial.stretch for trial in first]),
        "limb": np.array([trial.limb for trial in first]),
        **arrays,
        "shown": np.array([shown]),
        "paths": np.stack([numbers["paths"] for numbers in found[shown]]),
    }, {"unproved": float(1.0 - arrays["proved"].mean())}
