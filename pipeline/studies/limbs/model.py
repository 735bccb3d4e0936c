"""The trajectory basis and what it leaves of true limbs: park2011 section 2.  Nothing is learnt."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from pipeline.core import trajectory_basis
from pipeline.core.articulated_trajectory import TrajectoryBasis, TrajectoryBasisByRule
from pipeline.core.limb_chain import WALKER14, relative_trajectories
from pipeline.studies.limbs.dataset import LimbDataset, LimbStretches
from pipeline.studies.study import Model
from pipeline.validation import CountOrAll, Positive, require_range


class Basis(StrEnum):
    """What keeps a trajectory smooth."""

    hard = "hard"
    """K cosines, as printed."""
    soft = "soft"
    """K cosines with a ridge (k / softness)^6."""


@dataclass(frozen=True)
class BasisFit:
    """The basis, and how well limbs lie in it.

    Attributes
    ----------
    basis : (F, K)
        Cosines.
    words : str
    """

    basis: np.ndarray
    words: str


@dataclass(kw_only=True)
class TrajectoryBasisModel(Model):
    """The trajectory basis: its options alone are used, K is looked at."""

    dataset = LimbDataset

    components: CountOrAll = 20  # K; 0: each limb chooses its own, from its images
    basis: Basis = Basis.hard
    softness: Positive = 10.0  # of a soft basis

    @property
    def cutoff(self) -> float | None:
        """Cutoff of a soft basis; None for a hard one."""
        return self.softness if self.basis is Basis.soft else None

    def limb_basis(self) -> TrajectoryBasis | TrajectoryBasisByRule:
        """Return the trajectory basis; with no components, the rule by which each limb chooses its own."""
        return (
            TrajectoryBasis(self.components, self.cutoff)
            if self.components
            else TrajectoryBasisByRule(self.cutoff)
        )

    def fixed_basis(self) -> TrajectoryBasis:
        """Return the trajectory basis where K has to be known before any limb is seen.

        Raises
        ------
        InvalidInput
            If each limb was to choose its own.
        """
        require_range("model.components", self.components, at_least=1, unit="for errors in the basis")
        return TrajectoryBasis(self.components, self.cutoff)

    def learn(self, dataset: LimbStretches, *, workers: int) -> BasisFit:
        """Return the basis, and what it leaves of every limb."""
        frames = dataset.positions.shape[1]
        relative = np.stack([relative_trajectories(WALKER14, p) for p in dataset.positions])
        whole = trajectory_basis.cosine_basis(frames, frames)
        energy = np.square(np.einsum("fk,nfld->nkld", whole, relative)).sum(axis=-1)  # (N, F, 14)
        beyond = np.cumsum(energy[:, ::-1], axis=1)[:, ::-1] - energy
        size = np.square(dataset.lengths_mm)[:, None] * frames
        rms = np.sqrt(np.maximum(beyond, 0.0) / np.maximum(size, 1e-12))
        kind = "hard" if self.cutoff is None else f"soft, k0 = {self.cutoff:g}"
        require_range("model.components", self.components, at_most=frames)
        if self.components:
            components = np.full((len(relative), relative.shape[2]), self.components)
            many = f"{self.components} cosines"
        else:
            chosen = [
                [trajectory_basis.choose_components(limb) for limb in r.swapaxes(0, 1)] for r in relative
            ]
            components = np.array([[limb.components for limb in body] for body in chosen])
            middle = np.median(components)
            many = f"each limb's own number of cosines, at the median {middle:g} for the true ones,"
        left = float(np.median(np.take_along_axis(rms, components[:, None] - 1, axis=1)))
        return BasisFit(
            basis=trajectory_basis.cosine_basis(frames, int(components.max())),
            words=f"{many} ({kind}) that leave {100 * left:.1f} % of a limb's length",
        )
