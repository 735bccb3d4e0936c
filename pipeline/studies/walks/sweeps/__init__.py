"""Sweeps of the anatomical reconstruction: what each part of it is worth, and whether its bars are right."""
