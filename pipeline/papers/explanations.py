"""Reasons why our values differ from the papers' values, each with the evidence for it.

An explanation is `Support.SHOWN` if it only quotes published tables, `Support.TESTED` if the alleged cause was changed
and the effect measured, and `Support.UNTESTED` otherwise.  A cause is changed in one of two ways.  A switch of
``conf/sensitivity.yaml`` changes it, and ``conf/paper/interventions.csv`` contains the numbers.  Or a figure measures
the other condition as well: another camera, the better mirror of every limb, a baseline.
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
"""Key of the explanation that applies to all data sets without an explanation of their own."""

WITH, WITHOUT = "with", "without"
"""Placeholders in an explanation for the claim's value with and without a changed assumption.

``with_NAME`` and ``without_NAME`` quote the values of another claim.
"""


class Support(StrEnum):
    """Evidence for an explanation: published tables, a test in which the cause was changed, or none."""

    SHOWN = "shown"
    """Evidence from published tables, which do not identify the cause."""
    TESTED = "tested"
    """Evidence from a run or a part of the figure in which the alleged cause was changed."""
    UNTESTED = "untested"
    """No evidence: the explanation has not been tested."""


@dataclass(frozen=True)
class Run:
    """Sensitivity run: values of claims with and without one changed assumption (``conf/sensitivity.yaml``).

    Attributes
    ----------
    data, group, switch : str
        Data set; group of switches and the switch in it.
    overrides : tuple of str
        Options on the command line of the run; empty if it has not been run.
    scale : str
        Scale of the run; empty if it has not been run.
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
    """Reason why our value differs from the paper's value, with the evidence for this reason.

    Attributes
    ----------
    support : Support
    text : str
        Text with placeholders for our numbers: ``{value:.1f}`` for the claim's value, ``{zhang2007_walkers:.0f}`` for
        another claim's, ``{with:.1f}`` and ``{without_zhang2007_walkers:.0f}`` for values of the run.
    run : Run or None
        Run in which a switch changed the cause.
    comparisons : tuple of str
        Claims and quantities that measure the same with the cause changed.
    """

    support: Support
    text: str
    run: Run | None = None
    comparisons: tuple[str, ...] = ()

    def in_words(self, name: str, value: float, number: Callable[[str], float] | None) -> str:
        """Return the text of the explanation with our numbers and its evidence; the arguments are those of `filled`."""
        text = self.filled(name, value, number)
        if self.support is Support.UNTESTED:
            return f"not tested: {text}"
        if self.support is Support.SHOWN:
            return text
        return f"{text} (tested: {self.run or ', '.join(self.comparisons)})"

    def filled(self, name: str, value: float, number: Callable[[str], float] | None = None) -> str:
        """Return the text of the explanation with our numbers in place of the placeholders.

        Parameters
        ----------
        name : str
            Name of the claim.
        value : float
            Our value of the claim.
        number : callable, optional
            Function from the name of another claim or quantity to our value.
        """
        numbers = {"value": Estimate(value)}
        for placeholder in placeholders(self.text):
            if (quoted := of_run(placeholder)) is not None:
                side, other = quoted
                values = {} if self.run is None else self.run.with_it if side == WITH else self.run.without
                numbers[placeholder] = values.get(other or name, Estimate(math.nan))
            elif placeholder not in numbers:
                numbers[placeholder] = Estimate(number(placeholder) if number else math.nan)
        return self.text.format_map({key: _Number(estimate) for key, estimate in numbers.items()})


def placeholders(text: str) -> list[str]:
    """Return the names of the placeholders in a text, in order.

    Examples
    --------
    >>> placeholders("{value:.1f} of {zhang2007_walkers:.0f} walkers")
    ['value', 'zhang2007_walkers']
    """
    return [name for _, name, _, _ in string.Formatter().parse(text) if name is not None]


def of_run(placeholder: str) -> tuple[str, str] | None:
    """Split a placeholder such as ``with_NAME`` into side and claim; return None if it quotes no sensitivity run.

    The name is empty for the claim to which the explanation belongs.

    Examples
    --------
    >>> of_run("with"), of_run("without_zhang2007_walkers"), of_run("zhang2007_walkers")
    (('with', ''), ('without', 'zhang2007_walkers'), None)
    """
    side, _, name = placeholder.partition("_")
    return (side, name) if side in (WITH, WITHOUT) else None


def read_runs(path: Path) -> dict[tuple[str, str, str], Run]:
    """Read a table of sensitivity runs; return the runs by data set, group and switch, or an empty dict without a
    table.

    The table has a row for each number: data, group, switch, overrides, scale, name, and the values without and with
    the switch, each with the ends of its interval.
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
    """Number in an explanation: formatted with its confidence interval, or ``(no number)`` if it is not finite."""

    estimate: Estimate

    def __format__(self, specification: str) -> str:
        if not math.isfinite(self.estimate.value):
            return "(no number)"
        numbers = (self.estimate.value, self.estimate.low, self.estimate.high)
        value, low, high = (format(number, specification) for number in numbers)
        return f"{value} [{low}, {high}]" if self.estimate.known else value
