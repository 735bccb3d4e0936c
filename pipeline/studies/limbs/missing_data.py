"""Error of a whole skeleton against the share of points that are missing from its images: park2011 section 5.1.

As there, lengths, images and root trajectory are wrong as well, and the camera stands still.  Points are missing one
by one at random, or each joint for a run of frames.  The root is given in 3D and never missing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.core.articulated_trajectory import Articulated, Smoothness, reconstruct
from pipeline.core.limb_chain import WALKER14
from pipeline.core.pinhole import Pinhole
from pipeline.core.refinement import Refinement
from pipeline.core.refinement.spherical import cosines_at
from pipeline.core.trajectory_basis import coefficients, cosine_basis
from pipeline.storage.store import Artefact, derive_generator
from pipeline.studies.limbs.scores import better_of_mirrors, distance
from pipeline.studies.limbs.trials import adjustment, camera_on, fixed_smoothness, wrong_trajectory
from pipeline.studies.options import MissingDataSweep, TrajectoryBasisModel
from pipeline.studies.sweep_checks import check_names, check_sweep, check_values
from pipeline.threads import map_threads
from pipeline.validation import InvalidInput

PATTERNS = ("random", "block")
MOST_MISSING = 0.9
SHOWN_FRACTION = 0.2
"""The recording shows the fraction nearest to this one, missing at random."""

BETWEEN = 10
"""Instants to a frame at which lengths are looked at."""

_ROOT = WALKER14.joints.index(WALKER14.root)


def measure(
    options: MissingDataSweep,
    dataset: Artefact,
    model_options: TrajectoryBasisModel,
    workers: int,
    seed: int,
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Error of every skeleton for every fraction of missing points and both patterns.

    Parameters
    ----------
    options : MissingDataSweep
    dataset : Artefact
    model_options : TrajectoryBasisModel
    workers : int
    seed : int

    Returns
    -------
    arrays : dict
        ``fractions`` (V,), ``patterns`` (P,), ``stretch``, ``camera`` (T,); (P, V, T): ``relative_error``,
        ``limb_error``, ``joint_error_mm``, ``imputed_error_mm`` (NaN where nothing is missing), ``seen_error_mm``,
        ``relative_error_up_to_mirror``, ``limb_error_up_to_mirror``, ``missing_share``, ``reprojection_error_px``,
        ``length_violation``, ``cartesian_length_violation``; of the trial ``shown``: ``shown_true``, ``shown_found``
        (F, 15, 3) mm, ``shown_imputed`` (F, 15) bool, ``shown_image`` (F, 15, 2) px, NaN where missing.
    notes : dict
        ``shown_fraction``, ``shown_pattern``.

    Raises
    ------
    InvalidInput
        Options that cannot be.
    """
    check_sweep(options, adjusts=[options.adjust])
    check_values("fractions", options.fractions, 0.0, MOST_MISSING)
    check_names("patterns", options.patterns, PATTERNS)
    for name in ("length_error", "root_error_mm", "noise_px"):
        if not 0.0 <= getattr(options, name) < np.inf:
            raise InvalidInput("an error is negative", where=f"sweep.{name}", expected="0 or more")
    if not 0.0 < options.share <= 1.0:
        raise InvalidInput(
            "a share of the trials is none",
            where="sweep.share",
            expected="more than 0, up to 1",
            received=f"{options.share:g}",
        )
    smooth = fixed_smoothness(model_options, "a wrong root trajectory in the basis")
    trials = int(np.ceil(options.share * options.trials))
    scenes = [_scene(options, dataset, smooth, number, seed) for number in range(trials)]
    points = [(p, v) for p in range(len(options.patterns)) for v in range(len(options.fractions))]

    def one(item: tuple[int, int, int]) -> tuple[dict[str, float], np.ndarray]:
        pattern, value, number = item
        hidden = scenes[number].hidden(options.patterns[pattern], options.fractions[value], seed)
        found = scenes[number].reconstructed(options, smooth, hidden)
        return _errors(options, scenes[number], found, hidden, smooth), found.positions

    # Nothing is missing in the same way whatever the pattern.
    items = [(p, v, t) for p, v in points for t in range(trials) if p == 0 or options.fractions[v] > 0]
    known = dict(zip(items, map_threads(one, items, workers), strict=True))
    every = [known.get((p, v, t)) or known[(0, v, t)] for p, v in points for t in range(trials)]
    shape = (len(options.patterns), len(options.fractions), trials)
    arrays = {name: np.array([e[0][name] for e in every]).reshape(shape) for name in every[0][0]}
    value = int(np.abs(np.array(options.fractions) - SHOWN_FRACTION).argmin())
    errors = arrays["joint_error_mm"][0, value]
    shown = int(np.argsort(errors, kind="stable")[len(errors) // 2])
    hidden = scenes[shown].hidden(options.patterns[0], options.fractions[value], seed)
    return {
        "fractions": np.array(options.fractions),
        "patterns": np.array(options.patterns),
        "stretch": np.array([scene.stretch for scene in scenes]),
        "camera": np.array([scene.camera for scene in scenes]),
        **arrays,
        "shown": np.array([shown]),
        "shown_true": scenes[shown].positions,
        "shown_found": known[(0, value, shown)][1],
        "shown_imputed": hidden,
        "shown_image": np.where(hidden[..., None], np.nan, scenes[shown].images),
    }, {"shown_fraction": options.fractions[value], "shown_pattern": options.patterns[0]}


@dataclass(frozen=True)
class Scene:
    """One stretch before one camera, and what is wrong with what is known of it.

    Attributes
    ----------
    number, stretch : int
    camera : str
    view : Pinhole
    positions : (F, 15, 3)
        True, mm.
    images : (F, 15, 2)
        px, with noise.
    root : (F, 3)
        Trajectory that is taken for the root's, mm.
    lengths, true_lengths : (14,)
        mm: as assumed, and as they are.
    """

    number: int
    stretch: int
    camera: str
    view: Pinhole
    positions: np.ndarray
    images: np.ndarray
    root: np.ndarray
    lengths: np.ndarray
    true_lengths: np.ndarray

    def hidden(self, pattern: str, fraction: float, seed: int) -> np.ndarray:
        """Points (F, 15) bool that are missing; more of them when the fraction is larger, and never the root's."""
        generator = derive_generator(seed, f"sweep:missing:{self.number}:{pattern}")
        frames, joints = self.positions.shape[:2]
        count = round(fraction * frames)
        missing = np.zeros((frames, joints), dtype=bool)
        for joint in range(joints):
            order, place = generator.permutation(frames), generator.random()
            if pattern == "block":
                start = round(place * (frames - count))
                missing[start : start + count, joint] = True
            else:
                missing[order[:count], joint] = True
        missing[:, _ROOT] = False
        return missing

    def reconstructed(self, options: MissingDataSweep, smooth: Smoothness, hidden: np.ndarray) -> Articulated:
        """The skeleton from what is left of its images: limb by limb, and all limbs refined together."""
        return reconstruct(
            np.where(hidden[..., None], np.nan, self.images),
            self.view,
            self.root,
            self.lengths,
            smoothness=smooth,
            adjust=adjustment(options.adjust),
            noise_px=options.noise_px,
            use_hinges=options.use_hinges,
            time_limit_s=options.time_limit_s,
        )


def _scene(options: MissingDataSweep, dataset: Artefact, smooth: Smoothness, number: int, seed: int) -> Scene:
    generator = derive_generator(seed, f"sweep:scene:{number}")
    stretch = int(generator.integers(len(dataset.arrays["positions"])))
    body = dataset.arrays["positions"][stretch]
    lengths = dataset.arrays["lengths_mm"][stretch]
    camera = options.cameras[number % len(options.cameras)]
    view = camera_on(
        camera,
        body[:, _ROOT],
        generator,
        distance_mm=options.distance_mm,
        focal_px=options.focal_px,
        around_deg=options.around_deg,
    )
    noise = generator.standard_normal((*body.shape[:2], 2))
    wrong = wrong_trajectory(generator, len(body), options.root_error_mm, components=smooth.components)
    return Scene(
        number=number,
        stretch=stretch,
        camera=camera,
        view=view,
        positions=body,
        images=view.project(body) + options.noise_px * noise,
        root=body[:, _ROOT] + wrong,
        lengths=lengths * (1.0 + options.length_error * generator.standard_normal(len(lengths))),
        true_lengths=lengths,
    )


def _errors(
    options: MissingDataSweep, scene: Scene, found: Articulated, hidden: np.ndarray, smooth: Smoothness
) -> dict[str, float]:
    best = better_of_mirrors(
        scene.positions,
        scene.view,
        np.where(hidden[..., None], np.nan, scene.images),
        scene.root,
        scene.lengths,
        smooth,
        adjust=adjustment(options.adjust),
        noise_px=options.noise_px,
        time_limit_s=options.time_limit_s,
    )
    true, limbs = scene.positions, np.arange(len(WALKER14.joints)) != _ROOT
    positions, refined = found.positions, found.refined
    assert refined is not None, "it was asked for"
    each = np.linalg.norm(positions - true, axis=-1)
    seen = limbs[None] & ~hidden
    inside, cartesian = length_violations(refined, smooth)
    return {
        "relative_error": float(np.linalg.norm(positions - true) / np.linalg.norm(true)),
        "limb_error": distance(positions[:, limbs], true[:, limbs]) / float(scene.true_lengths.mean()),
        "joint_error_mm": float(each[:, limbs].mean()),
        "imputed_error_mm": float(each[hidden].mean()) if hidden.any() else float("nan"),
        "seen_error_mm": float(each[seen].mean()),
        "relative_error_up_to_mirror": float(np.linalg.norm(best - true) / np.linalg.norm(true)),
        "limb_error_up_to_mirror": distance(best[:, limbs], true[:, limbs])
        / float(scene.true_lengths.mean()),
        "missing_share": float(hidden[:, limbs].mean()),
        "reprojection_error_px": refined.reprojection_error_px,
        "length_violation": inside,
        "cartesian_length_violation": cartesian,
    }


def length_violations(refined: Refinement, smooth: Smoothness) -> tuple[float, float]:
    """Largest relative change of a limb's length, at frames and between, of spherical and of Cartesian trajectories.

    To twelve decimals, for those of spherical trajectories are rounding.  The Cartesian ones are coordinates in the
    same basis, fitted to the relative trajectories at the frames.
    """
    frames, limbs = refined.relative.shape[:2]
    times = np.linspace(0.0, frames - 1.0, BETWEEN * (frames - 1) + 1)
    rows = cosines_at(times, frames, smooth.components)
    spherical = np.linalg.norm(refined.relative_at(rows), axis=-1) / refined.lengths - 1.0
    fitted = coefficients(
        cosine_basis(frames, smooth.components),
        np.ones(frames, dtype=bool),
        refined.relative.reshape(frames, -1),
        ridge=smooth.ridge,
    )
    between = (rows @ fitted).reshape(len(times), limbs, 3)
    cartesian = np.linalg.norm(between, axis=-1) / refined.lengths - 1.0
    return round(float(np.abs(spherical).max()), 12), float(np.abs(cartesian).max())
