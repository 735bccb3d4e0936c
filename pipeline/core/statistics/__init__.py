"""core.statistics."""
