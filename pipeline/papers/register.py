"""The four papers as data: where each numbered equation lives, and what became of each claim.

`PAPERS` holds them by key; `equation` and `claim` look one up; `find_tags` reads the marks that source files
carry, such as ``[zhang2007 3.15]``; `judge` compares claims with the figures' tables.  The data of each paper
is a module of its own, ``pipeline.papers_<key>``.

Examples
--------
>>> print(equation("zhang2007", "3.9").words)
least-squares coefficients by the pseudo-inverse
>>> claim("zhang2007_optimal_variance").published
70
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from pipeline.papers import mozerov2006 as papers_mozerov2006
from pipeline.papers import park2011 as papers_park2011
from pipeline.papers import zhang2004 as papers_zhang2004
from pipeline.papers import zhang2007 as papers_zhang2007
from pipeline.papers.claims import (
    OVERRIDDEN,
    Claim,
    Equation,
    Interval,
    Outcome,
    Paper,
    Tables,
    Verdict,
    judge,
)
from pipeline.validation import InvalidInput

__all__ = [
    "OVERRIDDEN",
    "PAPERS",
    "Claim",
    "Equation",
    "Interval",
    "Outcome",
    "Paper",
    "Tables",
    "Tag",
    "Verdict",
    "claim",
    "equation",
    "find_tags",
    "judge",
]

PAPERS: dict[str, Paper] = {
    paper.key: paper
    for paper in (
        papers_zhang2004.PAPER,
        papers_zhang2007.PAPER,
        papers_mozerov2006.PAPER,
        papers_park2011.PAPER,
    )
}
"""The four papers by key."""

_TAG = re.compile(rf"\[({'|'.join(PAPERS)}) (?!(?:figure|section|table|appendix)\b)([^\]]+)\]")


@dataclass(frozen=True)
class Tag:
    """A mark in a source text: this equation, on this line (from 1)."""

    paper: str
    number: str
    line: int


def paper(key: str) -> Paper:
    """One of the four papers.

    Raises
    ------
    InvalidInput
        If there is no paper of that key.
    """
    if key not in PAPERS:
        raise InvalidInput(f"no paper {key!r}", expected="one of " + ", ".join(PAPERS))
    return PAPERS[key]


def equation(key: str, number: str) -> Equation:
    """A numbered equation of a paper.

    Raises
    ------
    InvalidInput
        If the paper is unknown or has no equation of that number.
    """
    for candidate in paper(key).equations:
        if candidate.number == number:
            return candidate
    numbers = ", ".join(e.number for e in paper(key).equations)
    raise InvalidInput(f"no equation {number!r}", where=key, expected=f"one of {numbers}")


def claim(name: str) -> Claim:
    """The claim of that name.

    Raises
    ------
    InvalidInput
        If no paper has it.
    """
    for candidate_paper in PAPERS.values():
        for candidate in candidate_paper.claims:
            if candidate.name == name:
                return candidate
    raise InvalidInput(f"no claim {name!r}", expected="a name of the ledger, as `make claims` lists them")


def find_tags(source: str) -> Iterator[Tag]:
    """The equation marks of a source text, line by line; figures and sections are not equations.

    Several equations may share a mark, ``[zhang2007 4.1, 4.2]``, or be a range of the printed order,
    ``[zhang2007 A.1-A.5]``.  A number that the paper does not have is returned as it stands, so that whoever
    checks can name it.

    Examples
    --------
    >>> [tag.number for tag in find_tags("see [zhang2007 4.1, A.1-A.3] and [zhang2007 figure 5]")]
    ['4.1', 'A.1', 'A.2', 'A.3']
    """
    for line, text in enumerate(source.splitlines(), start=1):
        for match in _TAG.finditer(text):
            printed = [e.number for e in PAPERS[match[1]].equations]
            for part in match[2].split(","):
                ends = [end.strip() for end in re.split("[-–]", part)]
                if len(ends) == 2 and set(ends) <= set(printed):
                    ends = printed[printed.index(ends[0]) : printed.index(ends[1]) + 1]
                yield from (Tag(match[1], number, line) for number in ends)
