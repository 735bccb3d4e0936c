"""formats.points."""
