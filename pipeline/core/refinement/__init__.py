"""Refinement of the trajectories of a whole body by its reprojection error (park2011 section 3.1)."""

from pipeline.core.refinement.steps import LENGTH_FACTOR, Refinement, RefinementOptions, refine

__all__ = ["LENGTH_FACTOR", "Refinement", "RefinementOptions", "refine"]
