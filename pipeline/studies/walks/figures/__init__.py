"""studies.walks.figures."""
