"""Settings of a reconstruction: training, noise and tolerances of bone lengths."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from walk3d.anatomy.prior import Differences, Noise, Shrinkage
from walk3d.anatomy.study.model import AnatomicalModel


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One setting of a reconstruction: training, noise and tolerances of bone lengths.

    Attributes
    ----------
    harmonics : int
    all_walks : bool
        Train on all walks of a person; otherwise on the tested one.
    shrinkage : Shrinkage
    noise : Noise
    within, pairs : float
        Factors on the tolerances of lengths; if both are infinite, only the linear part is used.
    stance : float
        Weight of the stance constraint.
    proportions : float
        Tolerance of bones relative to the average walker's proportions, mm.
    differences : Differences, optional
        Assumed differences of a laboratory outside the training walks, which the training walks refine.
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
        """Copy of this setting without bone-length constraints."""
        return replace(self, within=np.inf, pairs=np.inf)

    @property
    def lengths(self) -> bool:
        """True if bone lengths are constrained."""
        return bool(np.isfinite(self.within) or np.isfinite(self.pairs))

    @property
    def sampled(self) -> bool:
        """True if the prior has the plain sample covariance, and sigma² is the only noise."""
        return self.linear == replace(
            approach_two(self.noise.variance),
            harmonics=self.harmonics,
            all_walks=self.all_walks,
            shrinkage=replace(PLAIN, mirror=self.shrinkage.mirror),
        )

    def with_noise(self, variance: float) -> Setting:
        """Return a copy of this setting with another noise variance sigma²."""
        return replace(self, noise=replace(self.noise, variance=variance))


PLAIN = Shrinkage(mirror=False, within_harmonic=0.0, diagonal=0.0, extra_variance=0.0)
"""Options without any shrinkage, for a prior with the plain sample covariance."""


def approach_two(noise_variance: float) -> Setting:
    """Return the setting of MAP with all eigenwalkers: two harmonics, one walk per person [zhang2007 3.15]."""
    return Setting(
        harmonics=2, all_walks=False, shrinkage=PLAIN, noise=Noise(variance=noise_variance, share=0.0)
    )


def anatomical_setting(options: AnatomicalModel, harmonics: int) -> Setting:
    """Return the setting of the anatomical reconstruction with a model's options."""
    return Setting(
        harmonics=harmonics,
        shrinkage=options.shrinkage,
        noise=options.noise,
        within=options.length_factor,
        pairs=options.pair_factor,
    )
