"""Data sets and their recordings, read by formats, mappings and fetch."""
