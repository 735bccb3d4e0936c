"""Fourier representations of walks, and eigenwalkers of each fold, shared by several studies."""
