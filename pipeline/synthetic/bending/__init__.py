"""Performances of bending to the floor by people of different sizes and manners, with known timing.

`bending_performances` makes them; `correspondence` gives the true warp between two of them.
"""

from pipeline.synthetic.bending.performances import BendingPerformances, bending_performances
from pipeline.synthetic.bending.time_warps import correspondence

__all__ = ["BendingPerformances", "bending_performances", "correspondence"]
