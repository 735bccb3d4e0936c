"""The command line: composing options, making figures, the other commands, progress and summary."""
