"""Data sets and their recordings: selection, reading, mapping to joints, and preparation as clips."""
