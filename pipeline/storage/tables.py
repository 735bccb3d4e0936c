"""Tidy tables as CSV: one row per observation, units in column names, equal bytes for equal numbers.

Rows of another length than the header are rejected, since padding would shift or invent values.  A text that a
spreadsheet would run as a formula is written with an apostrophe in front, and read without it.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from operator import methodcaller
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.reading import read_file, unpacked
from pipeline.storage.publishing import Replace, new_file
from pipeline.storage.sealed_folders import digest, read_manifest, writing
from pipeline.validation import InvalidInput, harmless

_INTEGER, _NUMBER = r"(?:0|-?[1-9]\d{0,17})", r"(?:-?(?:0|[1-9]\d*)(?:\.\d+)?(?:e[+-]?\d+)?|-?inf|)"
_NO_INTEGER, _NO_NUMBER = (re.compile(rf"^(?!{cell}$)", re.MULTILINE) for cell in (_INTEGER, _NUMBER))
"""Patterns that find a line that is not an integer, and a line that is not a number."""
_SHOWN_DIFFERENCES = 10
_ROWS_AT_A_TIME = 50_000
_MAX_COLUMNS = 10_000


def write(
    path: Path,
    columns: Mapping[str, Any],
    *,
    sort_by: Sequence[str] = (),
    replace: Replace | None = None,
) -> None:
    """Write a table atomically.

    Parameters
    ----------
    path : Path
    columns : mapping of str to array-like, such as a DataFrame
        One-dimensional, of one length: numbers (floats to ten significant digits, NaN as an empty cell),
        booleans or text.
    sort_by : sequence of str
        Columns by which the rows are sorted, stably.
    replace : bool or callable, optional
        Permission to replace a file, as for `new_file`; by default only a table with the same columns is replaced.

    Raises
    ------
    InvalidInput
        If there is no column, lengths differ, a column has mixed types, a column of `sort_by` is missing, or the file
        cannot be written.
    """
    arrays = {name: _column(name, columns[name], path.name) for name in columns}
    if not arrays:
        raise InvalidInput("the table has no columns", path.name, code="no_columns")
    lengths = {name: len(array) for name, array in arrays.items()}
    if len(set(lengths.values())) > 1:
        raise InvalidInput(
            "the columns of the table differ in length",
            path.name,
            received=", ".join(f"{name} {length}" for name, length in lengths.items()),
            code="other_length",
            lengths=lengths,
        )
    if missing := [name for name in sort_by if name not in arrays]:
        raise InvalidInput(
            f"the table cannot be sorted by {missing[0]!r}, a column that it lacks",
            path.name,
            "one of " + ", ".join(arrays),
            code="no_column",
            column=missing[0],
        )
    if sort_by and len(arrays[sort_by[0]]):
        keys = [arrays[name] for name in reversed(sort_by)]
        order = np.lexsort(
            [key.astype(str) if key.dtype.kind == "O" else key for key in keys]
        )  # stable, NaN last
        arrays = {name: array[order] for name, array in arrays.items()}
    header = _lines([map(_escaped, arrays)])
    ours: Replace = (lambda old: old.startswith(header)) if replace is None else replace
    with writing(path), new_file(path, replace=ours) as partial, partial.open("wb") as file:
        file.write(header)
        for start in range(0, max(lengths.values()), _ROWS_AT_A_TIME):
            block = (_written(array[start : start + _ROWS_AT_A_TIME]) for array in arrays.values())
            file.write(_lines(zip(*block, strict=True)))


def renew(
    path: Path,
    rows: Sequence[Mapping[str, Any]],
    stale: Callable[[Mapping[str, str]], bool] | None,
    *,
    columns: Sequence[str],
    sort_by: Sequence[str],
    replace: Replace = True,
) -> None:
    """Write rows into a table, in place of the table's outdated rows.

    Parameters
    ----------
    path : Path
    rows : sequence of mapping
        New rows: cells by column, as text, numbers or booleans.
    stale : callable, optional
        Function that returns whether an existing row, with each cell as text, is removed.  None: all are removed, and
        the file is not read.
    columns, sort_by : sequence of str
        All columns, and the text columns by which the rows are sorted.
    replace : bool or callable
        Permission to replace a file, as for `write`.
    """
    remaining = [row for row in read_rows(path) if not stale(row)] if stale and path.is_file() else []
    cells = {
        name: [*(row.get(name, "") for row in remaining), *(_cell(row[name]) for row in rows)]
        for name in columns
    }
    write(path, cells, sort_by=sort_by, replace=replace)


def of_rows(names: Sequence[str], rows: Sequence[Sequence[Any]]) -> dict[str, list[Any]]:
    """Return a table (columns by name) built from rows of cells."""
    return {name: [row[n] for row in rows] for n, name in enumerate(names)}


def read(path: Path, *, sha256: str | None = None) -> dict[str, np.ndarray]:
    """Return the columns of a table, in file order.

    A column of integers without leading zeros is int64, another column of numbers and empty cells (NaN) is float64.  A
    column of ``True`` and ``False`` is bool, any other text.  Floats without fractions are thus read as int64, and
    ``02`` stays text.

    Raises
    ------
    InvalidInput
        If the file is missing, empty or not UTF-8, a row and the header differ in length, or the content does not have
        the expected sha256.
    """
    return {name: _typed(cells) for name, cells in _cells(path, sha256).items()}


def read_published(folder: Path) -> dict[str, dict[str, np.ndarray]]:
    """Return the tables of a published figure by name (``table``, ``table_walkers``, …), each read as by `read`.

    Raises
    ------
    InvalidInput
        If the folder has no sealed manifest, or the sha256 of a table differs from it.
    """
    files = read_manifest(folder)["files"]
    return {
        Path(name).stem: read(folder / name, sha256=fact["sha256"])
        for name, fact in sorted(files.items())
        if re.fullmatch(r"table\w*\.csv", name)
    }


def read_rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table, with every cell as text.

    Raises
    ------
    InvalidInput
        As `read`.
    """
    columns = _cells(path)
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


Table = Mapping[str, np.ndarray]
"""Table as columns by name; each column is an array (N,)."""


def compare(
    first: Path | Table, other: Path | Table, *, relative: float = 1e-6, absolute: float = 1e-9
) -> list[str]:
    """Return the first cells that differ between two tables, one sentence each; empty if the tables agree.

    Numbers agree within ``absolute + relative * max(|a|, |b|)``, and NaN agrees with NaN.  Text and the order of
    columns and rows must be equal.

    Raises
    ------
    InvalidInput
        As `read`.
    """
    a, b = (read(table) if isinstance(table, Path) else table for table in (first, other))
    if complaint := _unlike(a, b):
        return [complaint]
    differences = [
        (i, f"line {i + 2}, {name}: {a[name][i]} is not {b[name][i]}")
        for name in a
        for i in np.flatnonzero(needed(a[name], b[name], absolute) > relative)
    ]
    differences.sort(key=lambda item: item[0])
    sentences = [sentence for _, sentence in differences[:_SHOWN_DIFFERENCES]]
    if (more := len(differences) - len(sentences)) > 0:
        sentences.append(f"and {more} more cells")
    return sentences


def relative_differences(
    first: Path | Table, other: Path | Table, *, absolute: float = 1e-9
) -> dict[str, float]:
    """Return for each column the smallest relative tolerance at which two tables agree; infinite if they never agree.

    Raises
    ------
    InvalidInput
        As `read`.
    """
    a, b = (read(table) if isinstance(table, Path) else table for table in (first, other))
    if _unlike(a, b):
        return dict.fromkeys(a, np.inf)
    return {name: float(needed(a[name], b[name], absolute).max(initial=0.0)) for name in a}


def _unlike(a: Table, b: Table) -> str:
    """Return the reason why the cells of two tables cannot be compared; empty if the cells can be compared."""
    if list(a) != list(b):
        return f"the columns differ: {', '.join(a)} and {', '.join(b)}"
    length_a, length_b = (len(next(iter(table.values()))) for table in (a, b))
    return "" if length_a == length_b else f"the numbers of rows differ: {length_a} and {length_b}"


def needed(a: np.ndarray, b: np.ndarray, absolute: float) -> np.ndarray:
    """Return the smallest relative tolerance at which each pair of cells agrees; infinite if a pair never agrees."""
    if a.dtype.kind not in "if" or b.dtype.kind not in "if":
        return np.where(a.astype(str) == b.astype(str), 0.0, np.inf)
    with np.errstate(invalid="ignore", divide="ignore"):  # infinity minus infinity, zero over zero
        beyond = np.maximum(np.abs(a.astype(float) - b) - absolute, 0.0)
        needed = beyond / np.maximum(np.abs(a), np.abs(b))
    never = ~(np.isfinite(a) & np.isfinite(b))
    return np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, np.where(never, np.inf, needed))


def _column(name: str, values: Any, where: str) -> np.ndarray:
    """Return a column as an array (N,) of numbers, booleans or text."""
    if not name:
        raise InvalidInput("a column of the table has no name", where, code="no_name")
    if getattr(values, "dtype", None) == "str" and len(
        values
    ):  # a DataFrame column: check each distinct text once
        codes, texts = values.factorize()
        if codes.min() >= 0:
            return _column(name, texts.tolist(), where).astype(object)[codes]
    array = np.asarray(values)
    if array.ndim != 1:
        raise InvalidInput(
            f"the column {name!r} is not one-dimensional",
            where,
            received=f"shape {array.shape}",
            code="wrong_shape",
            column=name,
        )
    kinds = set(map(type, values)) if array.dtype.kind in "OU" else set()
    mixed = not all(issubclass(kind, str) for kind in kinds)
    if array.dtype.kind == "O" and not mixed:
        array = array.astype(str)  # text of a DataFrame, or a column without rows
    if array.dtype.kind not in "biufU" or mixed:
        received = "text and other types" if array.dtype.kind == "U" else str(array.dtype)
        raise InvalidInput(
            f"the column {name!r} has mixed or unsupported types",
            where,
            "numbers, booleans or text",
            received,
            code="mixed_types",
            column=name,
            type=received,
        )
    texts = set(array.tolist()) if kinds else set()
    if broken := [v for v in texts if any(c in v for c in "\r\n\0")]:
        raise InvalidInput(
            f"the column {name!r} contains text of several lines",
            where,
            received=repr(min(broken)),
            code="several_lines",
            column=name,
        )
    if any(text != _escaped(text) for text in texts):
        array = np.array([*map(_escaped, array.tolist())])
    # Adding zero turns -0.0, whose sign would depend on the order of summation, into 0.0.
    return array + 0.0 if array.dtype.kind == "f" else array


def _escaped(text: str) -> str:
    """Return a text, with an apostrophe in front if a spreadsheet would interpret the text as a formula.

    Apostrophes at the beginning of the text are ignored in this test.
    """
    bare = text.lstrip("'")
    return text if harmless(bare) == bare else f"'{text}"


def _restored(text: str) -> str:
    """Return a text without the apostrophe that `_escaped` put in front."""
    return text[1:] if text[:1] == "'" and _escaped(text[1:]) != text[1:] else text


def _lines(rows: Iterable[Iterable[Any]]) -> bytes:
    """Return rows as the bytes of a CSV file."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue().encode()


def _written(array: np.ndarray) -> list[Any]:
    """Return the cells of a column for CSV: floats have ten significant digits, NaN is an empty cell."""
    if array.dtype.kind != "f":
        return list(array.tolist())
    cells = ["%.10g" % value for value in array.tolist()]  # noqa: UP031 - a third quicker than f-strings
    for missing in np.flatnonzero(np.isnan(array)):
        cells[missing] = ""
    return cells


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value + 0.0:.10g}"
    return str(value)


def _cells(path: Path, sha256: str | None = None) -> dict[str, Sequence[str]]:
    """Return the columns of a CSV file with every cell as text, after checking that all rows have equal length."""
    content = packed = read_file(path, subject="the table")
    if path.suffix == ".gz":
        content = unpacked(packed, path, subject="the table")
    try:
        if sha256 is not None and (received := digest(packed)) != sha256:
            raise InvalidInput(
                "the table was changed after it was published",
                path,
                f"sha256 {sha256[:12]}…",
                f"{received[:12]}…",
                code="changed",
            )
        text = content.decode("utf-8-sig")
        lines = text.removesuffix("\n").split("\n")
        commas = set(map(methodcaller("count", ","), lines))
        if max(commas) >= _MAX_COLUMNS:
            raise InvalidInput(
                "the table has too many columns",
                path,
                f"{_MAX_COLUMNS} or fewer",
                max(commas) + 1,
                code="too_many_columns",
            )
        if len(commas) == 1 and 0 not in commas and '"' not in text and "\r" not in text:
            cells, width = ",".join(lines).split(","), commas.pop() + 1
            header, columns = cells[:width], [cells[width + i :: width] for i in range(width)]
        else:
            reader = csv.reader(io.StringIO(text, newline=""), strict=True)
            header = next(reader, [])
            rows = []
            for row in reader:
                # A table of one column has "" for an empty cell, so an empty line is a truncated row.
                if len(row) != len(header):
                    raise InvalidInput(
                        "a row and the header of the table differ in length",
                        f"{path.name}, line {reader.line_num}",
                        f"{len(header)} cells",
                        len(row),
                        code="row_length",
                        columns=len(header),
                        cells=len(row),
                    )
                rows.append(row)
            columns = [[row[i] for row in rows] for i in range(len(header))]
    except UnicodeDecodeError as error:
        raise InvalidInput(
            "the table is not UTF-8 text", f"{path.name}, byte {error.start}", code="not_utf8"
        ) from error
    except csv.Error as error:
        raise InvalidInput(
            f"the table is not CSV: {error}", f"{path.name}, line {reader.line_num}", code="not_csv"
        ) from error
    if not any(header):
        raise InvalidInput("the table is empty: it has no column names", path.name, code="empty_table")
    if twice := [name for name, count in Counter(header).items() if count > 1]:
        raise InvalidInput(
            f"two columns have the name {twice[0]!r}", path.name, code="duplicate_name", column=twice[0]
        )
    if "'" in text:
        header, columns = [*map(_restored, header)], [[*map(_restored, column)] for column in columns]
    return dict(zip(header, columns, strict=True))


def _typed(cells: Sequence[str]) -> np.ndarray:
    """Return a column as an array of the narrowest type that fits all its cells."""
    lines = "\n".join(cells)
    # A single search over all cells takes a fifth of the time of a search per cell.
    if lines.count("\n") == len(cells) - 1:
        if not _NO_INTEGER.search(lines):
            return np.array(list(map(int, cells)), np.int64)
        if not _NO_NUMBER.search(lines):
            return np.array([float(cell or "nan") for cell in cells], np.float64)
    if cells and set(cells) <= {"True", "False"}:
        return np.array([cell == "True" for cell in cells])
    return np.array(cells, str)
