"""Types of motion clips, and selection of the usable part of a clip."""
