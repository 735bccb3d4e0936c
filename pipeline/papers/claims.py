"""What an equation, a claim and a verdict are, and how a claim is judged.

A claim is one number or one sentence of a paper with everything that decides about it, written down before
any figure is made: how our value comes from a table, within which bounds it counts as reproduced, within
which wider bounds at least the paper's direction holds, and why these bounds.  `judge` only compares.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from pipeline.validation import InvalidInput

Tables = Mapping[str, Mapping[str, np.ndarray]]
"""Table name → column name → values: ``zhang2007_fig5`` is the figure's ``table.csv``, and
``zhang2007_fig5/table_walkers`` the table ``table_walkers.csv`` beside it."""

Outcome = Literal["reproduced", "direction only", "differs", "cannot be tested on this data"]

REPRODUCED: Outcome = "reproduced"
DIRECTION_ONLY: Outcome = "direction only"
DIFFERS: Outcome = "differs"
UNTESTED: Outcome = "cannot be tested on this data"

OVERRIDDEN = "overridden"
"""Name of the data for results of a preset with options changed: no explanation was established for those."""

_UNEXPLAINED = {OVERRIDDEN: "not explained: the options differ from the preset's"}

ANY_DATA = "any"
"""Key of an explanation that holds for whatever data set has none of its own."""


TEST_OF = {
    "fourier.series": "fourier",
    "fourier.frequency": "frequency",
    "statistics.circular": "circular",
    "statistics.rank_correlation": "rank_correlation",
    "walking.usable_clip": "usable_clip",
    "walking.steady": "walking",
    "reconstruction.known_view": "reconstruction",
    "reconstruction.noise_path": "noise_path",
    "reconstruction.unknown_phase": "observed_phase",
    "viewpoint.known_phase": "viewpoint",
    "viewpoint.search": "view_search",
    "viewpoint.unknown_phase": "observed_viewpoint",
    "posture.cosines": "posture",
    "posture.frames": "limb_frames",
    "synchronization.curvature": "curvature",
    "synchronization.key_frames": "key_frames",
    "synchronization.trellis": "trellis",
    "synchronization.all_pairs": "all_pairs",
    "synchronization.pair": "synchronization",
    "action_model.bounds": "action_model",
    "action_model.learning": "learnt_action",
    "tracking.filter": "tracking",
    "tracking.prediction": "prediction",
    "tracking.likelihood": "image_likelihood",
    "tracking.particles": "particles",
    "tracking.errors": "tracking_error",
    "articulation.rays": "rays",
    "articulation.hits": "articulation",
    "limb_chain.chain": "limb_chain",
    "limb_chain.lengths": "limb_lengths",
    "binary_quadratic.solve": "binary_quadratic",
    "binary_quadratic.candidates": "sign_candidates",
    "binary_quadratic.programme": "sign_programme",
    "binary_quadratic.descent": "sign_search",
    "binary_quadratic.box_search": "box_search",
    "binary_quadratic.suffix_search": "suffix_search",
    "refinement.spherical": "spherical",
    "refinement.reprojection": "reprojection",
    "refinement.equations": "limb_equations",
    "refinement.inputs": "refinement_input",
    "refinement.steps": "refinement",
    "articulated_trajectory.limb_choice": "limb_choice",
    "articulated_trajectory.tree": "articulated",
    "articulated_trajectory.hinges": "hinges",
    "articulated_trajectory.mirrors": "mirror_search",
}
"""Name of the test file of each module of the core."""


@dataclass(frozen=True)
class Interval:
    """Bounds on a value; an end belongs to it unless it is open.

    Examples
    --------
    >>> 94.0 in Interval(88.9, 94.9), 95.0 in Interval(88.9, 94.9), 1.0 in above(1.0)
    (True, False, False)
    >>> print(Interval(88.9, 94.9), "|", at_most(2.0), "|", exactly(80.0), "|", between(0.0, 25.0))
    88.9 to 94.9 | at most 2 | exactly 80 | over 0 and under 25
    """

    low: float
    high: float
    low_open: bool = False
    high_open: bool = False

    def __contains__(self, value: float) -> bool:
        over = value > self.low if self.low_open else value >= self.low
        under = value < self.high if self.high_open else value <= self.high
        return over and under

    def __str__(self) -> str:
        if self.low == self.high:
            return f"exactly {self.low:g}"
        if math.isfinite(self.low) and math.isfinite(self.high) and not (self.low_open or self.high_open):
            return f"{self.low:g} to {self.high:g}"
        ends = []
        if math.isfinite(self.low):
            ends.append(f"{'over' if self.low_open else 'at least'} {self.low:g}")
        if math.isfinite(self.high):
            ends.append(f"{'under' if self.high_open else 'at most'} {self.high:g}")
        return " and ".join(ends)


def within(published: float, margin: float) -> Interval:
    """Bounds at an equal distance on both sides of a published number."""
    return Interval(published - margin, published + margin)


def exactly(published: float) -> Interval:
    """Bounds that only the published number satisfies: for counts."""
    return Interval(published, published)


def at_least(low: float) -> Interval:
    """Bounds without an upper end."""
    return Interval(low, math.inf)


def at_most(high: float) -> Interval:
    """Bounds without a lower end."""
    return Interval(-math.inf, high)


def above(low: float) -> Interval:
    """Bounds that leave out their lower end and have no upper one."""
    return Interval(low, math.inf, low_open=True)


def below(high: float) -> Interval:
    """Bounds that leave out their upper end and have no lower one."""
    return Interval(-math.inf, high, high_open=True)


def between(low: float, high: float) -> Interval:
    """Bounds that leave out both ends."""
    return Interval(low, high, low_open=True, high_open=True)


@dataclass(frozen=True)
class Equation:
    """A numbered equation of a paper and where it lives.

    Attributes
    ----------
    paper, number : str
        ``"zhang2007"``, ``"3.15"``: together the tag by which the source is searched.
    words : str
        The equation in one line.
    home : str
        Dotted name of the function that computes it; empty while its room is not built.
    test : str
        File of the tests that hold it; empty while its room is not built.
    note : str
        What is wrong or open in print, and how we read it; empty if nothing is.
    """

    paper: str
    number: str
    words: str
    home: str = ""
    test: str = ""
    note: str = ""

    @property
    def tag(self) -> str:
        """The mark in the source, e.g. ``[zhang2007 3.15]``."""
        return f"[{self.paper} {self.number}]"


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A number or a sentence of a paper, and what decides whether we reproduce it.

    Attributes
    ----------
    name : str
        Unique, snake case, begins with the paper's key.
    paper, section : str
    quote : str
        The paper's own words, short; holds the published number.
    published : float or None
        The paper's number; None for a sentence without one.
    unit : str
        Unit of the published number and of ours; empty for a count or a ratio.
    figure : str
        Preset whose tables back the claim; empty only if `untestable`.
    reduction : str
        How our value comes from the tables' columns, in one line.
    value : callable or None
        The same as a function of the tables; None while the figure is not built.
    needs : tuple of str
        Tables that `value` reads; empty means the figure's ``table.csv`` alone.
    tolerance : Interval or None
        Our values that count as reproduced.
    direction : Interval or None
        Our values for which at least the paper's direction holds; None if there is nothing between
        reproduced and not.
    reason : str
        Why these bounds, in one line, written before the figure was made.
    explanation : mapping of str to str
        Why our value differs, by data set; `ANY_DATA` for all that have none of their own.
    untestable : str
        Why no data of ours can decide; empty if some can.
    """

    name: str
    paper: str
    section: str
    quote: str
    published: float | None = None
    unit: str = ""
    figure: str = ""
    reduction: str = ""
    value: Callable[[Tables], float] | None = None
    needs: tuple[str, ...] = ()
    tolerance: Interval | None = None
    direction: Interval | None = None
    reason: str = ""
    explanation: Mapping[str, str] = field(default_factory=dict)
    untestable: str = ""

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the tables that `value` reads."""
        return self.needs or ((self.figure,) if self.figure else ())


@dataclass(frozen=True)
class Verdict:
    """What became of a claim on one data set.

    Attributes
    ----------
    claim : Claim
    ours : float or None
        Our value in the claim's unit; None if it could not be had.
    verdict : str
        ``reproduced``, ``direction only``, ``differs`` or ``cannot be tested on this data``.
    why : str
        One line for a person.
    """

    claim: Claim
    ours: float | None
    verdict: Outcome
    why: str


@dataclass(frozen=True)
class Paper:
    """A paper: its equations in printed order, its claims, the presets that redraw its figures.

    `beyond` names presets of our own that go further than it.
    """

    key: str
    title: str
    authors: str
    year: int
    venue: str
    figures: tuple[str, ...]
    equations: tuple[Equation, ...]
    claims: tuple[Claim, ...]
    beyond: tuple[str, ...] = ()


class _Columns(dict[str, np.ndarray]):
    """Columns of one table; asking for one that it lacks is refused by name."""

    def __init__(self, table: str, columns: Mapping[str, np.ndarray]) -> None:
        super().__init__({name: np.asarray(values) for name, values in columns.items()})
        self.table = table

    def __missing__(self, column: str) -> np.ndarray:
        raise InvalidInput(
            f"no column {column!r}", where=f"table {self.table}", received=", ".join(self) or "no columns"
        )

    @property
    def is_rectangular(self) -> bool:
        return all(values.ndim == 1 for values in self.values()) and len({v.size for v in self.values()}) <= 1


def _judge_one(claim: Claim, tables: Mapping[str, _Columns], data_name: str) -> Verdict:
    if claim.untestable:
        return Verdict(claim, None, UNTESTED, claim.untestable)
    if claim.value is None or claim.tolerance is None:
        return Verdict(claim, None, UNTESTED, f"its figure {claim.figure} is not built yet")
    for name in claim.tables:
        if name not in tables:
            return Verdict(claim, None, UNTESTED, f"figure {name} is not made yet")
        if not tables[name].is_rectangular:
            return Verdict(claim, None, UNTESTED, f"the columns of table {name} differ in length")
    with np.errstate(all="ignore"):
        ours = float(claim.value(tables))
    if not math.isfinite(ours):
        return Verdict(
            claim, None, UNTESTED, f"table {claim.tables[0]} holds no finite value for: {claim.reduction}"
        )
    judged = f"{ours:.4g} {claim.unit}".rstrip() + f", bounds {claim.tolerance}"
    if ours in claim.tolerance:
        return Verdict(claim, ours, REPRODUCED, f"{judged}: {claim.reason}")
    explanation = (
        claim.explanation.get(data_name)
        or claim.explanation.get(ANY_DATA)
        or _UNEXPLAINED.get(data_name, "not explained yet")
    )
    if claim.direction is not None and ours in claim.direction:
        return Verdict(claim, ours, DIRECTION_ONLY, f"{judged}, direction {claim.direction}: {explanation}")
    return Verdict(claim, ours, DIFFERS, f"{judged}: {explanation}")


def judge(claims: Iterable[Claim], tables: Tables, data_name: str) -> list[Verdict]:
    """One verdict per claim, in the order of the claims, from the tables at hand.

    Parameters
    ----------
    claims : iterable of Claim
    tables : mapping
        Table name → column name → values; tables that are not made yet are simply absent.
    data_name : str
        Option of the data group, ``"synthetic"``, ``"optical"``…: selects the explanation of a difference.

    Returns
    -------
    list of Verdict
        A claim whose table is absent, ragged or without a finite value for it cannot be tested; that is a
        verdict, not an error.

    Raises
    ------
    InvalidInput
        If a table lacks a column that a claim reads: the figure and the ledger then disagree about the
        contract, which no verdict may hide.
    """
    ledger = {name: _Columns(name, columns) for name, columns in tables.items()}
    return [_judge_one(claim, ledger, data_name) for claim in claims]
