"""Figures of mozerov2006, and two figures of our own."""
