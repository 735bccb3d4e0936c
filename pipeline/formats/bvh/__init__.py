"""Biovision hierarchies with motion (BVH): channels in, positions of joints out."""

from pipeline.formats.bvh.motion import read

__all__ = ["read"]
