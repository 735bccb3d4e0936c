"""Types of clips, and selection of the usable part of a clip."""
