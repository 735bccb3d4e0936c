"""Data sets and their recordings: the only door to formats, mappings and fetch."""
