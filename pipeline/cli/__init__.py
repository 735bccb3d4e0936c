"""Command line of the package: commands, their options, and the progress and results that they print."""
