"""Studies that `walk3d` adds to the package `pipeline`."""

from walk3d import author
from walk3d.anatomy import study as anatomy
from walk3d.film import study as film

STUDIES = (anatomy.STUDY, author.STUDY, film.STUDY)
