"""Joint estimation of view angle and coefficients: zhang2007 section 4.3 and appendix B, zhang2004 section 4.3.

The phase of the walker is known, as in the papers.

Symbols
-------
``alpha``  true view angle of an observation; ``beta`` a candidate, rad
``J``      the cost of [zhang2007 4.5] squared, or of [zhang2007 4.6] times 2 sigma², coefficients eliminated; mm²
"""

from pipeline.core.viewpoint.estimate import FULL_CIRCLE, estimate
from pipeline.core.viewpoint.view_estimate import ViewEstimate

__all__ = ["FULL_CIRCLE", "ViewEstimate", "estimate"]
