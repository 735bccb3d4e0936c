"""Fourier representations of walks and their eigenwalkers, which the studies of walks use."""
