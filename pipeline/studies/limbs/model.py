"""Trajectory basis of cosines, and how well it represents the true limb trajectories: park2011 section 2.

The basis is fixed, so nothing is learnt.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from pipeline.core import trajectory_basis
from pipeline.core.articulated_trajectory import TrajectoryBasis
from pipeline.core.limb_chain import WALKER14, relative_trajectories
from pipeline.studies.limbs.dataset import LimbDataset, LimbStretches
from pipeline.studies.study import Model
from pipeline.validation import Count, Positive, require_range


class Basis(StrEnum):
    """Method to keep trajectories smooth."""

    hard = "hard"
    """The trajectory is any combination of K cosines, as in the paper."""
    soft = "soft"
    """The coefficient of cosine k has the ridge penalty (k / softness)^6."""


@dataclass(frozen=True)
class BasisFit:
    """Caption text on the residual of the true limb trajectories outside the trajectory basis."""

    words: str


class TrajectoryBasisModel(Model):
    """Options of the trajectory basis, which is fixed and not learnt."""

    dataset = LimbDataset

    components: Count = 20  # number of cosines K
    basis: Basis = Basis.hard
    softness: Positive = 10.0  # cutoff of a soft basis

    @property
    def cutoff(self) -> float | None:
        """Cutoff of a soft trajectory basis, in cosines; None for a hard basis."""
        return self.softness if self.basis is Basis.soft else None

    def limb_basis(self) -> TrajectoryBasis:
        """Return the trajectory basis that the options define."""
        return TrajectoryBasis(self.components, self.cutoff)

    def learn(self, dataset: LimbStretches, *, workers: int) -> BasisFit:
        """Return a caption text on the residual of the true limb trajectories outside the trajectory basis."""
        frames = dataset.positions.shape[1]
        relative = np.stack([relative_trajectories(WALKER14, p) for p in dataset.positions])
        full_basis = trajectory_basis.cosine_basis(frames, frames)
        energy = np.square(np.einsum("fk,nfld->nkld", full_basis, relative)).sum(axis=-1)  # (N, F, 14)
        beyond = np.cumsum(energy[:, ::-1], axis=1)[:, ::-1] - energy
        size = np.square(dataset.lengths_mm)[:, None] * frames
        rms = np.sqrt(np.maximum(beyond, 0.0) / np.maximum(size, 1e-12))
        kind = "hard" if self.cutoff is None else f"soft, k0 = {self.cutoff:g}"
        require_range("model.components", self.components, at_most=frames)
        left = np.median(rms[:, self.components - 1])
        return BasisFit(
            f"{self.components} cosines ({kind}) that leave {100 * left:.1f} % of a limb's length",
        )
