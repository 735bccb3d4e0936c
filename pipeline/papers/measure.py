"""Measures: named functions of result tables, together with their arguments."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Measure:
    """Named function of result tables, together with the values of its arguments.

    Attributes
    ----------
    name : str
        Name of a function in the `measures` modules of the studies.
    arguments : mapping of str to Any
        Numbers, texts, measures and lists of them.  The argument ``table``, and any whose name ends in
        ``_table``, names a table: ``zhang2007_fig5`` is the figure's ``table.csv``, and
        ``zhang2007_fig5/table_walkers`` is ``table_walkers.csv`` in the same folder.

    Examples
    --------
    >>> of = Measure("mean", {"table": "zhang2007_fig5", "column": "rms_error_mm"})
    >>> both = Measure("ratio", {"of": of, "to": 2})
    >>> print(both, both.tables)
    ratio(of=mean(table=zhang2007_fig5, column=rms_error_mm), to=2) ('zhang2007_fig5',)
    """

    name: str
    arguments: Mapping[str, Any]

    def __str__(self) -> str:
        return f"{self.name}({', '.join(f'{name}={_in_words(value)}' for name, value in self.arguments.items())})"

    @property
    def parts(self) -> Iterator[Measure]:
        """Yield this measure and, recursively, all measures among its arguments."""
        yield self
        for value in self.arguments.values():
            for item in value if isinstance(value, tuple) else (value,):
                if isinstance(item, Measure):
                    yield from item.parts

    @property
    def tables(self) -> tuple[str, ...]:
        """Names of the result tables that the measure reads, without duplicates."""
        named = (
            value
            for part in self.parts
            for name, value in part.arguments.items()
            if name == "table" or name.endswith("_table")
        )
        return tuple(dict.fromkeys(named))

    def replaced(self, words: Mapping[str, str]) -> Measure:
        """Return the measure with words replaced in its arguments, such as names of columns and methods.

        Examples
        --------
        >>> of = Measure("mean", {"column": "error_mm", "where": "method == 'map' and view == 0"})
        >>> print(of.replaced({"map": "average_walker"}))
        mean(column=error_mm, where=method == 'average_walker' and view == 0)
        """
        pattern = re.compile(r"\b(?:" + "|".join(map(re.escape, words)) + r")\b")

        def anew(value: Any) -> Any:
            if isinstance(value, Measure):
                return value.replaced(words)
            if isinstance(value, tuple):
                return tuple(anew(item) for item in value)
            return pattern.sub(lambda match: words[match[0]], value) if isinstance(value, str) else value

        return Measure(self.name, {name: anew(value) for name, value in self.arguments.items()})


def _in_words(value: Any) -> str:
    return f"[{', '.join(map(str, value))}]" if isinstance(value, tuple) else str(value)
