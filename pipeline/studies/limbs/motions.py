"""Whole skeletons of varied motion, reconstructed from still and moving cameras: park2011 section 5.2.

The paper shows four videos whose truth nobody knows.  Here the images are projections of recorded motion, so that
beside the pictures there are errors.  Of each clip the stretch is taken whose joints move most.

Signs are the first that the search finds unless `sweep.exact` says otherwise; the certificate of each limb is then
made beside, under a limit if there is any, and says how much better any signs could be.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.core.articulated_trajectory import Articulated, reconstruct
from pipeline.core.articulated_trajectory.limb_choice import Smoothness, SmoothnessByRule, choose_limb
from pipeline.core.articulation import ray_sphere
from pipeline.core.limb_chain import WALKER14, relative_trajectories
from pipeline.core.limb_chain.lengths import anthropometric_lengths
from pipeline.core.pinhole import Pinhole
from pipeline.core.reconstructibility import Reconstructibility, of_clip, reconstructibility
from pipeline.storage.store import Artefact, derive_generator
from pipeline.studies.limbs.scores import better_of_mirrors
from pipeline.studies.limbs.trials import camera_on, smoothness
from pipeline.studies.options import MotionsSweep, TrajectoryBasisModel
from pipeline.studies.sweep_checks import CAMERAS, check_names, check_values
from pipeline.threads import map_threads

LENGTHS = ("true", "anthropometric", "estimated")
ROOTS = ("true", "unit_depth")

ROOT = WALKER14.joints.index(WALKER14.root)
HUNG = WALKER14.ends[:, 1]
"""Places of the fourteen joints that are not the root, in the order of the limbs."""

_THIGHS = ("left_knee", "right_knee")


def measure(
    options: MotionsSweep, dataset: Artefact, model_options: TrajectoryBasisModel, workers: int, seed: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Reconstructions of N clips from C cameras, their errors, and what the data say of each limb.

    Parameters
    ----------
    options : MotionsSweep
    dataset : Artefact
        Stretches of clips.
    model_options : TrajectoryBasisModel
    workers, seed : int
        Every clip has its own generator: cameras look at it from the same side and see the same noise.

    Returns
    -------
    arrays : dict
        ``cameras`` (C,); ``stretch`` (N,) indices into the data set; ``truth`` (N, F, 15, 3) mm; ``positions``
        (N, C, F, 15, 3) mm, ``images`` (N, C, F, 15, 2) px, ``imputed`` (N, C, F, 15); ``azimuth_rad`` (N, C) of the
        camera in its middle frame; ``error_mm`` (N, C, F, 15) relative to the pelvis; ``error_up_to_mirror_mm``,
        ``reprojection_error_px``, ``reconstructibility_of_clip`` (N, C); of the limbs (N, C, 14):
        ``reconstructibility``, ``mirror_margin``, ``proved``, ``objective``, ``best_objective``, ``lower_bound``,
        ``limb_error``, ``length_change``, ``mirrored``, ``components``, ``length_ratio`` of the length that was
        assumed to the true one.
    notes : dict

    Raises
    ------
    InvalidInput
        If an option is unknown or out of range.
    """
    _check(options)
    basis = smoothness(model_options)
    stretch = _liveliest(dataset, options.clips)
    places = {int(n): _place(dataset, int(n)) for n in stretch}

    def one(item: tuple[int, str]) -> dict[str, Any]:
        n, kind = item
        positions = dataset.arrays["positions"][n]
        sides = derive_generator(seed, f"sweep:motions:camera:{places[n]}")
        camera = camera_on(
            kind,
            positions[:, ROOT],
            sides,
            distance_mm=options.distance_mm,
            focal_px=options.focal_px,
            around_deg=options.around_deg,
        )
        noise = derive_generator(seed, f"sweep:motions:noise:{places[n]}")
        seen = camera.project(positions)
        images = seen + options.noise_px * noise.standard_normal(seen.shape)
        return _Trial(options, basis, positions, dataset.arrays["lengths_mm"][n], camera, images, kind).all()

    items = [(int(n), kind) for n in stretch for kind in options.cameras]
    found = map_threads(one, items, workers)
    grid = (len(stretch), len(options.cameras))
    arrays = {
        name: np.stack([f[name] for f in found]).reshape(*grid, *np.shape(found[0][name]))
        for name in found[0]
    }
    return {
        "cameras": np.array(options.cameras),
        "stretch": stretch,
        "truth": dataset.arrays["positions"][stretch],
        **arrays,
    }, {
        "lengths": options.lengths,
        "root": options.root,
        "noise_px": options.noise_px,
        "unproved_limbs": int((~arrays["proved"]).sum()),
    }


def _check(options: MotionsSweep) -> None:
    check_names("cameras", options.cameras, CAMERAS)
    check_names("lengths", [options.lengths], LENGTHS)
    check_names("root", [options.root], ROOTS)
    check_values("noise_px", [options.noise_px], 0.0)
    check_values("clips", [options.clips], 0)
    check_values("distance_mm", [options.distance_mm], 1.0)
    check_values("focal_px", [options.focal_px], 1.0)


def _liveliest(dataset: Artefact, wanted: int) -> np.ndarray:
    """Indices (N,) of one stretch of each clip, in which joints move most about the pelvis; clips evenly over all."""
    positions, clip = dataset.arrays["positions"], dataset.arrays["clip"]
    moves = np.diff(positions - positions[:, :, [ROOT]], axis=1)
    speed = np.square(moves).sum(axis=(1, 2, 3))
    chosen = []
    for name in dict.fromkeys(clip.tolist()):
        of_clip_ = np.flatnonzero(clip == name)
        chosen.append(int(of_clip_[np.argmax(speed[of_clip_])]))
    if 0 < wanted < len(chosen):
        picks = np.unique(np.rint(np.linspace(0, len(chosen) - 1, wanted)).astype(int))
        chosen = [chosen[k] for k in picks]
    return np.array(chosen)


def _place(dataset: Artefact, n: int) -> str:
    """A stretch's name, for its generators."""
    return f"{dataset.arrays['source'][n]}:{dataset.arrays['clip'][n]}:{dataset.arrays['start_s'][n]:g}"


class _Trial:
    """One clip before one camera."""

    def __init__(
        self,
        options: MotionsSweep,
        basis: Smoothness | SmoothnessByRule,
        truth: np.ndarray,
        lengths: np.ndarray,
        camera: Pinhole,
        images: np.ndarray,
        kind: str,
    ) -> None:
        self.options, self.basis, self.truth, self.camera, self.images = options, basis, truth, camera, images
        self.true_lengths = lengths
        thigh = float(np.mean([lengths[WALKER14.limbs.index(limb)] for limb in _THIGHS]))
        self.lengths = lengths
        if options.lengths == "anthropometric":
            self.lengths = anthropometric_lengths(WALKER14, of=_THIGHS[0], size_mm=thigh)
        elif options.lengths == "estimated":
            self.lengths = np.full(len(lengths), np.nan)
        self.root = truth[:, ROOT]
        if (
            options.root == "unit_depth" and kind == "still"
        ):  # from another camera it can be had by other means
            depth = float(camera.in_camera(self.root)[len(truth) // 2, 2])
            self.root = camera.back_project(images[:, ROOT], depth)

    def all(self) -> dict[str, Any]:
        """What is kept of it, by name."""
        options = self.options
        made = reconstruct(
            self.images,
            self.camera,
            self.root,
            self.lengths,
            smoothness=self.basis,
            noise_px=options.noise_px,
            use_hinges=options.use_hinges,
            try_mirrors=options.try_mirrors,
            time_limit_s=options.time_limit_s if options.exact else 0.0,
        )
        self.lengths = np.array([made.limbs[limb].hits.radius for limb in WALKER14.limbs])
        error = _relative_error(made.positions, self.truth)
        true = relative_trajectories(WALKER14, self.truth)
        estimated = relative_trajectories(WALKER14, made.positions)
        away = np.linalg.norm(estimated - true, axis=-1).mean(axis=0)
        sizes = np.linalg.norm(estimated, axis=-1)
        eta = self.reconstructibilities()
        middle = self.camera.at(len(self.truth) // 2).centre - self.truth[:, ROOT].mean(axis=0)
        return {
            "positions": made.positions,
            "images": self.images,
            "imputed": made.imputed,
            "azimuth_rad": np.arctan2(-middle[0], middle[1]),
            "error_mm": error,
            "error_up_to_mirror_mm": _relative_error(self.up_to_mirror(), self.truth)[:, HUNG].mean(),
            "reprojection_error_px": made.refined.reprojection_error_px if made.refined else np.nan,
            "reconstructibility": np.array([limb.ratio for limb in eta]),
            "reconstructibility_of_clip": of_clip(eta).ratio,
            "limb_error": away / self.true_lengths,
            "length_change": np.abs(sizes / sizes.mean(axis=0) - 1.0)
            .max(axis=0)
            .round(12),  # or it is rounding
            "length_ratio": self.lengths / self.true_lengths,
            "components": np.array([made.limbs[limb].smoothness.components for limb in WALKER14.limbs]),
            **self.certificates(made),
        }

    def certificates(self, made: Articulated) -> dict[str, np.ndarray]:
        """Of each limb (14,): cost of what was taken, of the best that is known, and a bound, on the same programme."""
        hung = np.empty_like(self.truth)
        hung[:, ROOT] = self.root
        rows = []
        for limb, (parent, child) in zip(WALKER14.limbs, WALKER14.ends, strict=True):
            choice = made.limbs[limb]
            solution = choice.solution
            certificate = solution
            if not self.options.exact and self.options.time_limit_s > 0.0:  # or it would be the same again
                certificate = choose_limb(
                    self.camera.matrix,
                    self.images[:, child],
                    hung[:, parent],
                    float(self.lengths[WALKER14.limbs.index(limb)]),
                    smoothness=self.basis,
                    noise_px=self.options.noise_px,
                    time_limit_s=self.options.time_limit_s,
                ).solution
            hung[:, child] = hung[:, parent] + choice.hits.radius * choice.directions
            rows.append(
                {
                    "mirror_margin": solution.margin,
                    "mirrored": choice.mirrored,
                    "objective": solution.mirror_objective if choice.mirrored else solution.objective,
                    "best_objective": min(certificate.objective, solution.objective),
                    "lower_bound": certificate.lower_bound,
                    "proved": certificate.proved,
                }
            )
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}

    def reconstructibilities(self) -> list[Reconstructibility]:
        """eta_a of each limb (14), about its true parent."""
        found = []
        for limb, (parent, child) in enumerate(WALKER14.ends):
            hits = ray_sphere(
                self.camera.matrix,
                self.images[:, child],
                self.truth[:, parent],
                float(self.true_lengths[limb]),
            )
            hits = hits.settled()
            used = hits.usable
            toward = (self.truth[:, child] - self.truth[:, parent] - hits.middle) * hits.half_chord
            signs = np.where(toward.sum(axis=1) < 0.0, -1, 1)
            rows = self.basis.of(hits.middle, used).rows(len(used), used)
            found.append(reconstructibility(rows, hits.middle[used], hits.half_chord[used], signs[used]))
        return found

    def up_to_mirror(self) -> np.ndarray:
        """Positions (F, 15, 3) with each limb or its mirror, whichever is nearer to the truth; not refined."""
        return better_of_mirrors(
            self.truth,
            self.camera,
            self.images,
            self.root,
            self.lengths,
            self.basis,
            noise_px=self.options.noise_px,
        )


def _relative_error(positions: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Distance (F, 15) of joints from the truth, both relative to the pelvis, mm."""
    apart = positions - positions[:, [ROOT]] - (truth - truth[:, [ROOT]])
    return np.asarray(np.linalg.norm(apart, axis=-1))
