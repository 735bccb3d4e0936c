"""Mappings of source points to joints: those that ship, the user's own, and which one fits a recording.

`shipped` reads the tables of ``conf/skeleton``, `load` reads one file, `suggest` finds the family that a recording
belongs to, `check` finds rules that no person fits, and `written` writes down a mapping for one that belongs to none.
`people` tells the people in one
recording apart.
"""

from pipeline.mappings.fitting import Fit, rescaled, suggest
from pipeline.mappings.people import of_one_person, people
from pipeline.mappings.sides import check
from pipeline.mappings.table import AUTO, chosen, load, shipped, written

__all__ = [
    "AUTO",
    "Fit",
    "check",
    "chosen",
    "load",
    "of_one_person",
    "people",
    "rescaled",
    "shipped",
    "suggest",
    "written",
]
