"""studies.actions."""
