"""formats.acclaim."""
