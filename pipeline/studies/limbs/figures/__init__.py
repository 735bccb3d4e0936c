"""Figures of park2011 and one figure of our own."""
