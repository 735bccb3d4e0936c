"""View angle and coefficients together: zhang2007 section 4.3 and appendix B, zhang2004 section 4.3."""

from pipeline.core.viewpoint.known_phase import FULL_CIRCLE, ViewEstimate, estimate

__all__ = ["FULL_CIRCLE", "ViewEstimate", "estimate"]
