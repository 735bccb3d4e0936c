"""Registry of all papers by key, and of all claims by name.

Examples
--------
>>> claim("zhang2007_optimal_variance").published
70.0
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from pipeline import plugins
from pipeline.papers.claims import Claim, Quantity
from pipeline.papers.entries import parsed_mapping, read_mapping
from pipeline.papers.loading import Paper, load
from pipeline.validation import InvalidInput, require_choice


def all_papers() -> dict[str, Paper]:
    """Return all papers by key, sorted by year, followed by the claims of users, sorted by file name."""
    return _load(plugins.edition())


@cache
def _load(_: object) -> dict[str, Paper]:
    added: dict[str, Any] = {}
    for origin, claims in plugins.contributions("claims"):
        name = origin.name
        if isinstance(claims, Path):
            added[claims.stem] = read_mapping(claims)
        else:
            entries = (
                claims if isinstance(claims, Mapping) else parsed_mapping(str(claims), f"claims of {name}")
            )
            added[name] = {"claims": {**added.get(name, {}).get("claims", {}), **entries}}
    return load([folder / "paper" for folder in plugins.conf_folders()], added)


def paper(key: str) -> Paper:
    """Return the paper with a given key.

    Raises
    ------
    InvalidInput
        If no paper has this key.
    """
    papers = all_papers()
    return papers[require_choice("the paper", key, papers)]


def claim(name: str) -> Claim:
    """Return the claim with a given name.

    Raises
    ------
    InvalidInput
        If no claim has this name.
    """
    item = quantity(name)
    if not isinstance(item, Claim):
        raise InvalidInput(
            f"there is no claim {name!r}",
            expected="a name from the list that `make claims` prints",
            code="unknown_claim",
            name=name,
        )
    return item


def published(name: str) -> float:
    """Return the number that a paper published for a claim.

    Raises
    ------
    InvalidInput
        If the claim is unknown or has no number.
    """
    number = claim(name).published
    if number is None:
        raise InvalidInput("the claim has no published number", name, code="no_published_number")
    return number


def quantity(name: str) -> Claim | Quantity:
    """Return the claim or quantity with a given name.

    Raises
    ------
    InvalidInput
        If no claim or quantity has this name.
    """
    for paper in all_papers().values():
        for item in paper.measured:
            if item.name == name:
                return item
    raise InvalidInput(
        f"there is no claim or quantity {name!r}",
        expected="a name in conf/paper",
        code="unknown_claim",
        name=name,
    )


def locate(dotted: str) -> tuple[Path, int]:
    """Return the source file of a function, class or method, and the line number at which it begins.

    Raises
    ------
    InvalidInput
        If no object has this name.

    Examples
    --------
    >>> locate("pipeline.papers.locate")[0].name
    'register.py'
    """
    try:
        thing = plugins.resolve(dotted)
    except (ImportError, AttributeError, ValueError) as error:
        raise InvalidInput(
            f"there is no function, class or method {dotted}",
            received=str(error),
            code="unknown_object",
            name=dotted,
        ) from error
    thing = inspect.unwrap(getattr(thing, "py_func", getattr(thing, "fget", None) or thing))
    return Path(inspect.getfile(thing)), inspect.getsourcelines(thing)[1]
