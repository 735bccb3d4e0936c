"""C3D files: trajectories of points, read without native code."""

from pipeline.formats.c3d.points import read
from pipeline.formats.c3d.writing import write

__all__ = ["read", "write"]
