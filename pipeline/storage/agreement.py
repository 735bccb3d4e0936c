"""Tolerances for recomputed tables, and comparison of recomputed tables with the tables of an archive.

A light archive states the tolerances in ``digits.csv``: for each table the relative difference that is allowed for
every number.  Text and the order of rows and columns must be equal.
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
"""Columns of ``claims.csv`` that are compared exactly."""

TIMING = "table_timing"
"""Name prefix of tables with run times on one machine; these tables are not compared and no claim uses them."""

DIRECT = (
    "zhang2004_fig2", "zhang2004_fig3", "zhang2004_fig4", "zhang2007_fig2", "zhang2007_fig3", "zhang2007_fig4",
    "zhang2007_fig5", "mozerov2006_fig",
)  # fmt: skip
"""Name prefixes of the figures whose numbers are computed without a search and without iterative refinement."""

CLOSED_FORM, SEARCHED = 1e-5, 1e-3
"""Relative tolerances for tables of figures computed without iterative methods, and with iterative methods.

The differences between two BLAS kernels at full scale were at most 1.7e-7 (zhang2007_fig3, zhang2004_fig3) and 7.9e-5
(zhang2007_fig6, park2011_fig3c).  The tests measure smoke tables over eight kernels.
"""

ABSOLUTE_TOLERANCE = 1e-6
"""Absolute difference (in millimetres, degrees or fractions) below which two numbers in tables agree."""


Alike = Callable[[str, str, Table, Table], tuple[Table, Table]]
"""Type of a function that selects comparable columns, given figure name, table name, archived table and new table."""


@dataclass(frozen=True)
class Agreement:
    """Agreement of a recomputed table with the archived table.

    Attributes
    ----------
    table : str
    difference : float
        Largest relative difference of a number; infinite if text, rows or columns differ.
    tolerance : float
    complaints : tuple of str
        First cells that differ by more than the tolerance, one sentence each.
    """

    table: str
    difference: float
    tolerance: float
    complaints: tuple[str, ...]


def tolerance(figure: str) -> float:
    """Return the relative tolerance for the tables of a figure.

    Examples
    --------
    >>> tolerance("zhang2007_fig5"), tolerance("park2011_fig4")
    (1e-05, 0.001)
    """
    return CLOSED_FORM if figure.startswith(DIRECT) else SEARCHED


def rule(folder: Path) -> dict[str, float]:
    """Return the relative tolerance for each table in a figure's folder, by table name."""
    names = sorted({path.name.removesuffix(".gz") for path in folder.glob("table*.csv*")})
    return {name: tolerance(folder.name) for name in names if not name.startswith(TIMING)}


def write_rule(folder: Path, figures: Iterable[str]) -> None:
    """Write ``digits.csv``, the tolerances for all tables of the figures whose folders are in `folder`."""
    rows = [(figure, *item) for figure in sorted(figures) for item in rule(folder / figure).items()]
    names = ("figure", "table", "relative_difference_allowed")
    tables.write(folder / DIGITS, tables.of_rows(names, rows))


def compare_again(kept: Path, made: Path, alike: Alike | None = None) -> list[Agreement]:
    """Compare the tables and verdicts of a recomputed figure with those in an archive.

    Parameters
    ----------
    kept : Path
        Folder of the figure in an archive; tables may be compressed.  Every table is compared, with the smaller of
        this version's tolerance and the one in the archive's ``digits.csv``.
    made : Path
        Folder of the figure that was computed again.
    alike : callable, optional
        Selection of the columns to compare, for archives of an earlier version; by default all columns.

    Raises
    ------
    InvalidInput
        If there is no table to compare, a table cannot be read, or a tolerance is not a number.
    """
    with as_written(kept):
        allowed = rule(kept)
        for name, most in _stated(kept).items():
            allowed[name] = min(most, allowed.get(name, most))
        if not allowed:
            raise InvalidInput("the folder has no table to compare", kept, code="no_table")
        agreements = [_compared(kept, made, name, most, alike) for name, most in allowed.items()]
        if (kept / CLAIMS).is_file() or (made / CLAIMS).is_file():
            agreements.append(_verdicts(kept, made, max(allowed.values())))
        return agreements


def _stated(kept: Path) -> dict[str, float]:
    """Return the tolerance for each table of a figure, from the archive's ``digits.csv``."""
    path, stated = kept.parent / DIGITS, {}
    for row in tables.read_rows(path) if path.is_file() else ():
        if row["figure"] == kept.name:
            try:
                most = float(row["relative_difference_allowed"])
            except ValueError:
                most = np.nan
            if not is_relative(row["table"]):
                raise InvalidInput(
                    "a table must be listed with a relative path inside the figure's folder",
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
    differences = tables.relative_differences(before, now, absolute=ABSOLUTE_TOLERANCE)
    largest = max(differences.values(), default=0.0)
    complaints = (
        tables.compare(before, now, relative=most, absolute=ABSOLUTE_TOLERANCE) if largest > most else ()
    )
    return Agreement(name, largest, most, tuple(complaints))


def _verdicts(kept: Path, made: Path, most: float) -> Agreement:
    """Compare the verdicts exactly, and the values of claims within the largest tolerance of the figure's tables."""
    before, now = (
        {row["claim"]: row for row in tables.read_rows(_there(folder, CLAIMS))} for folder in (kept, made)
    )
    for folder, rows in ((kept, before), (made, now)):
        if lacking := [name for name in ANSWERS for row in rows.values() if name not in row]:
            raise InvalidInput(
                f"the claims lack the columns {', '.join(dict.fromkeys(lacking))}:"
                " another version of this software judged the claims",
                folder / CLAIMS,
                code="other_rule",
                lacking=sorted(set(lacking)),
            )
    largest = 0.0
    wrong = [f"{claim}: not in the archive" for claim in now if claim not in before]
    for claim, row in before.items():
        again = now.get(claim)
        if again is None:
            wrong.append(f"{claim}: missing")
        elif other := [name for name in ANSWERS if row[name] != again[name]]:
            wrong += [f"{claim}, {name}: {row[name]} is not {again[name]}" for name in other]
        else:
            a, b = (np.array([float(cells["value"] or "nan")]) for cells in (row, again))
            off = tables.needed(a, b, ABSOLUTE_TOLERANCE)[0]
            largest = max(largest, off)
            if off > most:
                wrong.append(f"{claim}: {a[0]:.10g} is not {b[0]:.10g}")
    return Agreement(CLAIMS, largest, most, tuple(wrong))


def _there(folder: Path, name: str) -> Path:
    """Return the path of a table, or of the compressed table if only the compressed table exists."""
    path = folder / name
    return path if path.is_file() else path.with_name(f"{name}.gz")
