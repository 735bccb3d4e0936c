"""Reading of the point trajectories in C3D files, in pure Python."""

from pipeline.formats.c3d.points import read

__all__ = ["read"]
