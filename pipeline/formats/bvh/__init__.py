"""Reading of BVH files."""

from pipeline.formats.bvh.reading import read

__all__ = ["read"]
