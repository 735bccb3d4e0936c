"""Particle filter with the action model as prior: what mozerov2006 learns the model for (its sections 1 and 4)."""

from pipeline.core.tracking.filter import Track, track

__all__ = ["Track", "track"]
