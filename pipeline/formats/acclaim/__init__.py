"""Acclaim files: a skeleton (ASF) and the motions of it (AMC)."""

from pipeline.formats.acclaim.amc import read, skeleton_of

__all__ = ["read", "skeleton_of"]
