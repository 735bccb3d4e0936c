"""Methods of the ablation, each with its name, its style in figures, and its change of the full method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

from pipeline.palette import Style
from walk3d.anatomy.study.sweeps.setting import Setting

STANCE_WEIGHT = 0.3
"""Weight of the stance constraint, in the ablation's variant with this constraint."""
PROPORTIONS_MM = 1.0
"""Tolerance of bone lengths, mm, in the ablation's variant with the average walker's proportions."""
MAX_HARMONICS = 6
"""Number of harmonics in the ablation's variant with more harmonics; the full method has four harmonics."""


@dataclass(frozen=True)
class Method:
    """Method of the ablation, or method that is compared with the anatomical reconstruction.

    Attributes
    ----------
    words : str
        Name on an axis.
    part : str
        ``added``: parts in turn, up to the full method; ``settings``: the full method with default or selected
        settings; ``taken away``: without one part; ``varied``: with another setting that might help; or empty.
    style : Style, optional
        Style of a curve, for methods with one.
    change : callable, optional
        Function from the full method's setting to that of this row.
    """

    name: str
    words: str
    part: str = ""
    style: Style | None = None
    change: Callable[[Setting], Setting] | None = None


def _shrunken(setting: Setting, **changes: float) -> Setting:
    return replace(setting, shrinkage=replace(setting.shrinkage, **changes))  # type: ignore[arg-type]


METHODS = {
    method.name: method
    for method in (
        Method("least_squares", "least squares", style=Style("least squares", "least_squares")),
        Method(
            "average_walker", "average walker", "added", Style("average walker", "baseline", line="dotted")
        ),
        Method("map_70", "MAP, σ² = 70", "added", Style("MAP, σ² = 70", "map", line="dotted")),
        Method(
            "map_tuned", "MAP, σ² of others", "added", Style("MAP, σ² chosen by others", "map", line="dashed")
        ),
        Method("mirror", "+ mirror images", "added"),
        Method("harmonics", "+ harmonics", "added"),
        Method("shrinkage", "+ shrinkage, all walks", "added"),
        Method("anatomical", "+ lengths = whole", "added", Style("anatomical", "green")),
        Method("as_specified", "no setting chosen", "settings"),
        Method("all_chosen", "all settings of others", "settings"),
        *(
            Method(name, words, "taken away", change=change)
            for name, words, change in (
                ("without_mirror", "− mirror images", partial(_shrunken, mirror=False)),
                ("without_harmonics", "− harmonics", partial(replace, harmonics=2)),
                ("without_shrinkage", "− shrinkage", partial(_shrunken, within_harmonic=0.0, diagonal=0.0)),
                ("without_more_walks", "− all walks", partial(replace, all_walks=False)),
                ("without_pairs", "− left = right", partial(replace, pairs=float("inf"))),
                ("without_constancy", "− constant lengths", partial(replace, within=float("inf"))),
            )
        ),
        *(
            Method(name, words, "varied", change=partial(replace, **changes))
            for name, words, changes in (
                ("three_harmonics", "three harmonics", {"harmonics": 3}),
                ("five_harmonics", "five harmonics", {"harmonics": 5}),
                ("six_harmonics", "six harmonics", {"harmonics": MAX_HARMONICS}),
                ("tight_lengths", "tight lengths", {"within": 0.5}),
                ("loose_lengths", "loose lengths", {"within": 5.0}),
                ("stance", "+ stance", {"stance": STANCE_WEIGHT}),
                ("fixed_proportions", "average proportions", {"proportions": PROPORTIONS_MM}),
            )
        ),
    )
}

STYLES = {name: method.style for name, method in METHODS.items() if method.style}
"""Line styles of the methods that occur in several figures."""


def of_part(*parts: str) -> list[str]:
    """Return the names of the methods in the given parts of the ablation."""
    return [name for part in parts for name, method in METHODS.items() if method.part == part]
