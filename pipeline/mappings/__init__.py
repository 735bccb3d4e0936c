"""Mappings of source points to joints: the package's, the user's, and the best mapping for a recording.

`shipped` reads the tables of ``conf/skeleton`` and `load` reads a file.  `suggest` finds the mapping that fits a
recording best.  `check` finds rules that are anatomically impossible.  `written` returns a mapping as YAML.  `people`
splits a recording with several people.
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
