"""Motion as files of other tools."""
