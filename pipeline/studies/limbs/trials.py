"""What experiments on limbs share: cameras, stretches and limbs of trials, the basis that the model names."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.core import camera_paths
from pipeline.core.articulated_trajectory.limb_choice import (
    LimbChoice,
    Smoothness,
    SmoothnessByRule,
    choose_limb,
)
from pipeline.core.articulation import Adjustment
from pipeline.core.limb_chain import WALKER14
from pipeline.core.pinhole import Pinhole
from pipeline.core.trajectory_basis import cosine_basis
from pipeline.storage.store import Artefact, derive_generator
from pipeline.studies.options import LimbSweep, TrajectoryBasisModel
from pipeline.studies.sweep_checks import ADJUSTMENTS, CAMERAS, check_names
from pipeline.validation import InvalidInput

STARTS = ("programme", "random_signs", "mean_direction")
"""Of the refinement: the chosen candidates, candidates by the toss of a coin, one direction for all frames."""


def smoothness(options: TrajectoryBasisModel) -> Smoothness | SmoothnessByRule:
    """The trajectory basis that the options name; with no components, each limb chooses its own by the rule."""
    if options.basis not in ("hard", "soft"):
        raise InvalidInput(
            "the basis is unknown", where="model.basis", expected="hard or soft", received=options.basis
        )
    if options.components < 0:
        raise InvalidInput(
            "a trajectory basis has no component",
            where="model.components",
            expected="1 or more, or 0: each limb chooses its own",
            received=str(options.components),
        )
    cutoff = options.softness if options.basis == "soft" else None
    return Smoothness(options.components, cutoff) if options.components else SmoothnessByRule(cutoff)


def fixed_smoothness(options: TrajectoryBasisModel, why: str) -> Smoothness:
    """The trajectory basis that the options name, where its K has to be known before any limb is seen.

    Parameters
    ----------
    options : TrajectoryBasisModel
    why : str
        What needs it, for the refusal.

    Raises
    ------
    InvalidInput
        If each limb was to choose its own.
    """
    named = smoothness(options)
    if isinstance(named, Smoothness):
        return named
    raise InvalidInput(f"{why} needs a given K", where="model.components", expected="1 or more", received="0")


def camera_on(
    kind: str,
    root: np.ndarray,
    generator: np.random.Generator,
    *,
    distance_mm: float,
    focal_px: float,
    around_deg: float,
    azimuth_rad: float | None = None,
) -> Pinhole:
    """A camera that looks at a moving root from a random side, or from a given one.

    Parameters
    ----------
    kind : {"still", "moving", "shaky"}
        Fixed in place and direction; walking around; the same in somebody's hand.
    root : (F, 3)
        Trajectory that it looks at, mm.
    generator : numpy.random.Generator
        For the side, the way round and the hand.
    distance_mm, focal_px : float
        The image of what stands at the distance has focal_px / distance_mm pixels to the millimetre.
    around_deg : float
        How far it walks around.
    azimuth_rad : float, optional
        Of its middle position.
    """
    if kind not in CAMERAS:
        raise InvalidInput(
            "the camera is unknown", where="sweep.cameras", expected=", ".join(CAMERAS), received=kind
        )
    side = generator.uniform(-np.pi, np.pi) if azimuth_rad is None else azimuth_rad
    way = generator.choice([-1.0, 1.0])
    middle = np.nanmean(root, axis=0)
    scale = focal_px / distance_mm
    if kind == "still":
        return camera_paths.still(
            len(root), target=middle, distance_mm=distance_mm, azimuth_rad=side, px_per_mm=scale
        )
    sweep = way * np.radians(around_deg)
    camera = camera_paths.around(
        len(root),
        target=middle,
        sweep_rad=sweep,
        distance_mm=distance_mm,
        azimuth_rad=side,
        px_per_mm=scale,
    )
    if kind == "moving":
        return camera
    return camera_paths.hand_held(generator, camera, target=middle)


@dataclass(frozen=True)
class LimbTrial:
    """One limb of one stretch before one camera.

    Attributes
    ----------
    number, stretch, limb : int
        Of the trial, of the stretch in the data set, and in ``WALKER14.limbs``.
    camera : str
    view : Pinhole
    images : (F, 2)
        px, without noise.
    noise : (F, 2)
        Standard normal.
    parent, child : (F, 3)
        True trajectories of both ends, mm.
    length : float
        Mean over the whole stretch, mm.
    """

    number: int
    stretch: int
    limb: int
    camera: str
    view: Pinhole
    images: np.ndarray
    noise: np.ndarray
    parent: np.ndarray
    child: np.ndarray
    length: float

    @property
    def relative(self) -> np.ndarray:
        """True relative trajectory (F, 3), mm."""
        return np.asarray(self.child - self.parent)

    def part(self, start: int, frames: int) -> LimbTrial:
        """The same limb in some of its frames."""
        here = slice(start, start + frames)
        turned = self.view.rotation[here] if self.view.rotation.ndim > 2 else self.view.rotation
        centre = self.view.centre[here] if self.view.centre.ndim > 1 else self.view.centre
        cut = {name: getattr(self, name)[here] for name in ("images", "noise", "parent", "child")}
        return replace(self, view=Pinhole(self.view.intrinsics, turned, centre), **cut)


def adjustment(name: str) -> Adjustment:
    """One of `ADJUSTMENTS` by its name."""
    check_names("adjust", [name], ADJUSTMENTS)
    return next(known for known in ADJUSTMENTS if known == name)


def limb_trial(options: LimbSweep, dataset: Artefact, number: int, camera: str, seed: int) -> LimbTrial:
    """A trial by its number: stretch, limb and side are the same for every camera.

    Parameters
    ----------
    options : LimbSweep
    dataset : Artefact
        Limbs.
    number : int
    camera : str
        One of `CAMERAS`.
    seed : int
    """
    generator = derive_generator(seed, f"sweep:limb:{number}")
    positions = dataset.arrays["positions"]
    stretch = int(generator.integers(len(positions)))
    limb = int(generator.integers(len(WALKER14.limbs)))
    side = float(generator.uniform(-np.pi, np.pi))
    body = positions[stretch]
    noise = generator.standard_normal((len(body), 2))
    parent, child = WALKER14.ends[limb]
    view = camera_on(
        camera,
        body[:, WALKER14.joints.index(WALKER14.root)],
        derive_generator(seed, f"sweep:limb:{number}:{camera}"),
        distance_mm=options.distance_mm,
        focal_px=options.focal_px,
        around_deg=options.around_deg,
        azimuth_rad=side,
    )
    return LimbTrial(
        number=number,
        stretch=stretch,
        limb=limb,
        camera=camera,
        view=view,
        images=view.project(body[:, child]),
        noise=noise,
        parent=body[:, parent],
        child=body[:, child],
        length=float(dataset.arrays["lengths_mm"][stretch, limb]),
    )


def choose(
    trial: LimbTrial,
    smooth: Smoothness | SmoothnessByRule,
    options: LimbSweep,
    *,
    adjust: str = "per_frame",
    noise_px: float = 0.0,
    parent: np.ndarray | None = None,
    scale: float = 1.0,
) -> LimbChoice:
    """What the programme makes of a trial.

    Parameters
    ----------
    trial : LimbTrial
    smooth : Smoothness or SmoothnessByRule
    options : LimbSweep
        For its time limit.
    adjust : str
        One of `ADJUSTMENTS`.
    noise_px : float
        Of the images.
    parent : (F, 3), optional
        Trajectory that is taken for the parent's, mm; the true one by default.
    scale : float
        Of the length that is assumed; 1 is the true one.
    """
    return choose_limb(
        trial.view.matrix,
        trial.images + noise_px * trial.noise,
        trial.parent if parent is None else parent,
        scale * trial.length,
        smoothness=smooth,
        adjust=adjustment(adjust),
        noise_px=noise_px,
        time_limit_s=options.time_limit_s,
    )


def wrong_trajectory(
    generator: np.random.Generator, frames: int, size_mm: float, *, components: int | None
) -> np.ndarray:
    """An error (F, 3) of a trajectory, of a given mean size, mm: white, or in the basis of so many cosines.

    Parameters
    ----------
    generator : numpy.random.Generator
    frames : int
    size_mm : float
    components : int or None
        None for white noise.
    """
    if components is None:
        error = generator.standard_normal((frames, 3))
    else:
        error = cosine_basis(frames, components) @ generator.standard_normal((components, 3))
    return np.asarray(size_mm / np.linalg.norm(error, axis=1).mean() * error)
