"""The mathematics of the papers as pure functions: arrays in, arrays or small frozen results out.

Nothing here reads a clock, a file, an environment variable or a global generator.
"""
