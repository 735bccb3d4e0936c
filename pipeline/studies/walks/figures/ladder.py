"""How figures of the anatomical reconstruction draw its methods."""

from __future__ import annotations

from pipeline.studies.walks.people_intervals import Interval


def one_row(interval: Interval, name: str) -> dict[str, float]:
    """The columns of an interval of one number."""
    return {column: float(values[0]) for column, values in interval.columns(name).items()}
