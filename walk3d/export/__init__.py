"""Export of motion to the file formats of other programs."""
