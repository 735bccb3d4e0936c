"""Intersection of image rays with the sphere on which the end of a limb lies (park2011 sections 2 and 3.2)."""

from pipeline.core.articulation.hits import (
    ROBUST_QUANTILE,
    Adjustment,
    RayHits,
    RayStatus,
    on_sphere,
    ray_sphere,
)
from pipeline.core.articulation.rays import cast_rays

__all__ = ["ROBUST_QUANTILE", "Adjustment", "RayHits", "RayStatus", "cast_rays", "on_sphere", "ray_sphere"]
