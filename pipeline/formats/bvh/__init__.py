"""Biovision hierarchies with motion (BVH)."""

from pipeline.formats.bvh.motion import read
from pipeline.formats.bvh.writing import write

__all__ = ["read", "write"]
