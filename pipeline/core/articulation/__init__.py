"""Intersection of a ray with the sphere of a limb: park2011 sections 2 and 3.2."""

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
