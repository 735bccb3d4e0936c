"""The mathematics of the papers as pure functions of arrays, which return arrays or small frozen records.

Nothing here reads a clock, a file, an environment variable or a global generator.
"""
