"""What experiments on limbs share: cameras, stretches and limbs of trials, the basis that the model names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.config import LimbSweep, RadiusScaleSweep, TrajectoryBasisModel
from pipeline.core import camera_paths
from pipeline.core.articulated import LimbChoice, Smoothness, choose_limb, taken
from pipeline.core.articulation import Adjustment
from pipeline.core.limb_chain import WALKER14
from pipeline.core.pinhole import Pinhole
from pipeline.core.trajectory_basis import cosine_basis
from pipeline.refusal import Refusal
from pipeline.store import Artefact, derive_generator

CAMERAS = ("still", "moving", "shaky")
ADJUSTMENTS: tuple[Adjustment, ...] = ("per_frame", "global", "robust")

STARTS = ("programme", "random_signs", "mean_direction")
"""Of the refinement: the chosen candidates, candidates by the toss of a coin, one direction for all frames."""

SUCCESS = 0.1
"""Of a limb's length: a mean error below it counts as success."""


def smoothness(options: TrajectoryBasisModel) -> Smoothness:
    """The trajectory basis that the options name."""
    if options.basis not in ("hard", "soft"):
        raise Refusal(
            "the basis is unknown", where="model.basis", expected="hard or soft", received=options.basis
        )
    return Smoothness(options.components, options.softness if options.basis == "soft" else None)


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
        raise Refusal(
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
    smooth: Smoothness,
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
    smooth : Smoothness
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


@dataclass(frozen=True)
class LimbScore:
    """How wrong the choice for one limb is.

    Attributes
    ----------
    limb_error : float
        Mean distance of relative trajectories, as part of the limb's true length.
    relative_error : float
        ||X - X_hat|| / ||X|| of the child in the world's coordinates, as in the paper; depends on their origin.
    error_up_to_mirror : float
        `limb_error` of the signs or of their mirror, whichever is smaller.
    """

    limb_error: float
    relative_error: float
    error_up_to_mirror: float


def limb_score(
    trial: LimbTrial, choice: LimbChoice, smooth: Smoothness, *, parent: np.ndarray | None = None
) -> LimbScore:
    """How wrong a choice is, beside the better one of it and its mirror.

    Parameters
    ----------
    trial : LimbTrial
    choice : LimbChoice
    smooth : Smoothness
    parent : (F, 3), optional
        Trajectory that was taken for the parent's, mm; the true one by default.
    """
    other = taken(choice.hits, choice.solution, choice.used, smooth, mirrored=not choice.mirrored)
    error = distance(choice.relative, trial.relative) / trial.length
    estimate = choice.relative + (trial.parent if parent is None else parent)
    return LimbScore(
        limb_error=error,
        relative_error=float(np.linalg.norm(estimate - trial.child) / np.linalg.norm(trial.child)),
        error_up_to_mirror=min(error, distance(other.relative, trial.relative) / trial.length),
    )


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """Mean distance of two trajectories (F, …, 3), mm."""
    return float(np.linalg.norm(a - b, axis=-1).mean())


def true_signs(choice: LimbChoice, relative: np.ndarray) -> np.ndarray:
    """-1 or +1 (F,): the candidate that is nearer to the truth; +1 where there is no choice."""
    along = ((relative - choice.hits.middle) * choice.hits.rays.direction).sum(axis=1)
    return np.where(along < 0, -1, 1)


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


def rank_correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Spearman's rank correlation of two series (N,); 0 where one of them is constant."""
    ranks = []
    for values in (a, b):
        _, place, count = np.unique(values, return_inverse=True, return_counts=True)
        ranks.append((np.cumsum(count) - 0.5 * (count - 1))[place])
    x, y = (rank - rank.mean() for rank in ranks)
    size = np.sqrt((x @ x) * (y @ y))
    return float(x @ y / size) if size > 0 else 0.0


def check_sweep(options: LimbSweep, *, adjusts: Sequence[str] | None = None) -> None:
    """Nothing; a Refusal if the options are none.

    Parameters
    ----------
    options : LimbSweep
    adjusts : sequence of str, optional
        Adjustments of the radius that are asked for.
    """
    for where, value, least in (
        ("trials", options.trials, 1),
        ("distance_mm", options.distance_mm, 1.0),
        ("focal_px", options.focal_px, 1.0),
        ("time_limit_s", options.time_limit_s, 0.0),
    ):
        if not least <= value < np.inf:
            raise Refusal(
                "a limb cannot be tried so",
                where=f"sweep.{where}",
                expected=f"{least:g} or more",
                received=f"{value:g}",
            )
    check_names("cameras", options.cameras, CAMERAS)
    if adjusts is not None:
        check_names("adjusts" if isinstance(options, RadiusScaleSweep) else "adjust", adjusts, ADJUSTMENTS)


def check_names(where: str, names: Sequence[str], known: Sequence[str]) -> None:
    """Nothing; a Refusal if names are none, unknown or stand twice.

    Parameters
    ----------
    where : str
        The option of the sweep.
    names, known : sequence of str
    """
    if not names or len(set(names)) < len(names) or not set(names) <= set(known):
        raise Refusal(
            "names are none, unknown or stand twice",
            where=f"sweep.{where}",
            expected="some of " + ", ".join(known),
            received=", ".join(names) or "none",
        )


def check_values(where: str, values: Sequence[float], least: float, most: float = np.inf) -> None:
    """Nothing; a Refusal if values are none, out of range, or do not increase.

    Parameters
    ----------
    where : str
        The option of the sweep.
    values : sequence of float
    least, most : float
        Ends of the range, both allowed.
    """
    given = np.asarray(values, dtype=float)
    if not given.size or not ((given >= least) & (given <= most)).all() or (np.diff(given) <= 0).any():
        raise Refusal(
            "values to be tried are none, out of range, or do not increase",
            where=f"sweep.{where}",
            expected=f"{least:g} " + ("or more" if most == np.inf else f"to {most:g}"),
            received=", ".join(f"{v:g}" for v in given) or "none",
        )
