"""Figures of mozerov2006, and three of our own after it."""
