"""Performances of bending to the floor, by people of different sizes and manners, with known timing."""

from pipeline.synthetic.bending.performances import SUBJECT_SHARE, BendingPerformances, bending_performances

__all__ = ["SUBJECT_SHARE", "BendingPerformances", "bending_performances"]
