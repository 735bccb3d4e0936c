"""Settings of a reconstruction: what is learnt, and what is believed of noise and lengths."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from walk3d.anatomy.prior import Differences, Noise, Shrinkage
from walk3d.anatomy.study.model import AnatomicalModel


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One way to reconstruct.

    Attributes
    ----------
    harmonics : int
    all_walks : bool
        Learn from every walk of a person; otherwise from the one that is tested.
    shrinkage : Shrinkage
    noise : Noise
    within, pairs : float
        Factors on the tolerances of lengths; both infinite: the linear part alone.
    stance : float
        Weight of the stance rows.
    proportions : float
        How far bones may be from the proportions of the average walker, mm.
    differences : Differences, optional
        What is assumed of a laboratory that is not among the training walks, before these tell more.
    """

    harmonics: int = 4
    all_walks: bool = True
    shrinkage: Shrinkage = field(default_factory=Shrinkage)
    noise: Noise = field(default_factory=Noise)
    within: float = np.inf
    pairs: float = np.inf
    stance: float = 0.0
    proportions: float = np.inf
    differences: Differences | None = None

    @property
    def linear(self) -> Setting:
        """The same without lengths."""
        return replace(self, within=np.inf, pairs=np.inf)

    @property
    def lengths(self) -> bool:
        """Whether bones count."""
        return bool(np.isfinite(self.within) or np.isfinite(self.pairs))

    @property
    def sampled(self) -> bool:
        """Whether the covariance is the sample covariance as it is, and sigma² the only noise."""
        return self.linear == replace(
            approach_two(self.noise.variance),
            harmonics=self.harmonics,
            all_walks=self.all_walks,
            shrinkage=replace(PLAIN, mirror=self.shrinkage.mirror),
        )

    def with_noise(self, variance: float) -> Setting:
        """The same with another sigma²."""
        return replace(self, noise=replace(self.noise, variance=variance))


PLAIN = Shrinkage(mirror=False, within_harmonic=0.0, diagonal=0.0, extra_variance=0.0)
"""The sample covariance as it is."""


def approach_two(noise_variance: float) -> Setting:
    """MAP with every eigenwalker: two harmonics, one walk a person [zhang2007 3.15]."""
    return Setting(
        harmonics=2, all_walks=False, shrinkage=PLAIN, noise=Noise(variance=noise_variance, share=0.0)
    )


def anatomical_setting(options: AnatomicalModel, harmonics: int) -> Setting:
    """The model's options as a setting."""
    return Setting(
        harmonics=harmonics,
        shrinkage=options.shrinkage,
        noise=options.noise,
        within=options.length_factor,
        pairs=options.pair_factor,
    )
