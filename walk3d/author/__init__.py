"""Test on external data: the average walker of zhang2007's second author, reconstructed by models of other people."""

from pipeline.studies.study import Study
from walk3d.author.errors import AverageWalkerErrors
from walk3d.author.figure import AverageWalkerFigure

STUDY = Study(
    "author",
    sweeps={"average_walker": AverageWalkerErrors},
    figures={"average_walker": AverageWalkerFigure},
)
