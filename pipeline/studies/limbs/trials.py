"""Trials that reconstruct a random limb of a random motion stretch from a random side: park2011 section 5.1."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from pipeline.clips.kinds import VariedClips
from pipeline.core.articulated_trajectory import (
    LimbChoice,
    TrajectoryBasis,
    choose_limb,
)
from pipeline.core.articulation import Adjustment
from pipeline.core.limb_chain import WALKER14
from pipeline.core.pinhole import Pinhole
from pipeline.core.trajectory_basis import cosine_basis
from pipeline.seeding import derive_generator
from pipeline.studies.limbs.cameras import Camera, CameraSweep
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.model import BasisFit
from pipeline.studies.study import SweepInputs, scaled
from pipeline.validation import Distinct, NonNegative, bounded

LimbInputs = SweepInputs[VariedClips, LimbStretches, BasisFit]

ROOT = WALKER14.joints.index(WALKER14.root)


@dataclass(frozen=True)
class LimbTrial:
    """One limb of one motion stretch in front of one camera.

    Attributes
    ----------
    number, limb : int
        Number of the trial, and of the limb in ``WALKER14.limbs``.
    clip : str
    camera : Camera
    view : Pinhole
    images : (F, 2)
        Images without noise, px.
    noise : (F, 2)
        Standard normal noise.
    parent, child : (F, 3)
        True trajectories of both ends, mm.
    length : float
        Mean length over the whole stretch, mm.
    """

    number: int
    clip: str
    limb: int
    camera: Camera
    view: Pinhole
    images: np.ndarray
    noise: np.ndarray
    parent: np.ndarray
    child: np.ndarray
    length: float

    @property
    def keys(self) -> dict[str, Any]:
        """Table columns that identify a trial, with their values."""
        limb = WALKER14.limbs[self.limb]
        return {"trial": self.number, "clip": self.clip, "limb": limb, "camera": self.camera}

    @property
    def relative(self) -> np.ndarray:
        """True trajectory (F, 3), mm, of the limb's end relative to its parent joint."""
        return self.child - self.parent


class LimbSweep(CameraSweep):
    """Options of a sweep that varies one quantity and uses the same trials for each of its values."""

    trials: Annotated[int, bounded(at_least=1, at_most=1_000_000)] = scaled(
        value="trials"
    )  # number at every point
    cameras: Distinct[Camera] = [Camera.shaky, Camera.still]  # cameras; figures show the first
    time_limit_s: NonNegative = 5.0  # nominal, per certificate (see `minimise`)

    def trial(self, stretches: LimbStretches, number: int, camera: Camera, seed: int) -> LimbTrial:
        """Return the trial with this number; its stretch, limb and viewing side are the same for every camera."""
        generator = derive_generator(seed, f"sweep:limb:{number}")
        stretch = generator.integers(len(stretches.positions))
        limb = int(generator.integers(len(WALKER14.limbs)))
        side = generator.uniform(-np.pi, np.pi)
        body = stretches.positions[stretch]
        noise = generator.standard_normal((len(body), 2))
        parent, child = WALKER14.ends[limb]
        path = derive_generator(seed, f"sweep:limb:{number}:{camera}")
        view = self.camera(camera, body[:, ROOT], path, azimuth_rad=side)
        return LimbTrial(
            number=number,
            clip=str(stretches.clip[stretch]),
            limb=limb,
            camera=camera,
            view=view,
            images=view.project(body[:, child]),
            noise=noise,
            parent=body[:, parent],
            child=body[:, child],
            length=stretches.lengths_mm[stretch, limb],
        )

    def every_trial(self, inputs: LimbInputs) -> list[LimbTrial]:
        """Return all trials, sorted by camera and then by trial number."""
        return [
            self.trial(inputs.dataset, number, camera, inputs.seed)
            for camera in self.cameras
            for number in range(self.trials)
        ]

    def choose(
        self,
        trial: LimbTrial,
        basis: TrajectoryBasis,
        *,
        adjust: Adjustment = Adjustment.per_frame,
        noise_px: float = 0.0,
        parent: np.ndarray | None = None,
        scale: float = 1.0,
        time_limit_s: float | None = None,
    ) -> LimbChoice:
        """Return the ray-sphere intersections that the binary programme selects for the limb of a trial.

        Parameters
        ----------
        trial : LimbTrial
        basis : TrajectoryBasis
        adjust : Adjustment
        noise_px : float
            Noise of the images.
        parent : (F, 3), optional
            Assumed trajectory of the parent, mm; the true one by default.
        scale : float
            Assumed length relative to the true one.
        time_limit_s : float, optional
            Nominal time for the certificate; that of the sweep by default.
        """
        return choose_limb(
            trial.view.matrix,
            trial.images + noise_px * trial.noise,
            trial.parent if parent is None else parent,
            scale * trial.length,
            basis=basis,
            adjust=adjust,
            noise_px=noise_px,
            time_limit_s=self.time_limit_s if time_limit_s is None else time_limit_s,
        )


def wrong_trajectory(
    generator: np.random.Generator, frames: int, size_mm: float, *, components: int | None
) -> np.ndarray:
    """Return a random error (F, 3), mm, of a trajectory, with a given mean size.

    The error is white noise, or smooth in a basis of cosines.

    Parameters
    ----------
    generator : numpy.random.Generator
    frames : int
    size_mm : float
    components : int or None
        Number of cosines of the basis; None for white noise.
    """
    if components is None:
        error = generator.standard_normal((frames, 3))
    else:
        error = cosine_basis(frames, components) @ generator.standard_normal((components, 3))
    return size_mm / np.linalg.norm(error, axis=1).mean() * error


def stacked(rows: Sequence[Mapping[str, Any]], shape: Sequence[int]) -> dict[str, np.ndarray]:
    """Return results for all points of a grid as arrays by name; the first array axes are the axes of the grid.

    Parameters
    ----------
    rows : sequence of mapping
        Results at the points of the grid, the last axis fastest.
    shape : sequence of int
        Shape of the grid.

    Examples
    --------
    >>> stacked([{"error": 1.0}, {"error": 2.0}], (2, 1))["error"].tolist()
    [[1.0], [2.0]]
    """
    columns = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
    return {name: values.reshape(*shape, *values.shape[1:]) for name, values in columns.items()}
