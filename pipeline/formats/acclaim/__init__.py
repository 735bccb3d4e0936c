"""Reading of Acclaim files: a skeleton (ASF) and its motions (AMC)."""

from pipeline.formats.acclaim.amc import read, skeleton_of

__all__ = ["read", "skeleton_of"]
