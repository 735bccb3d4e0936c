"""Fourier representations of walks and the eigenwalkers of each fold, which several studies share."""
