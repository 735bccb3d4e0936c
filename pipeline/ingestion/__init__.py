"""Data sets and the recordings in them, based on formats, mappings and fetch."""
