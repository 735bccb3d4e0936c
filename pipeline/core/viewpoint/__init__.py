"""View angle and coefficients together: zhang2007 section 4.3 and appendix B, zhang2004 section 4.3.

`estimate` takes the phase of the walker as known, as the papers do; `estimate_unknown_phase` finds it too.

Symbols
-------
``alpha``  true view angle of an observation; ``beta`` a candidate, rad
``J``      the cost of [zhang2007 4.5] squared, or of [zhang2007 4.6] times 2 sigma², coefficients eliminated; mm²
"""

from pipeline.core.viewpoint.estimate import FULL_CIRCLE, estimate
from pipeline.core.viewpoint.unknown_phase import PhasedEstimate, estimate_unknown_phase
from pipeline.core.viewpoint.view_estimate import ViewEstimate

__all__ = ["FULL_CIRCLE", "PhasedEstimate", "ViewEstimate", "estimate", "estimate_unknown_phase"]
