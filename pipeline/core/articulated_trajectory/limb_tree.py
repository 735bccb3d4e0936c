"""Reconstructed limbs of a skeleton, each attached to the end of its parent limb (park2011 section 2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from pipeline.core.articulated_trajectory.limb_choice import LimbChoice
from pipeline.core.limb_chain import Chain


@dataclass(frozen=True)
class LimbTree:
    """Reconstructions of some limbs of a skeleton, from the root outwards.

    The tree is immutable: its methods return new trees.

    Attributes
    ----------
    chain : Chain
    root : (F, 3)
        X_R, mm.
    choices : dict
        A `LimbChoice` by the name of each limb that has been placed; parents are placed before their children.
    """

    chain: Chain
    root: np.ndarray
    choices: Mapping[str, LimbChoice] = field(default_factory=dict)

    def end(self, joint: str) -> np.ndarray:
        """Return the smoothed trajectory (F, 3), mm, of a joint, to which its children are attached.

        NaN if no choice has been made for the joint.

        It is smoother than the candidates themselves.
        """
        if joint == self.chain.root:
            return self.root
        if joint not in self.choices:
            return np.full_like(self.root, np.nan)
        choice = self.choices[joint]
        return self.end(self.chain.ways[joint][-1]) + choice.hits.radius * choice.directions

    def placed(self, limb: str, choice: LimbChoice) -> LimbTree:
        """Return the tree with a new reconstruction of one limb, and without the earlier ones of the limb's
        descendants.
        """
        unchanged = {
            name: other for name, other in self.choices.items() if limb not in (name, *self.chain.ways[name])
        }
        return replace(self, choices={**unchanged, limb: choice})

    @property
    def positions(self) -> np.ndarray:
        """Joint positions (F, J, 3), mm, from the chosen candidates; imputed in frames without candidates."""
        positions = np.full((len(self.root), len(self.chain.joints), 3), np.nan)
        positions[:, self.chain.joints.index(self.chain.root)] = self.root
        for limb, choice in self.choices.items():
            positions[:, self.chain.joints.index(limb)] = (
                self.end(self.chain.ways[limb][-1]) + choice.relative
            )
        return positions

    @property
    def imputed(self) -> np.ndarray:
        """Mask (F, J) of joints that were not observed or have no candidate in front of the camera."""
        imputed = np.zeros((len(self.root), len(self.chain.joints)), bool)
        for limb, choice in self.choices.items():
            imputed[:, self.chain.joints.index(limb)] = ~choice.used
        return imputed

    @property
    def lengths(self) -> np.ndarray:
        """Limb lengths (L,), mm, after adjustment to the image rays."""
        return np.array([self.choices[limb].hits.radius for limb in self.chain.limbs])
