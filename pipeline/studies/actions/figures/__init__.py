"""studies.actions.figures."""
