"""Choice between the two candidate positions of a joint in each frame: a binary quadratic programme (park2011 3.2)."""

from pipeline.core.binary_quadratic.solve import BinarySolution, minimise

__all__ = ["BinarySolution", "minimise"]
