"""studies.walks."""
