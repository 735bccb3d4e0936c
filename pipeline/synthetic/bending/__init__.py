"""Synthetic recordings of people who bend to the floor, with known timing.

`bending_performances` generates the performances.  `correspondence` returns the true warp between two of them.
"""

from pipeline.synthetic.bending.performances import BendingPerformances, bending_performances
from pipeline.synthetic.bending.time_warps import correspondence

__all__ = ["BendingPerformances", "bending_performances", "correspondence"]
