"""Anatomical prior for 3D walks from one view: mirror images, and bones of constant, symmetric length.

It solves the problem of the papers' two approaches (`pipeline.core.reconstruction`), the missing dimension of a walk
[zhang2007 3.2], and adds standard deviations.

===================  ======================================================================================
`prior`              mean and shrunken covariance of walks with any number of harmonics; variation of bone lengths
`conditional`        missing given observed coefficients: Gaussian, linear, in closed form
`lengths`            the same with bones of constant and symmetric length: a few Newton steps per view
`stance`             constraint that a standing foot moves with the belt
`proportions`        constraint that people have the proportions of the average walker
`laboratories`       walkers of laboratories outside the training data
`bars`               standard deviations at instants; multipliers calibrated on other people
`view_posterior`     modes of the view angle, the coefficients integrated out
===================  ======================================================================================
"""

from walk3d.anatomy.prior.bars import (
    GROUP_OF_JOINT,
    GROUPS,
    at_instants,
    deviation_at_instants,
    multipliers_without,
)
from walk3d.anatomy.prior.conditional import (
    NOTHING_HIDDEN,
    Conditional,
    Noise,
    condition,
    expect_from_walks,
    unknown_coefficients,
)
from walk3d.anatomy.prior.laboratories import (
    Differences,
    concentration,
    definitions,
    learn_differences,
    unfamiliar,
)
from walk3d.anatomy.prior.lengths import Lengths, Posterior, Tolerances, fit_lengths, tolerances
from walk3d.anatomy.prior.prior import (
    BONES,
    JOINTS,
    PAIRS,
    PHASES,
    Prior,
    Shrinkage,
    Walks,
    bone_lengths,
    by_block,
    by_joint,
    fit,
    image_axes,
    mirror_image,
    person_weights,
    structured_covariance,
    within_harmonics,
)
from walk3d.anatomy.prior.proportions import proportion_rows, with_proportions
from walk3d.anatomy.prior.stance import stance_rows, with_stance
from walk3d.anatomy.prior.view_posterior import (
    ViewPosterior,
    circle,
    posterior_of,
    view_costs,
)

__all__ = [
    "BONES",
    "GROUPS",
    "GROUP_OF_JOINT",
    "JOINTS",
    "NOTHING_HIDDEN",
    "PAIRS",
    "PHASES",
    "Conditional",
    "Differences",
    "Lengths",
    "Noise",
    "Posterior",
    "Prior",
    "Shrinkage",
    "Tolerances",
    "ViewPosterior",
    "Walks",
    "at_instants",
    "bone_lengths",
    "by_block",
    "by_joint",
    "circle",
    "concentration",
    "condition",
    "definitions",
    "deviation_at_instants",
    "expect_from_walks",
    "fit",
    "fit_lengths",
    "image_axes",
    "learn_differences",
    "mirror_image",
    "multipliers_without",
    "person_weights",
    "posterior_of",
    "proportion_rows",
    "stance_rows",
    "structured_covariance",
    "tolerances",
    "unfamiliar",
    "unknown_coefficients",
    "view_costs",
    "with_proportions",
    "with_stance",
    "within_harmonics",
]
