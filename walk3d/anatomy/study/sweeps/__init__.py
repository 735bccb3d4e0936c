"""Sweeps of the anatomical reconstruction: its ablation, and the coverage of its bars."""
