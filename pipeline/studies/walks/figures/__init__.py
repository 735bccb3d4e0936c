"""Figures of zhang2004 and zhang2007."""
