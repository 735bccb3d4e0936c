"""Export of motion to files of other tools."""
