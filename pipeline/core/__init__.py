"""Mathematics of the papers as pure functions: they take arrays, and return arrays or frozen dataclasses.

Nothing here reads a clock, a file, an environment variable or a global generator.
"""
