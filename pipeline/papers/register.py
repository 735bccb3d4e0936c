"""The papers by key, and their claims by name.

Examples
--------
>>> claim("zhang2007_optimal_variance").published
70.0
"""

from __future__ import annotations

import importlib
import inspect
from pathlib import Path
from typing import Any

from pipeline.papers.claims import Claim, Quantity
from pipeline.papers.loading import Paper, load
from pipeline.resources import CONF
from pipeline.validation import InvalidInput, require_choice

FOLDER = CONF / "paper"

PAPERS: dict[str, Paper] = load(FOLDER)
"""The papers by key, oldest first."""


def paper(key: str) -> Paper:
    """Return one of the papers.

    Raises
    ------
    InvalidInput
        If there is no paper of that key.
    """
    return PAPERS[require_choice("the paper", key, PAPERS)]


def claim(name: str) -> Claim:
    """Return the claim of that name.

    Raises
    ------
    InvalidInput
        If no paper has it.
    """
    found = quantity(name)
    if not isinstance(found, Claim):
        raise InvalidInput(f"no claim {name!r}", expected="a name of the ledger, as `make claims` lists them")
    return found


def published(name: str) -> float:
    """Return the number that a paper prints in a claim.

    Raises
    ------
    InvalidInput
        If no paper has the claim, or it has no number.
    """
    number = claim(name).published
    if number is None:
        raise InvalidInput("the claim has no number", name)
    return number


def quantity(name: str) -> Claim | Quantity:
    """Return the claim or quantity of that name.

    Raises
    ------
    InvalidInput
        If no paper has it.
    """
    for one in PAPERS.values():
        for item in one.measured:
            if item.name == name:
                return item
    raise InvalidInput(f"no claim and no quantity {name!r}", expected="a name of conf/paper")


def locate(dotted: str) -> tuple[Path, int]:
    """Return the file and the first line (from 1) of a function, class or method.

    Raises
    ------
    InvalidInput
        If nothing has that name.

    Examples
    --------
    >>> locate("pipeline.papers.locate")[0].name
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
