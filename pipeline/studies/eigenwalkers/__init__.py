"""Eigenwalkers, which several studies stand on: Fourier representations of walks, and models of them by fold."""
