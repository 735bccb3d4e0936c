"""A walk as a low-order Fourier series: zhang2007 section 3.1 (zhang2004 section 3.1)."""

from pipeline.core.fourier.series import FourierRepresentation, mirrored, represent, shift, synthesise

__all__ = ["FourierRepresentation", "mirrored", "represent", "shift", "synthesise"]
