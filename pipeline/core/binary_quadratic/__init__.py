"""Choice between two candidates in each frame: the binary quadratic programme (park2011 section 3.2)."""

from pipeline.core.binary_quadratic.solve import BinarySolution, minimise

__all__ = ["BinarySolution", "minimise"]
