"""Digits that hold when published tables are computed again, and whether those of an archive do.

A light archive states the rule in ``digits.csv``: for each table the relative difference allowed to every number.
Text, and the order of rows and columns, have to be the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.reading import as_written
from pipeline.storage import tables
from pipeline.storage.tables import Table
from pipeline.validation import InvalidInput, is_relative, require_range

DIGITS = "digits.csv"
CLAIMS = "claims.csv"
ANSWERS = ("agreement", "beyond_baseline")
"""Columns of the claims that are compared exactly."""

TIMING = "table_timing"
"""Table of times on the machine that made a figure; nothing is compared with it and no claim uses it."""

DIRECT = (
    "zhang2004_fig2", "zhang2004_fig3", "zhang2004_fig4", "zhang2007_fig2", "zhang2007_fig3", "zhang2007_fig4",
    "zhang2007_fig5", "mozerov2006_fig",
)  # fmt: skip
"""Beginnings of the figures whose numbers come out of no search and no refinement."""

CLOSED_FORM, SEARCHED = 1e-5, 1e-3
"""Relative difference allowed where nothing iterates, and where something does.

Measured at full scale between two BLAS kernels: at most 1.7e-7 (zhang2007_fig3, zhang2004_fig3) and 7.9e-5
(zhang2007_fig6, park2011_fig3c); the tests measure smoke tables over eight kernels.
"""

NOT_ZERO = 1e-6
"""Numbers that are closer than this agree, whatever their ratio: tables hold millimetres, degrees and fractions."""


Alike = Callable[[str, str, Table, Table], tuple[Table, Table]]
"""Given names of figure and table, and its columns as kept and as made: the columns to compare, by today's names."""


@dataclass(frozen=True)
class Agreement:
    """How one table, computed again, agrees with the one that was kept.

    Attributes
    ----------
    table : str
    difference : float
        Largest relative difference of a number; infinite if something else differs.
    tolerance : float
    complaints : tuple of str
        The first cells that differ by more, a sentence each.
    """

    table: str
    difference: float
    tolerance: float
    complaints: tuple[str, ...]


def tolerance(figure: str) -> float:
    """Return the relative difference that is allowed to the tables of a figure.

    Examples
    --------
    >>> tolerance("zhang2007_fig5"), tolerance("park2011_fig4")
    (1e-05, 0.001)
    """
    return CLOSED_FORM if figure.startswith(DIRECT) else SEARCHED


def rule(folder: Path) -> dict[str, float]:
    """Return the relative difference that is allowed to each table of a figure, by name, from the tables there."""
    names = sorted({path.name.removesuffix(".gz") for path in folder.glob("table*.csv*")})
    return {name: tolerance(folder.name) for name in names if not name.startswith(TIMING)}


def write_rule(folder: Path, figures: Iterable[str]) -> None:
    """Write the rule for all tables of these figures, which are folders of their names, beside them."""
    rows = [(figure, *item) for figure in sorted(figures) for item in rule(folder / figure).items()]
    names = ("figure", "table", "relative_difference_allowed")
    tables.write(folder / DIGITS, tables.of_rows(names, rows))


def compare_again(kept: Path, made: Path, alike: Alike | None = None) -> list[Agreement]:
    """Compare the tables and verdicts of a figure, computed again, with those that an archive keeps.

    Parameters
    ----------
    kept : Path
        Folder of the figure in an archive; tables may be compressed.  All of them are compared, by the rule of this
        version, or that of the ``digits.csv`` beside it where it allows less.
    made : Path
        Folder of the figure as published.
    alike : callable, optional
        Columns of an earlier version's table to compare; by default all.

    Raises
    ------
    InvalidInput
        If there is no table to compare, one cannot be read, or a tolerance is no number.
    """
    with as_written(kept):
        allowed = rule(kept)
        for name, most in _stated(kept).items():
            allowed[name] = min(most, allowed.get(name, most))
        if not allowed:
            raise InvalidInput("no table to compare", kept, code="no_table")
        found = [_compared(kept, made, name, most, alike) for name, most in allowed.items()]
        if (kept / CLAIMS).is_file() or (made / CLAIMS).is_file():
            found.append(_verdicts(kept, made, max(allowed.values())))
        return found


def _stated(kept: Path) -> dict[str, float]:
    """Return what the archive itself allows to each table of a figure."""
    path, stated = kept.parent / DIGITS, {}
    for row in tables.read_rows(path) if path.is_file() else ():
        if row["figure"] == kept.name:
            try:
                most = float(row["relative_difference_allowed"])
            except ValueError:
                most = np.nan
            if not is_relative(row["table"]):
                raise InvalidInput(
                    "must be a plain path below its folder",
                    f"{DIGITS}: table",
                    received=row["table"],
                    code="not_plain_path",
                )
            stated[row["table"]] = require_range(f"{DIGITS}: {row['table']}", most, at_least=0)
    return stated


def _compared(kept: Path, made: Path, name: str, most: float, alike: Alike | None) -> Agreement:
    before: Table = tables.read(_there(kept, name))
    now: Table = tables.read(_there(made, name))
    if alike:
        before, now = alike(made.name, name, before, now)
    differences = tables.relative_differences(before, now, absolute=NOT_ZERO)
    largest = max(differences.values(), default=0.0)
    complaints = tables.compare(before, now, relative=most, absolute=NOT_ZERO) if largest > most else ()
    return Agreement(name, largest, most, tuple(complaints))


def _verdicts(kept: Path, made: Path, most: float) -> Agreement:
    """Compare our values to the digits of the tables that they come from, verdicts exactly."""
    before, now = (
        {row["claim"]: row for row in tables.read_rows(_there(folder, CLAIMS))} for folder in (kept, made)
    )
    for folder, rows in ((kept, before), (made, now)):
        if lacking := [name for name in ANSWERS for row in rows.values() if name not in row]:
            raise InvalidInput(
                "claims of another rule",
                folder / CLAIMS,
                ", ".join(dict.fromkeys(lacking)),
                code="other_rule",
                lacking=sorted(set(lacking)),
            )
    largest = 0.0
    wrong = [f"{claim}: not in the archive" for claim in now if claim not in before]
    for claim, row in before.items():
        again = now.get(claim)
        if again is None:
            wrong.append(f"{claim}: not there")
        elif other := [name for name in ANSWERS if row[name] != again[name]]:
            wrong += [f"{claim}, {name}: {row[name]} is not {again[name]}" for name in other]
        else:
            a, b = (np.array([float(one["value"] or "nan")]) for one in (row, again))
            off = tables.needed(a, b, NOT_ZERO)[0]
            largest = max(largest, off)
            if off > most:
                wrong.append(f"{claim}: {a[0]:.10g} is not {b[0]:.10g}")
    return Agreement(CLAIMS, largest, most, tuple(wrong))


def _there(folder: Path, name: str) -> Path:
    """Return a table, or what is kept of it compressed."""
    path = folder / name
    return path if path.is_file() else path.with_name(f"{name}.gz")
