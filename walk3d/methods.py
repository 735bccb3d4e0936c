"""Reconstruction methods that `walk3d` adds to the package `pipeline`."""

from walk3d.anatomy import method as anatomy
from walk3d.film.reconstruct.shipped_prior import prior_method

METHODS = (*anatomy.METHODS, prior_method("shipped"))
