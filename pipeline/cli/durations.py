"""Durations of commands for the documentation, read from ``results/durations.csv``.

``make bench ARGS=commands`` measures the table, and ``make readme`` writes its durations into the pages.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from pipeline.reading import fault_of
from pipeline.validation import InvalidInput, require_range

_LINE = re.compile(r"^(make [^#\n]*?)( +#[^\n]*?)\(about [^()\n]*\)", re.MULTILINE)
"""Pattern of a ``make`` command in a page, with a comment that ends with the command's duration in brackets."""


def in_words(seconds: float) -> str:
    """Return a duration in words, with at most two digits.

    Examples
    --------
    >>> in_words(17.2), in_words(64.0), in_words(611.0)
    ('17 seconds', 'a minute', '10 minutes')
    """
    if seconds < 50.0:
        return f"{max(seconds, 2.0):.0f} seconds"
    minutes = round(seconds / 60.0)
    return "a minute" if minutes == 1 else f"{minutes} minutes"


def insert_durations(text: str, durations_s: Mapping[str, float]) -> str:
    """Return a Markdown page in which each ``(about …)`` contains the measured duration of its command.

    Parameters
    ----------
    text : str
        Page in Markdown.
    durations_s : mapping of str to float
        Seconds of wall time by command, as the page writes it.

    Raises
    ------
    InvalidInput
        If the page states the duration of a command that the table lacks.

    Examples
    --------
    >>> insert_durations("make test  # the tests (about …)", {"make test": 180.0})
    'make test  # the tests (about 3 minutes)'
    """

    def measured(match: re.Match[str]) -> str:
        command = match[1].strip()
        if command not in durations_s:
            raise InvalidInput(
                "the table lacks the duration of a command that a page mentions",
                "results/durations.csv",
                expected=", ".join(durations_s),
                received=command,
                code="no_duration",
            )
        return f"{match[1]}{match[2]}(about {in_words(durations_s[command])})"

    return _LINE.sub(measured, text)


def durations(rows: Sequence[Mapping[str, str]]) -> dict[str, float]:
    """Return the duration, s, of each command from the rows of ``durations.csv``."""
    try:
        return {
            row["command"]: require_range(
                f"durations.csv: {row['command']}", float(row["wall_s"]), at_least=0
            )
            for row in rows
        }
    except (KeyError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        expected = "columns command and wall_s, in seconds"
        raise InvalidInput(
            f"the durations cannot be read: {fault_of(error)}",
            "durations.csv",
            expected,
            code="not_understood",
        ) from error
