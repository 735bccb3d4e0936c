"""How figures of the anatomical reconstruction name and draw its methods."""

from __future__ import annotations

from pipeline.palette import Style
from pipeline.studies.walks.people_intervals import Interval

STYLES = {
    "average_walker": Style("average walker", "null", line="dotted"),
    "least_squares": Style("least squares", "least_squares"),
    "map_70": Style("MAP, σ² = 70", "map", line="dotted"),
    "map_tuned": Style("MAP, σ² chosen by others", "map", line="dashed"),
    "anatomical": Style("anatomical", "green"),
}
"""Methods that several figures show."""

WORDS = {
    "average_walker": "average walker",
    "map_70": "MAP, σ² = 70",
    "map_tuned": "MAP, σ² of others",
    "mirror": "+ mirror images",
    "harmonics": "+ harmonics",
    "shrinkage": "+ shrinkage, all walks",
    "anatomical": "+ lengths = whole",
    "without_mirror": "− mirror images",
    "without_harmonics": "− harmonics",
    "without_shrinkage": "− shrinkage",
    "without_more_walks": "− all walks",
    "without_pairs": "− left = right",
    "without_constancy": "− constant lengths",
    "as_specified": "no setting chosen",
    "all_chosen": "all settings of others",
    "three_harmonics": "three harmonics",
    "five_harmonics": "five harmonics",
    "six_harmonics": "six harmonics",
    "tight_lengths": "tight lengths",
    "loose_lengths": "loose lengths",
    "stance": "+ stance",
    "fixed_proportions": "average proportions",
}
"""Steps of the ladder."""


def one_row(interval: Interval, name: str) -> dict[str, float]:
    """The columns of an interval of one number."""
    return {column: float(values[0]) for column, values in interval.columns(name).items()}
