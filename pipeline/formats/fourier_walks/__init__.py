"""Readers of walks stored as Fourier series: average walkers with their attribute axes, and ``mm`` files."""

from pipeline.formats.fourier_walks.average_walker import (
    AXES,
    MAX_VALUE,
    OTHER_JSON,
    SOURCE,
    AverageWalker,
    average_walker,
    mean_walkers,
    read,
    read_mat,
)
from pipeline.formats.fourier_walks.mm import read as read_mm
from pipeline.formats.fourier_walks.mm import write as write_mm
from pipeline.formats.fourier_walks.series import RATE_HZ, FourierWalk, from_world, in_world, motion_of

__all__ = [
    "AXES",
    "MAX_VALUE",
    "OTHER_JSON",
    "RATE_HZ",
    "SOURCE",
    "AverageWalker",
    "FourierWalk",
    "average_walker",
    "from_world",
    "in_world",
    "mean_walkers",
    "motion_of",
    "read",
    "read_mat",
    "read_mm",
    "write_mm",
]
