"""Reader and writer of tables of points in CSV format with column titles: wide or long tables."""

from pipeline.formats.points.csv.positions import read, write

__all__ = ["read", "write"]
