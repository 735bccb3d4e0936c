"""Error of a whole skeleton against the fraction of missing image points: park2011 figure 3d.

As in the paper, lengths, images and root trajectory have errors, the camera is still, and joints are not constrained.
We add errors with knees and elbows that flex one way, at one fraction.  Points are missing one by one at random, or
each joint for a run of frames.  The root is known in 3D and never missing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Annotated, Any

import numpy as np
import pandas as pd

from pipeline.core.articulated_trajectory import Articulated, Options, TrajectoryBasis, prepared
from pipeline.core.articulation import Adjustment
from pipeline.core.limb_chain import WALKER14, relative_trajectories
from pipeline.core.pinhole import Pinhole
from pipeline.core.reconstructibility import of_clip
from pipeline.core.refinement import Refinement
from pipeline.core.trajectory_basis import coefficients, cosine_basis
from pipeline.processes import map_processes
from pipeline.seeding import derive_generator
from pipeline.studies.limbs import baselines
from pipeline.studies.limbs.cameras import Camera
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.scores import better_of_mirrors, certificate, distance, reconstructibility_of
from pipeline.studies.limbs.trials import ROOT, LimbInputs, LimbSweep, wrong_trajectory
from pipeline.validation import Distinct, Increasing, NonNegative, bounded

MAX_MISSING = 0.9

SHOWN_FRACTION = 0.2
"""Missing fraction that the recording shows; the nearest fraction of the sweep is used."""

HINGED_FRACTION = 0.05
"""Missing fraction in the paper, at which skeletons are also reconstructed with hinges at knees and elbows."""

CHECKS_PER_FRAME = 10
"""Number of instants per frame at which changes of limb lengths are measured."""


Missing = Annotated[float, bounded(at_least=0, at_most=MAX_MISSING)]


class Pattern(StrEnum):
    """Pattern in which image points of a joint are missing over time."""

    random = "random"
    """Missing frames are drawn independently for each joint."""
    block = "block"
    """Missing frames of each joint are one run of successive frames."""

    def hides(self, frames: int, joints: int, fraction: float, generator: np.random.Generator) -> np.ndarray:
        """Return a mask (F, J) of missing points; a larger fraction adds points and removes none."""
        count = round(fraction * frames)
        missing = np.zeros((frames, joints), bool)
        for joint in range(joints):
            order, position = generator.permutation(frames), generator.random()
            if self is Pattern.block:
                start = round(position * (frames - count))
                missing[start : start + count, joint] = True
            else:
                missing[order[:count], joint] = True
        return missing


@dataclass(frozen=True)
class MissingDataErrors:
    """Errors of every skeleton for each fraction and pattern of missing points, and one skeleton for display.

    Attributes
    ----------
    rows : DataFrame
    hinged : DataFrame
        The same with knees and elbows that flex one way, at one fraction, with the first pattern.
    shown_clip : str
        Clip of the skeleton with the median error at the displayed fraction.
    shown_true, shown_found : (F, 15, 3)
        mm.
    shown_imputed : (F, 15) bool
    shown_image : (F, 15, 2)
        px, NaN where missing.
    shown_fraction : float
    shown_pattern : str
    """

    rows: pd.DataFrame
    hinged: pd.DataFrame
    shown_clip: str
    shown_true: np.ndarray
    shown_found: np.ndarray
    shown_imputed: np.ndarray
    shown_image: np.ndarray
    shown_fraction: float
    shown_pattern: str


@dataclass(frozen=True)
class Scene:
    """One motion stretch in front of one camera, with image noise, a wrong root trajectory and wrong limb lengths.

    Attributes
    ----------
    number : int
    clip : str
    camera : Camera
    view : Pinhole
    positions : (F, 15, 3)
        True positions, mm.
    images : (F, 15, 2)
        Images with noise, px.
    root : (F, 3)
        Assumed trajectory of the root, mm.
    lengths, true_lengths : (14,)
        Assumed and true lengths, mm.
    """

    number: int
    clip: str
    camera: Camera
    view: Pinhole
    positions: np.ndarray
    images: np.ndarray
    root: np.ndarray
    lengths: np.ndarray
    true_lengths: np.ndarray

    def hidden(self, pattern: Pattern, fraction: float, seed: int) -> np.ndarray:
        """Return a mask (F, 15) of missing image points; the root is never missing."""
        generator = derive_generator(seed, f"sweep:missing:{self.number}:{pattern}")
        frames, joints = self.positions.shape[:2]
        missing = pattern.hides(frames, joints, fraction, generator)
        missing[:, ROOT] = False
        return missing

    def without(self, hidden: np.ndarray) -> np.ndarray:
        """Return the image points (F, 15, 2), px, with NaN for missing points."""
        return np.where(hidden[..., None], np.nan, self.images)


class MissingDataSweep(LimbSweep):
    """Options of the sweep over the fraction of missing points, for whole-body skeletons."""

    cameras: Distinct[Camera] = [Camera.still]
    fractions: Increasing[Missing] = [0.0, 0.05, 0.1, 0.2, 0.3, 0.5]  # fractions of missing observations
    patterns: Distinct[Pattern] = [Pattern.random, Pattern.block]
    length_error: NonNegative = 0.02  # relative error of the lengths, standard deviation over limbs
    root_error_mm: NonNegative = 20.0  # root mean square error of the root
    noise_px: NonNegative = 1.0  # noise of the image
    use_hinges: bool = False  # knees and elbows flex one way; not in the paper
    adjust: Adjustment = Adjustment.per_frame
    share: Annotated[float, bounded(above=0, at_most=1)] = 0.3  # share of the trials, each a skeleton
    time_limit_s: NonNegative = 0.0  # 0: signs of the first search, without certificates

    def measure(self, inputs: LimbInputs) -> MissingDataErrors:
        """Return the errors of every skeleton for each fraction and pattern of missing points."""
        basis = inputs.model_options.limb_basis()
        seed, trials = inputs.seed, int(np.ceil(self.share * self.trials))
        scenes = [self.scene(inputs.dataset, basis, number, seed) for number in range(trials)]

        # Without missing points all patterns are the same.
        first, hinged = self.patterns[0], replace(self.options(basis), use_hinges=True)
        hinged_fraction = min(self.fractions, key=lambda fraction: abs(fraction - HINGED_FRACTION))

        def errors_of_point(
            item: tuple[Pattern, float, int],
        ) -> tuple[dict[str, Any], dict[str, Any], np.ndarray]:
            pattern, fraction, number = item
            scene = scenes[number]
            hidden = scene.hidden(pattern, fraction, seed)
            skeleton = prepared(
                scene.without(hidden), scene.view, scene.root, scene.lengths, self.options(basis)
            )
            estimate, with_hinges = skeleton.whole(), {}
            if (pattern, fraction) == (first, hinged_fraction):
                off = skeleton.under(hinged).whole().positions - scene.positions
                with_hinges = {
                    "trial": number,
                    "clip": scene.clip,
                    "missing_fraction": fraction,
                    "relative_error": _relative(off, scene.positions),
                    "joint_error_mm": np.linalg.norm(np.delete(off, ROOT, axis=1), axis=-1).mean(),
                }
            best = better_of_mirrors(scene.positions, skeleton)
            return self._errors(scene, estimate, best, hidden, basis), with_hinges, estimate.positions

        points = [
            (pattern, fraction, number)
            for pattern in self.patterns
            for fraction in self.fractions
            for number in range(trials)
        ]
        keys = [(pattern if fraction else first, fraction, number) for pattern, fraction, number in points]
        distinct = list(dict.fromkeys(keys))
        results = dict(zip(distinct, map_processes(errors_of_point, distinct, inputs.workers), strict=True))
        rows = [
            {
                "trial": number,
                "clip": scenes[number].clip,
                "camera": scenes[number].camera,
                "missing_fraction": fraction,
                "pattern": pattern,
                **results[key][0],
            }
            for key, (pattern, fraction, number) in zip(keys, points, strict=True)
        ]
        value = min(self.fractions, key=lambda fraction: abs(fraction - SHOWN_FRACTION))
        errors = [results[(first, value, number)][0]["joint_error_mm"] for number in range(trials)]
        displayed = int(np.argsort(errors, kind="stable")[trials // 2])
        hidden = scenes[displayed].hidden(first, value, seed)
        return MissingDataErrors(
            rows=pd.DataFrame(rows),
            hinged=pd.DataFrame([row for _, row, _ in results.values() if row]),
            shown_clip=scenes[displayed].clip,
            shown_true=scenes[displayed].positions,
            shown_found=results[(first, value, displayed)][2],
            shown_imputed=hidden,
            shown_image=scenes[displayed].without(hidden),
            shown_fraction=value,
            shown_pattern=str(first),
        )

    def scene(self, stretches: LimbStretches, basis: TrajectoryBasis, number: int, seed: int) -> Scene:
        """Return one motion stretch in front of one camera; scenes with successive numbers use different cameras."""
        generator = derive_generator(seed, f"sweep:scene:{number}")
        stretch = generator.integers(len(stretches.positions))
        body, lengths = stretches.positions[stretch], stretches.lengths_mm[stretch]
        camera = self.cameras[number % len(self.cameras)]
        view = self.camera(camera, body[:, ROOT], generator)
        noise = generator.standard_normal((*body.shape[:2], 2))
        wrong = wrong_trajectory(generator, len(body), self.root_error_mm, components=basis.components)
        return Scene(
            number=number,
            clip=str(stretches.clip[stretch]),
            camera=camera,
            view=view,
            positions=body,
            images=view.project(body) + self.noise_px * noise,
            root=body[:, ROOT] + wrong,
            lengths=lengths * (1.0 + self.length_error * generator.standard_normal(len(lengths))),
            true_lengths=lengths,
        )

    def options(self, basis: TrajectoryBasis) -> Options:
        """Return the options of a reconstruction that first treats each limb alone, then refines all limbs together."""
        return Options(
            basis,
            adjust=self.adjust,
            noise_px=self.noise_px,
            use_hinges=self.use_hinges,
            time_limit_s=self.time_limit_s,
        )

    def _errors(
        self,
        scene: Scene,
        estimate: Articulated,
        best: np.ndarray,
        hidden: np.ndarray,
        basis: TrajectoryBasis,
    ) -> dict[str, Any]:
        true, positions, refined = scene.positions, estimate.positions, estimate.refined
        assert refined is not None, "the options include refinement"
        limbs, size = np.arange(true.shape[1]) != ROOT, scene.true_lengths.mean()
        each = np.linalg.norm(positions - true, axis=-1)
        spherical, cartesian = length_violations(refined, basis)

        def imputed(distances: np.ndarray) -> float:
            return distances[hidden].mean() if hidden.any() else np.nan

        relative = relative_trajectories(WALKER14, true)
        choices = [estimate.limbs[limb] for limb in WALKER14.limbs]
        eta = of_clip(
            [reconstructibility_of(*limb) for limb in zip(choices, relative.swapaxes(0, 1), strict=True)]
        )
        of_limbs = pd.DataFrame([certificate(choice) for choice in choices])
        baseline = {
            "hanging": baselines.hanging(scene.root, scene.lengths),
            "mean_pose": baselines.mean_pose(scene.root, true),
        }
        distances_of = {name: np.linalg.norm(still - true, axis=-1) for name, still in baseline.items()}
        return {
            "relative_error": _relative(positions - true, true),
            # Mean distance of joints from the truth over the mean length of a limb.
            "limb_error": distance(positions[:, limbs], true[:, limbs]) / size,
            "joint_error_mm": each[:, limbs].mean(),
            "imputed_error_mm": imputed(each),
            "seen_error_mm": each[limbs & ~hidden].mean(),
            "missing_share": hidden[:, limbs].mean(),
            # With the better of every limb and its mirror, not refined.
            "relative_error_up_to_mirror": _relative(best - true, true),
            "limb_error_up_to_mirror": distance(best[:, limbs], true[:, limbs]) / size,
            "reconstructibility": eta.ratio,
            "proved": of_limbs["proved"].all(),
            "objective": of_limbs["objective"].sum(),
            "lower_bound": of_limbs["lower_bound"].sum(),
            "reprojection_error_px": refined.reprojection_error_px,
            "length_violation": spherical,
            "cartesian_length_violation": cartesian,
            # Baselines with the same wrong root.
            **{f"{name}_relative_error": _relative(still - true, true) for name, still in baseline.items()},
            **{f"{name}_error_mm": off[:, limbs].mean() for name, off in distances_of.items()},
            **{f"{name}_imputed_error_mm": imputed(off) for name, off in distances_of.items()},
        }


def _relative(off: np.ndarray, true: np.ndarray) -> float:
    """Return ||X - X_hat|| / ||X|| from position errors and true positions (F, 15, 3) in world coordinates."""
    return float(np.linalg.norm(off) / np.linalg.norm(true))


def length_violations(refined: Refinement, basis: TrajectoryBasis) -> tuple[float, float]:
    """Return the largest relative change of a limb length, from spherical and from Cartesian trajectory coefficients.

    Lengths are checked at frames and between them.  Cartesian trajectories are coordinates in the same basis, fitted to
    the relative trajectories at the frames.

    Notes
    -----
    The first result is rounded to twelve decimals, because it is only a rounding error.
    """
    frames, limbs = refined.relative.shape[:2]
    times = np.linspace(0.0, frames - 1.0, CHECKS_PER_FRAME * (frames - 1) + 1)
    rows = cosine_basis(frames, basis.components, at=times)
    spherical = np.linalg.norm(refined.relative_at(rows), axis=-1) / refined.lengths - 1.0
    fitted = coefficients(
        cosine_basis(frames, basis.components),
        np.ones(frames, bool),
        refined.relative.reshape(frames, -1),
        ridge=basis.ridge,
    )
    between = (rows @ fitted).reshape(len(times), limbs, 3)
    cartesian = np.linalg.norm(between, axis=-1) / refined.lengths - 1.0
    return round(float(np.abs(spherical).max()), 12), np.abs(cartesian).max()
