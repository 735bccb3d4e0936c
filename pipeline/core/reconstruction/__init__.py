"""Reconstruction in 3D from one known view (zhang2007 section 3.2, appendix A; zhang2004 section 3.2).

Two approaches, chosen by ``noise_variance``: None is least squares (approach I), a number in mm² is the maximum of
the posterior probability (approach II, MAP).  `least_squares` and `maximum_a_posteriori` are the printed estimators;
`from_known_views` solves the same for many views at once, and `NoisePath` for many noise variances.  All but the
printed ones go through one linear system, `Gram`.

Symbols
-------
``E, lambda``  eigenwalkers and their variances, mm²
``d``          observation less projected average walker, mm
``k``          coefficients of the eigenwalkers, mm
``sigma²``     noise variance of [zhang2007 3.12], mm²
"""

from pipeline.core.reconstruction.gram import Gram, gram_of, require_noise_variance
from pipeline.core.reconstruction.known_view import (
    KnownViews,
    from_known_views,
    least_squares,
    maximum_a_posteriori,
)
from pipeline.core.reconstruction.noise_path import NoisePath

__all__ = [
    "Gram",
    "KnownViews",
    "NoisePath",
    "from_known_views",
    "gram_of",
    "least_squares",
    "maximum_a_posteriori",
    "require_noise_variance",
]
