"""Types of clips, without a reader, and which part of a clip is usable."""
