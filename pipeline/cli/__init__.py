"""Command line: options, figures, other commands, progress and summary."""
