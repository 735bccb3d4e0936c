"""Biovision hierarchies with motion (BVH)."""

from pipeline.formats.bvh.motion import read

__all__ = ["read"]
