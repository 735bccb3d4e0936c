"""Where a ray meets the sphere of a limb: park2011 sections 2 and 3.2."""

from pipeline.core.articulation.hits import ROBUST_QUANTILE, Adjustment, RayHits, RayStatus, ray_sphere

__all__ = ["ROBUST_QUANTILE", "Adjustment", "RayHits", "RayStatus", "ray_sphere"]
