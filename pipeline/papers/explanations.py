"""Explanations of why our value differs, each with what supports it.

An explanation is `Support.SHOWN` if it only says what published tables hold, `Support.TESTED` if the alleged cause was
changed and the change measured, and `Support.UNTESTED` if nobody did.  A cause is changed either by a switch of
``conf/sensitivity.yaml``, whose numbers stand in ``conf/paper/interventions.csv``, or within a figure that measures the
other condition as well: another camera, the better mirror of every limb, a baseline.
"""

from __future__ import annotations

import csv
import io
import math
import string
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from pipeline.papers.intervals import Estimate
from pipeline.reading import read_file

ANY_DATA = "any"
"""Key of the explanation for data sets that have none of their own."""

WITH, WITHOUT = "with", "without"
"""Placeholders of the claim's own value in a run with the switch and in one without; ``with_NAME`` of another's."""


class Support(StrEnum):
    """What an explanation rests on."""

    SHOWN = "shown"
    """Published tables; no cause is named."""
    TESTED = "tested"
    """A run, or a part of the figure, in which the cause was changed."""
    UNTESTED = "untested"
    """Nothing yet."""


@dataclass(frozen=True)
class Run:
    """Figures made with a switch of ``conf/sensitivity.yaml`` and without.

    Attributes
    ----------
    data, group, switch : str
        Data set; group of switches and the switch in it.
    overrides : tuple of str
        As on the command line, when the numbers were measured; empty if they are not.
    scale : str
        Of the run; empty if there was none.
    without, with_it : mapping of str to Estimate
        Our values of claims and quantities by name, with intervals over populations or people.
    """

    data: str
    group: str
    switch: str
    overrides: tuple[str, ...] = ()
    scale: str = ""
    without: Mapping[str, Estimate] = field(default_factory=dict)
    with_it: Mapping[str, Estimate] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.data}, {self.switch}: {' '.join(self.overrides) or 'not run yet'}"


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """Why our value differs from the paper's.

    Attributes
    ----------
    support : Support
    text : str
        Our numbers stand as placeholders, ``{value:.1f}`` for the claim's own, ``{zhang2007_walkers:.0f}`` for
        another's, ``{with:.1f}`` and ``{without_zhang2007_walkers:.0f}`` for those of the run.
    run : Run or None
        With the cause changed by a switch.
    beside : tuple of str
        Claims and quantities that measure the same with the cause changed.
    """

    support: Support
    text: str
    run: Run | None = None
    beside: tuple[str, ...] = ()

    def in_words(self, name: str, value: float, number: Callable[[str], float] | None) -> str:
        """Return the explanation of a claim, its numbers filled in, with its support; arguments as of `filled`."""
        text = self.filled(name, value, number)
        if self.support is Support.UNTESTED:
            return f"not tested: {text}"
        if self.support is Support.SHOWN:
            return text
        return f"{text} (tested: {self.run or ', '.join(self.beside)})"

    def filled(self, name: str, value: float, number: Callable[[str], float] | None = None) -> str:
        """Return the explanation of a claim, its numbers filled in.

        Parameters
        ----------
        name : str
            Of the claim.
        value : float
            Its value.
        number : callable, optional
            Our value of another claim or quantity, by name.
        """
        known = {"value": Estimate(value)}
        for placeholder in placeholders(self.text):
            if (asked := of_run(placeholder)) is not None:
                side, other = asked
                values = {} if self.run is None else self.run.with_it if side == WITH else self.run.without
                known[placeholder] = values.get(other or name, Estimate(math.nan))
            elif placeholder not in known:
                known[placeholder] = Estimate(number(placeholder) if number else math.nan)
        return self.text.format_map({key: _Number(estimate) for key, estimate in known.items()})


def placeholders(text: str) -> list[str]:
    """Return the names of the numbers that a text quotes, in order.

    Examples
    --------
    >>> placeholders("{value:.1f} of {zhang2007_walkers:.0f} walkers")
    ['value', 'zhang2007_walkers']
    """
    return [name for _, name, _, _ in string.Formatter().parse(text) if name is not None]


def of_run(placeholder: str) -> tuple[str, str] | None:
    """Return the side of a run and the name that a placeholder quotes, empty for the claim's own; None if it does not.

    Examples
    --------
    >>> of_run("with"), of_run("without_zhang2007_walkers"), of_run("zhang2007_walkers")
    (('with', ''), ('without', 'zhang2007_walkers'), None)
    """
    side, _, name = placeholder.partition("_")
    return (side, name) if side in (WITH, WITHOUT) else None


def read_runs(path: Path) -> dict[tuple[str, str, str], Run]:
    """Return the runs of a table of interventions by data set, group and switch; none if there is no table.

    It has a row for each number: data, group, switch, overrides, scale, name, and values without and with the switch,
    each with the ends of its interval.
    """
    if not path.is_file():
        return {}
    facts: dict[tuple[str, str, str], tuple[tuple[str, ...], str]] = {}
    numbers: dict[tuple[str, str, str], dict[str, dict[str, Estimate]]] = {}
    with io.StringIO(read_file(path).decode("utf-8"), newline="") as lines:
        for row in csv.DictReader(lines):
            key = (row["data"], row["group"], row["switch"])
            facts[key] = (tuple(row["overrides"].split()), row["scale"])
            for side, values in numbers.setdefault(key, {WITHOUT: {}, WITH: {}}).items():
                ends = (row[name] or math.nan for name in (side, f"{side}_low", f"{side}_high"))
                values[row["name"]] = Estimate(*map(float, ends))
    return {key: Run(*key, *facts[key], numbers[key][WITHOUT], numbers[key][WITH]) for key in facts}


@dataclass(frozen=True)
class _Number:
    """A number that is formatted with its interval if that is known, and as ``(no number)`` if it is not finite."""

    of: Estimate

    def __format__(self, specification: str) -> str:
        if not math.isfinite(self.of.value):
            return "(no number)"
        value, low, high = (format(v, specification) for v in (self.of.value, self.of.low, self.of.high))
        return f"{value} [{low}, {high}]" if self.of.known else value
