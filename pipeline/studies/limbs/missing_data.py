"""Error of a whole skeleton against the share of points that are missing from its images: park2011 figure 3d.

As there, lengths, images and root trajectory are wrong as well, the camera stands still, and nothing is known of the
joints: errors with knees and elbows that flex one way, which we add, stand beside at one fraction.  Points are missing
one by one at random, or each joint for a run of frames.  The root is given in 3D and never missing.
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

MOST_MISSING = 0.9

SHOWN_FRACTION = 0.2
"""The recording shows the fraction nearest to this one, missing by the first pattern."""

HINGED_FRACTION = 0.05
"""Hinges are used as well at the fraction nearest to this one, the paper's."""

BETWEEN = 10
"""Instants to a frame at which lengths are looked at."""


Missing = Annotated[float, bounded(at_least=0, at_most=MOST_MISSING)]


class Pattern(StrEnum):
    """Which points are missing."""

    random = "random"
    """Each frame of a joint by itself."""
    block = "block"
    """One run of frames of each joint."""

    def hides(self, frames: int, joints: int, fraction: float, generator: np.random.Generator) -> np.ndarray:
        """Return where points are missing (F, J) bool: where a smaller fraction misses them, and more."""
        count = round(fraction * frames)
        missing = np.zeros((frames, joints), bool)
        for joint in range(joints):
            order, place = generator.permutation(frames), generator.random()
            if self is Pattern.block:
                start = round(place * (frames - count))
                missing[start : start + count, joint] = True
            else:
                missing[order[:count], joint] = True
        return missing


@dataclass(frozen=True)
class MissingDataErrors:
    """Errors of every skeleton for every fraction of missing points and pattern, and one skeleton to look at.

    Attributes
    ----------
    rows : DataFrame
    hinged : DataFrame
        The same with knees and elbows that flex one way as well, at one fraction, missing by the first pattern.
    shown_clip : str
        Of the skeleton of median error at the fraction shown.
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
    """One stretch before one camera, and what is wrong with what is known of it.

    Attributes
    ----------
    number : int
    clip : str
    camera : Camera
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
    clip: str
    camera: Camera
    view: Pinhole
    positions: np.ndarray
    images: np.ndarray
    root: np.ndarray
    lengths: np.ndarray
    true_lengths: np.ndarray

    def hidden(self, pattern: Pattern, fraction: float, seed: int) -> np.ndarray:
        """Return where points are missing (F, 15) bool; never the root's."""
        generator = derive_generator(seed, f"sweep:missing:{self.number}:{pattern}")
        frames, joints = self.positions.shape[:2]
        missing = pattern.hides(frames, joints, fraction, generator)
        missing[:, ROOT] = False
        return missing

    def without(self, hidden: np.ndarray) -> np.ndarray:
        """Return the images (F, 15, 2), px, NaN where points are missing."""
        return np.where(hidden[..., None], np.nan, self.images)


class MissingDataSweep(LimbSweep):
    """Error of a whole skeleton against the share of missing points."""

    cameras: Distinct[Camera] = [Camera.still]
    fractions: Increasing[Missing] = [0.0, 0.05, 0.1, 0.2, 0.3, 0.5]  # of the observations that are missing
    patterns: Distinct[Pattern] = [Pattern.random, Pattern.block]
    length_error: NonNegative = 0.02  # standard deviation over limbs, relative
    root_error_mm: NonNegative = 20.0  # root mean square error of the root
    noise_px: NonNegative = 1.0  # of the image
    use_hinges: bool = False  # ours, not the paper's
    adjust: Adjustment = Adjustment.per_frame
    share: Annotated[float, bounded(above=0, at_most=1)] = 0.3  # of the trials: each is a skeleton
    time_limit_s: NonNegative = 0.0  # signs at once, without certificates

    def measure(self, inputs: LimbInputs) -> MissingDataErrors:
        """Return the errors of every skeleton for every fraction of missing points and every pattern."""
        basis = inputs.model_options.limb_basis()
        seed, trials = inputs.seed, int(np.ceil(self.share * self.trials))
        scenes = [self.scene(inputs.dataset, basis, number, seed) for number in range(trials)]

        # Nothing is missing in the same way whatever the pattern.
        first, hinged = self.patterns[0], replace(self.options(basis), use_hinges=True)
        beside = min(self.fractions, key=lambda fraction: abs(fraction - HINGED_FRACTION))

        def one(item: tuple[Pattern, float, int]) -> tuple[dict[str, Any], dict[str, Any], np.ndarray]:
            pattern, fraction, number = item
            scene = scenes[number]
            hidden = scene.hidden(pattern, fraction, seed)
            skeleton = prepared(
                scene.without(hidden), scene.view, scene.root, scene.lengths, self.options(basis)
            )
            found, with_hinges = skeleton.whole(), {}
            if (pattern, fraction) == (first, beside):
                off = skeleton.under(hinged).whole().positions - scene.positions
                with_hinges = {
                    "trial": number,
                    "clip": scene.clip,
                    "missing_fraction": fraction,
                    "relative_error": _relative(off, scene.positions),
                    "joint_error_mm": np.linalg.norm(np.delete(off, ROOT, axis=1), axis=-1).mean(),
                }
            best = better_of_mirrors(scene.positions, skeleton)
            return self._errors(scene, found, best, hidden, basis), with_hinges, found.positions

        points = [
            (pattern, fraction, number)
            for pattern in self.patterns
            for fraction in self.fractions
            for number in range(trials)
        ]
        keys = [(pattern if fraction else first, fraction, number) for pattern, fraction, number in points]
        distinct = list(dict.fromkeys(keys))
        known = dict(zip(distinct, map_processes(one, distinct, inputs.workers), strict=True))
        rows = [
            {
                "trial": number,
                "clip": scenes[number].clip,
                "camera": scenes[number].camera,
                "missing_fraction": fraction,
                "pattern": pattern,
                **known[key][0],
            }
            for key, (pattern, fraction, number) in zip(keys, points, strict=True)
        ]
        value = min(self.fractions, key=lambda fraction: abs(fraction - SHOWN_FRACTION))
        errors = [known[(first, value, number)][0]["joint_error_mm"] for number in range(trials)]
        shown = int(np.argsort(errors, kind="stable")[trials // 2])
        hidden = scenes[shown].hidden(first, value, seed)
        return MissingDataErrors(
            rows=pd.DataFrame(rows),
            hinged=pd.DataFrame([row for _, row, _ in known.values() if row]),
            shown_clip=scenes[shown].clip,
            shown_true=scenes[shown].positions,
            shown_found=known[(first, value, shown)][2],
            shown_imputed=hidden,
            shown_image=scenes[shown].without(hidden),
            shown_fraction=value,
            shown_pattern=str(first),
        )

    def scene(self, stretches: LimbStretches, basis: TrajectoryBasis, number: int, seed: int) -> Scene:
        """Return a scene by its number, before the cameras in turn."""
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
        """Return how a skeleton is reconstructed: limb by limb, and all limbs refined together."""
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
        found: Articulated,
        best: np.ndarray,
        hidden: np.ndarray,
        basis: TrajectoryBasis,
    ) -> dict[str, Any]:
        true, positions, refined = scene.positions, found.positions, found.refined
        assert refined is not None, "it was asked for"
        limbs, size = np.arange(true.shape[1]) != ROOT, scene.true_lengths.mean()
        each = np.linalg.norm(positions - true, axis=-1)
        spherical, cartesian = length_violations(refined, basis)

        def imputed(distances: np.ndarray) -> float:
            return distances[hidden].mean() if hidden.any() else np.nan

        relative = relative_trajectories(WALKER14, true)
        choices = [found.limbs[limb] for limb in WALKER14.limbs]
        eta = of_clip(
            [reconstructibility_of(*limb) for limb in zip(choices, relative.swapaxes(0, 1), strict=True)]
        )
        of_limbs = pd.DataFrame([certificate(choice) for choice in choices])
        baseline = {
            "hanging": baselines.hanging(scene.root, scene.lengths),
            "mean_pose": baselines.mean_pose(scene.root, true),
        }
        apart = {name: np.linalg.norm(still - true, axis=-1) for name, still in baseline.items()}
        return {
            "relative_error": _relative(positions - true, true),
            # Mean distance of joints from the truth over the mean length of a limb.
            "limb_error": distance(positions[:, limbs], true[:, limbs]) / size,
            "joint_error_mm": each[:, limbs].mean(),
            "imputed_error_mm": imputed(each),
            "seen_error_mm": each[limbs & ~hidden].mean(),
            "missing_share": hidden[:, limbs].mean(),
            # With of every limb and its mirror the better one, not refined.
            "relative_error_up_to_mirror": _relative(best - true, true),
            "limb_error_up_to_mirror": distance(best[:, limbs], true[:, limbs]) / size,
            "reconstructibility": eta.ratio,
            "proved": of_limbs["proved"].all(),
            "objective": of_limbs["objective"].sum(),
            "lower_bound": of_limbs["lower_bound"].sum(),
            "reprojection_error_px": refined.reprojection_error_px,
            "length_violation": spherical,
            "cartesian_length_violation": cartesian,
            # Of baselines on the same wrong root.
            **{f"{name}_relative_error": _relative(still - true, true) for name, still in baseline.items()},
            **{f"{name}_error_mm": off[:, limbs].mean() for name, off in apart.items()},
            **{f"{name}_imputed_error_mm": imputed(off) for name, off in apart.items()},
        }


def _relative(off: np.ndarray, true: np.ndarray) -> float:
    """||X - X_hat|| / ||X|| of what positions (F, 15, 3) are off, in the world's coordinates."""
    return float(np.linalg.norm(off) / np.linalg.norm(true))


def length_violations(refined: Refinement, basis: TrajectoryBasis) -> tuple[float, float]:
    """Return the largest relative change of a limb's length, of spherical and of Cartesian trajectories.

    At frames and between them.  The Cartesian ones are coordinates in the same basis, fitted to the relative
    trajectories at the frames.

    Notes
    -----
    To twelve decimals, for that of spherical trajectories is rounding.
    """
    frames, limbs = refined.relative.shape[:2]
    times = np.linspace(0.0, frames - 1.0, BETWEEN * (frames - 1) + 1)
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
