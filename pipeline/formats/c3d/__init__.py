"""C3D files: the trajectories of 3D points, without any native code."""

from pipeline.formats.c3d.points import read

__all__ = ["read"]
