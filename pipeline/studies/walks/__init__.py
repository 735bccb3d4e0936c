"""Walks: periodic 3D motion from 2D, zhang2004 and zhang2007."""
