"""Figures of park2011, and one beside them."""
