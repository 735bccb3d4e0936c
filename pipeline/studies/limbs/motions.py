"""Whole skeletons of varied motion, reconstructed from still and moving cameras: park2011 section 5.2.

The paper shows four videos without ground truth.  Here the images are projections of recorded motion, so that errors
are known.  Each clip is represented by the stretch in which joints move most.

The paper uses less information: proportions of the human body, no hinges, and for a still camera the root's image at
one depth.  Errors in the paper's conditions are measured on the same images.

From the same choices, whole skeletons are also refined with trials of the mirrors of doubtful limbs.

Signs are the first that the search finds.  The certificate of each limb is computed separately, with a time limit, and
bounds the improvement by any other signs.
"""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from typing import Any

import numpy as np
import pandas as pd

from pipeline.core.articulated_trajectory import (
    Articulated,
    LimbChoice,
    Options,
    Reconstruction,
    TrajectoryBasis,
    prepared,
    solved,
)
from pipeline.core.articulation import ray_sphere
from pipeline.core.choice import evenly
from pipeline.core.limb_chain import WALKER14, relative_trajectories
from pipeline.core.limb_chain.lengths import anthropometric_lengths
from pipeline.core.pinhole import Pinhole
from pipeline.core.reconstructibility import (
    Reconstructibility,
    confidence_of_mirror_margin,
    of_clip,
    outside,
    reconstructibility,
)
from pipeline.processes import map_processes
from pipeline.seeding import derive_generator
from pipeline.studies.limbs import baselines
from pipeline.studies.limbs.cameras import Camera, CameraSweep
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.reconstructed_motions import Motions, MotionsOfBoth
from pipeline.studies.limbs.scores import (
    acceleration_ratio,
    better_of_mirrors,
    error_about_root,
    length_changes,
)
from pipeline.studies.limbs.trials import ROOT, LimbInputs, stacked
from pipeline.studies.study import scaled
from pipeline.validation import CountOrAll, NonNegative

CHILDREN = WALKER14.ends[:, 1]
"""Indices (14,) of all joints except the root, in the order of the limbs."""

_THIGHS = ("left_knee", "right_knee")

MAX_RATIO = 1e6
"""Upper limit of ratios in tables, such as reconstructibility, which can be infinite."""

ARRAYS = ("positions", "images", "camera_matrix", "azimuth_rad", "mirror_margin")
"""Names of the arrays of `Motions` that have a value for each clip and camera."""


class Lengths(StrEnum):
    """Source of the limb lengths for a reconstruction."""

    true = "true"
    anthropometric = "anthropometric"
    """Lengths have standard body proportions, and the true length of the thighs sets the scale."""
    estimated = "estimated"
    """Lengths are estimated from the rays of the image points."""


class Root(StrEnum):
    """Source of the root trajectory for a reconstruction."""

    true = "true"
    unit_depth = "unit_depth"
    """The root lies on the rays of its image points, at the depth that it has in the middle frame.

    If the camera moves, the true trajectory is used.
    """


class MotionsSweep(CameraSweep):
    """Options of the reconstruction of whole skeletons from a still, a moving and a shaky camera."""

    clips: CountOrAll = scaled(value="clips")  # number of clips, spread evenly; 0: all
    noise_px: NonNegative = 1.0  # noise of the image
    lengths: Lengths = Lengths.true
    root: Root = Root.true
    use_hinges: bool = True  # choose the mirrors of limbs at a hinge together
    time_limit_s: NonNegative = 0.2  # nominal time for each certificate
    papers_lengths: Lengths = Lengths.anthropometric  # lengths in the paper's conditions
    papers_root: Root = Root.unit_depth
    papers_hinges: bool = False  # hinges in the paper's conditions

    def measure(self, inputs: LimbInputs) -> MotionsOfBoth:
        """Return the reconstructions of all clips; for a clip, all cameras have the same azimuth and image noise."""
        stretches, basis = inputs.dataset, inputs.model_options.limb_basis()
        chosen = _liveliest(stretches, self.clips)
        as_in_the_paper = replace(  # information of [park2011 section 5.2]
            self, lengths=self.papers_lengths, root=self.papers_root, use_hinges=self.papers_hinges
        )

        def reconstructed(item: tuple[int, Camera]) -> tuple[list[dict[str, Any]], dict[str, Any]]:
            number, kind = item
            truth, label = stretches.positions[number], stretches.seed_label(number)
            side = derive_generator(inputs.seed, f"sweep:motions:camera:{label}")
            camera = self.camera(kind, truth[:, ROOT], side)
            noise = derive_generator(inputs.seed, f"sweep:motions:noise:{label}")
            exact = camera.project(truth)
            images = exact + self.noise_px * noise.standard_normal(exact.shape)
            lengths = stretches.lengths_mm[number]
            ours, papers = (
                _Reconstruction(options, basis, truth, lengths, camera, images, kind)
                for options in (self, as_in_the_paper)
            )
            signs = derive_generator(inputs.seed, f"sweep:motions:signs:{label}")
            keys = {"clip": stretches.clip[number], "action": stretches.action[number], "camera": str(kind)}
            further = {
                **papers.in_papers_conditions(signs),
                "camera_outside_basis": ours.camera_outside_basis(),
                "mean_pose_error_mm": ours.error_mm(baselines.mean_pose(ours.root, truth)),
            }
            return ours.both_variants(keys), {**keys, **further}

        items = [(number, kind) for number in chosen for kind in self.cameras]
        variants, papers = zip(*map_processes(reconstructed, items, inputs.workers), strict=True)
        as_chosen, mirrors_tried = (
            Motions(
                cameras=np.array(self.cameras),
                stretch=chosen,
                truth=stretches.positions[chosen],
                **stacked(
                    [{name: each[name] for name in ARRAYS} for each in way],
                    (len(chosen), len(self.cameras)),
                ),
            )
            for way in zip(*variants, strict=True)
        )
        return MotionsOfBoth(
            as_chosen,
            mirrors_tried,
            papers=pd.DataFrame(papers),
            **{
                name: pd.concat([each[name] for ways in variants for each in ways], ignore_index=True)
                for name in ("clips", "joints", "limbs")
            },
        )


def _liveliest(stretches: LimbStretches, count: int) -> np.ndarray:
    """Indices (N,) of the stretch with most motion about the pelvis in each clip; clips are selected at equal steps."""
    moves = np.diff(stretches.positions - stretches.positions[:, :, [ROOT]], axis=1)
    speed = np.square(moves).sum(axis=(1, 2, 3))
    stretch_numbers = []
    for name in dict.fromkeys(stretches.clip):
        of_this = np.flatnonzero(stretches.clip == name)
        stretch_numbers.append(of_this[np.argmax(speed[of_this])])
    return np.array(stretch_numbers)[evenly(count, len(stretch_numbers))]


def _objective(choice: LimbChoice) -> float:
    """Return the squared residual, mm², of a limb trajectory outside the basis, over the frames with an image."""
    chosen, rows = choice.relative[choice.used], choice.basis.rows(len(choice.used), choice.used)
    return np.sum(chosen**2) - np.sum((rows.T @ chosen) ** 2)


class _Reconstruction:
    """Reconstruction of one clip from one camera."""

    def __init__(
        self,
        options: MotionsSweep,
        basis: TrajectoryBasis,
        truth: np.ndarray,
        lengths: np.ndarray,
        camera: Pinhole,
        images: np.ndarray,
        kind: Camera,
    ) -> None:
        self.options, self.basis, self.truth, self.camera, self.images = options, basis, truth, camera, images
        self.true_lengths = self.lengths = lengths
        if options.lengths is Lengths.anthropometric:
            thigh = np.mean([lengths[WALKER14.limbs.index(limb)] for limb in _THIGHS])
            self.lengths = anthropometric_lengths(WALKER14, of=_THIGHS[0], size_mm=thigh)
        elif options.lengths is Lengths.estimated:
            self.lengths = np.full(len(lengths), np.nan)
        self.root = truth[:, ROOT]
        if options.root is Root.unit_depth and kind is Camera.still:
            depth = camera.in_camera(self.root)[len(truth) // 2, 2]
            self.root = camera.back_project(images[:, ROOT], depth)

    def prepared(self, root: np.ndarray | None = None) -> Reconstruction:
        """Return the reconstruction problem for a root trajectory (F, 3), mm, by default the root of the options."""
        options = Options(
            self.basis,
            noise_px=self.options.noise_px,
            use_hinges=self.options.use_hinges,
            time_limit_s=0.0,
        )
        trajectory = self.root if root is None else root
        return prepared(self.images, self.camera, trajectory, self.lengths, options)

    def in_papers_conditions(self, generator: np.random.Generator) -> dict[str, float]:
        """Return the errors of the method and of baselines with only the information that the paper's method has."""
        true_root = self.truth[:, ROOT]
        skeleton = self.prepared()
        estimate = skeleton.whole()
        error = error_about_root(estimate.positions, self.truth)[:, CHILDREN].mean(axis=1)
        lengths = np.array([estimate.limbs[limb].hits.radius for limb in WALKER14.limbs])
        better = better_of_mirrors(self.truth, skeleton.with_lengths(lengths))
        at_random = baselines.random_signs(self.camera, self.images, self.root, lengths, generator)
        return {
            "error_mm": error.mean(),
            "error_sd_mm": error.std(ddof=1),
            "error_up_to_mirror_mm": self.error_mm(better),
            "length_change_max": length_changes(estimate.positions).max(),
            "acceleration_ratio": acceleration_ratio(estimate.positions, self.truth),
            "random_signs_acceleration_ratio": acceleration_ratio(at_random, self.truth),
            "hanging_error_mm": self.error_mm(baselines.hanging(self.root, lengths)),
            "true_root_error_mm": error.mean()
            if np.array_equal(self.root, true_root)
            else self.error_mm(self.prepared(true_root).whole().positions),
        }

    def camera_outside_basis(self) -> float:
        """Return the residual of the camera path outside the trajectory basis, relative to the path's size.

        The residual is 0 for a still camera.
        """
        path = np.broadcast_to(self.camera.centre, (len(self.truth), 3))
        about = path - path.mean(axis=0)
        size = float(np.linalg.norm(about))
        if size <= 1e-9 * np.abs(path).max():
            return 0.0
        used = np.ones(len(about), bool)
        return outside(self.basis.rows(len(used), used), about) / size

    def error_mm(self, positions: np.ndarray) -> float:
        """Return the mean distance, mm, of estimated from true joints relative to the root; the root is not counted."""
        return error_about_root(positions, self.truth)[:, CHILDREN].mean()

    def both_variants(self, keys: dict[str, str]) -> list[dict[str, Any]]:
        """Return arrays and table rows of two reconstructions, without and with trials of mirrored limbs.

        Both start from the same choices and the same refinement, which are computed once.
        """
        skeleton = self.prepared()
        eta = self.reconstructibilities()
        middle = self.camera.at(len(self.truth) // 2).centre - self.truth[:, ROOT].mean(axis=0)
        of_both = {
            "images": self.images,
            "camera_matrix": np.broadcast_to(self.camera.matrix, (len(self.truth), 3, 4)),
            "azimuth_rad": np.arctan2(-middle[0], middle[1]),
        }
        with_trials = skeleton.under(replace(skeleton.options, try_mirrors=True))
        return [
            {**of_both, **self.reconstructed(way, eta, {**keys, "mirrors_tried": way is with_trials})}
            for way in (skeleton, with_trials)
        ]

    def reconstructed(
        self, skeleton: Reconstruction, eta: list[Reconstructibility], keys: dict[str, Any]
    ) -> dict[str, Any]:
        """Return arrays and table rows of one reconstruction, without or with trials of mirrored limbs.

        Only the variant without trials of mirrors has separate certificates.
        """
        estimate = skeleton.whole()
        lengths = np.array([estimate.limbs[limb].hits.radius for limb in WALKER14.limbs])
        true = relative_trajectories(WALKER14, self.truth)
        estimated = relative_trajectories(WALKER14, estimate.positions)
        away = np.linalg.norm(estimated - true, axis=-1).mean(axis=0)
        better = better_of_mirrors(self.truth, skeleton.with_lengths(lengths))
        error = error_about_root(estimate.positions, self.truth)[:, CHILDREN]
        of_limbs = self.certificates(estimate, lengths, separate=not keys["mirrors_tried"])
        margin = np.minimum(of_limbs["mirror_margin"], MAX_RATIO)
        limbs = {
            "limb": WALKER14.limbs,
            "reconstructibility": np.minimum([limb.ratio for limb in eta], MAX_RATIO),
            "mirror_margin": margin,
            "confidence": [str(confidence_of_mirror_margin(m)) for m in margin],
            **{name: column for name, column in of_limbs.items() if name != "mirror_margin"},
            "limb_error": away / self.true_lengths,
            "components": estimate.refined.coefficients_theta.shape[1]
            if estimate.refined
            else [estimate.limbs[limb].basis.components for limb in WALKER14.limbs],
            "length_ratio": lengths / self.true_lengths,
        }
        joints = {
            "joint": WALKER14.limbs,
            "error_mm": error.mean(axis=0),
            "error_sd_mm": error.std(axis=0, ddof=1),
            "imputed_share": estimate.imputed[:, CHILDREN].mean(axis=0),
        }
        mean, middle_margin = error.mean(axis=1), np.median(margin)
        clip = {
            "lengths": str(self.options.lengths),
            "error_mm": mean.mean(),
            "error_sd_mm": mean.std(ddof=1),
            "error_up_to_mirror_mm": self.error_mm(better),
            "length_change_max": length_changes(estimate.positions).max(),
            "acceleration_ratio": acceleration_ratio(estimate.positions, self.truth),
            "hanging_error_mm": self.error_mm(baselines.hanging(self.root, self.true_lengths)),
            "mean_pose_error_mm": self.error_mm(baselines.mean_pose(self.root, self.truth)),
            "reprojection_error_px": estimate.refined.reprojection_error_px if estimate.refined else np.nan,
            "proved_share": of_limbs["proved"].mean(),
            "confidence": str(confidence_of_mirror_margin(middle_margin)),
            "mirror_margin_median": middle_margin,
            "reconstructibility": min(of_clip(eta).ratio, MAX_RATIO),
        }
        return {
            "positions": estimate.positions,
            "mirror_margin": of_limbs["mirror_margin"],
            "clips": pd.DataFrame([{**keys, **clip}]),
            "joints": pd.DataFrame({**keys, **joints}),
            "limbs": pd.DataFrame({**keys, **limbs}),
        }

    def certificates(
        self, estimate: Articulated, lengths: np.ndarray, separate: bool
    ) -> dict[str, np.ndarray]:
        """Return the mirror margin, the objective and its lower bound for each of the 14 limbs."""
        options = self.options
        anchored = np.empty_like(self.truth)
        anchored[:, ROOT] = self.root
        rows = []
        for limb, (name, (parent, child)) in enumerate(zip(WALKER14.limbs, WALKER14.ends, strict=True)):
            choice = estimate.limbs[name]
            solution = certificate = choice.solution
            if separate and options.time_limit_s > 0.0:
                _, certificate = solved(
                    self.camera.matrix,
                    self.images[:, child],
                    anchored[:, parent],
                    lengths[limb],
                    basis=self.basis,
                    noise_px=options.noise_px,
                    time_limit_s=options.time_limit_s,
                )
            anchored[:, child] = anchored[:, parent] + choice.hits.radius * choice.directions
            rows.append(
                {
                    "mirror_margin": solution.margin,
                    "mirrored": choice.mirrored,
                    "proved": certificate.proved,
                    "objective": solution.mirror_objective if choice.mirrored else solution.objective,
                    "chosen_objective": _objective(choice),
                    "best_objective": min(certificate.objective, solution.objective),
                    "lower_bound": certificate.lower_bound,
                }
            )
        return stacked(rows, (len(rows),))

    def reconstructibilities(self) -> list[Reconstructibility]:
        """Return the reconstructibility eta_a of each of the 14 limbs, with the true position of its parent."""
        results = []
        for limb, (parent, child) in enumerate(WALKER14.ends):
            about = self.truth[:, parent]
            hits = ray_sphere(
                self.camera.matrix, self.images[:, child], about, self.true_lengths[limb]
            ).resolved()
            used = hits.usable
            toward = (self.truth[:, child] - about - hits.middle) * hits.half_chord
            signs = np.where(toward.sum(axis=1) < 0.0, -1, 1)
            rows = self.basis.rows(len(used), used)
            results.append(reconstructibility(rows, hits.middle[used], hits.half_chord[used], signs[used]))
        return results
