"""The papers by key, their equations and claims by name, and the equation tags in source files.

Examples
--------
>>> print(equation("zhang2007", "3.9").words)
least-squares coefficients by the pseudo-inverse
>>> claim("zhang2007_optimal_variance").published
70.0
"""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.papers.claims import Claim, Quantity
from pipeline.papers.loading import Equation, Paper, load
from pipeline.resources import CONF
from pipeline.validation import InvalidInput, require_choice

FOLDER = CONF / "paper"

PAPERS: dict[str, Paper] = load(FOLDER)
"""The papers by key, oldest first."""

_TAG = re.compile(rf"\[({'|'.join(PAPERS)}) (?!(?:figure|section|table|appendix)\b)([^\]]+)\]")


@dataclass(frozen=True)
class Tag:
    """An equation tag in a source text, on a line (from 1)."""

    paper: str
    number: str
    line: int


def paper(key: str) -> Paper:
    """Return one of the papers.

    Raises
    ------
    InvalidInput
        If there is no paper of that key.
    """
    return PAPERS[require_choice("the paper", key, PAPERS)]


def equation(key: str, number: str) -> Equation:
    """Return a numbered equation of a paper.

    Raises
    ------
    InvalidInput
        If the paper is unknown or has no equation of that number.
    """
    by_number = {equation.number: equation for equation in paper(key).equations}
    return by_number[require_choice(f"the equation of {key}", number, by_number)]


def claim(name: str) -> Claim:
    """Return the claim of that name.

    Raises
    ------
    InvalidInput
        If no paper has it.
    """
    found = _named(name)
    if not isinstance(found, Claim):
        raise InvalidInput(f"no claim {name!r}", expected="a name of the ledger, as `make claims` lists them")
    return found


def quantity(name: str) -> Claim | Quantity:
    """Return the claim or quantity of that name.

    Raises
    ------
    InvalidInput
        If no paper has it.
    """
    found = _named(name)
    if found is None:
        raise InvalidInput(f"no claim and no quantity {name!r}", expected="a name of conf/paper")
    return found


def _named(name: str) -> Claim | Quantity | None:
    return next((item for p in PAPERS.values() for item in p.measured if item.name == name), None)


def locate(dotted: str) -> tuple[Path, int]:
    """Return the file and the first line (from 1) of a function, class or method.

    Raises
    ------
    InvalidInput
        If nothing has that name.

    Examples
    --------
    >>> locate("pipeline.papers.find_tags")[0].name
    'register.py'
    """
    thing: Any = None
    name = ""
    for part in dotted.split("."):
        name = f"{name}.{part}".lstrip(".")
        try:
            # What a package exports comes before a module of the same name.
            thing = getattr(thing, part) if hasattr(thing, part) else importlib.import_module(name)
        except ModuleNotFoundError as error:
            raise InvalidInput(f"there is no {dotted}", received=f"nothing called {part!r}") from error
    thing = inspect.unwrap(getattr(thing, "py_func", getattr(thing, "fget", None) or thing))
    return Path(inspect.getfile(thing)), inspect.getsourcelines(thing)[1]


def find_tags(source: str) -> Iterator[Tag]:
    """Yield the equation tags of a source text, line by line; figures and sections are not equations.

    Several equations may share a tag, ``[zhang2007 4.1, 4.2]``, or be a range of the printed order,
    ``[zhang2007 A.1-A.5]``.  A number that the paper does not have is yielded as well.

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
