"""Reader and writer of tables of points with column titles (CSV), wide or long."""

from pipeline.formats.points.csv.positions import read, write

__all__ = ["read", "write"]
