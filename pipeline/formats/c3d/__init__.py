"""C3D files: trajectories of points, read without native code."""

from pipeline.formats.c3d.points import read

__all__ = ["read"]
