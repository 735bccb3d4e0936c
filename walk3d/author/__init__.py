"""The average walker of zhang2007's second author, reconstructed by what is learnt on our people: an external test."""

from pipeline.studies.study import Study
from walk3d.author.errors import AverageWalkerErrors
from walk3d.author.figure import AverageWalkerFigure

STUDY = Study(
    "author",
    sweeps={"average_walker": AverageWalkerErrors},
    figures={"average_walker": AverageWalkerFigure},
)
