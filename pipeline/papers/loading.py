"""Reading and validating the papers' data files, ``conf/paper/<key>.yaml``.

An error is refused with the file and the claim or equation: a key that is unknown, missing or repeated, a value of the
wrong type, contradictory bounds, a placeholder without a number.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import yaml

from pipeline.papers.claims import LEAST_PEOPLE, Claim, Interval, Kind, Measure, Quantity, placeholders
from pipeline.validation import InvalidInput, require_choice


@dataclass(frozen=True, kw_only=True)
class Equation:
    """A numbered equation of a paper and the functions that compute it.

    Attributes
    ----------
    paper, number : str
        E.g. ``"zhang2007"`` and ``"3.15"``, which make the tag in the source.
    words : str
        The equation in one line.
    printed : str
        Dotted name of the function that computes it as printed, for tests to compare with.
    used : str
        Dotted name of the function that the results use; empty if none does.
    test : str
        File of its tests.
    note : str
        Misprints or ambiguities and how we read them; empty if there are none.
    """

    paper: str
    number: str
    words: str
    printed: str
    used: str
    test: str
    note: str = ""

    @property
    def tag(self) -> str:
        """The tag in the source, e.g. ``[zhang2007 3.15]``."""
        return f"[{self.paper} {self.number}]"


@dataclass(frozen=True, kw_only=True)
class Paper:
    """A paper.

    Attributes
    ----------
    key, title, authors, venue : str
    year : int
    figures, beyond : tuple of str
        Presets of its figures; presets of our own that go beyond it.
    equations : tuple of Equation
    unnumbered : tuple of Equation
        Formulas that the paper prints without a number; their "number" is what stands on their left.
        In printed order.
    claims : tuple of Claim
    quantities : tuple of Quantity
    """

    key: str
    title: str
    authors: str
    year: int
    venue: str
    figures: tuple[str, ...]
    beyond: tuple[str, ...]
    equations: tuple[Equation, ...]
    unnumbered: tuple[Equation, ...]
    claims: tuple[Claim, ...]
    quantities: tuple[Quantity, ...]

    @property
    def measured(self) -> tuple[Claim | Quantity, ...]:
        """Claims and quantities."""
        return (*self.claims, *self.quantities)


def load(folder: Path) -> dict[str, Paper]:
    """Return the papers of a folder by key, oldest first.

    Raises
    ------
    InvalidInput
        If a file cannot be read or is invalid; the sentence names file and entry.
    """
    raw = {path.stem: _Entry(path.name, read_mapping(path)) for path in sorted(folder.glob("*.yaml"))}
    claims = {name: body for paper in raw.values() for name, body in paper.mapping("claims").items()}
    papers = [_paper(key, entry, claims) for key, entry in raw.items()]
    names = Counter(item.name for paper in papers for item in paper.measured)
    for paper in papers:
        for item in paper.measured:
            where = f"{paper.key}.yaml, {item.name}"
            if names[item.name] > 1:
                raise InvalidInput("the name is there twice", where=where)
            if isinstance(item, Claim):
                _check_placeholders(item, {"value", *names}, where)
    return {paper.key: paper for paper in sorted(papers, key=lambda paper: (paper.year, paper.key))}


def _check_placeholders(claim: Claim, known: set[str], where: str) -> None:
    for data_name, text in claim.why.items():
        for name in placeholders(text):
            if name not in known:
                raise InvalidInput(f"no claim and no quantity {name!r}", where=f"{where}, why {data_name}")


# --- YAML -------------------------------------------------------------------------------------------------


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """A safe loader that refuses repeated keys."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict:
        keys = [key.value for key, _ in node.value]
        for key, times in Counter(keys).items():
            if times > 1:
                line = node.start_mark.line + 1
                raise InvalidInput(f"the key {key!r} is there twice", where=f"the mapping on line {line}")
        return super().construct_mapping(node, deep=deep)


def read_mapping(path: Path) -> dict[str, Any]:
    """Return the mapping in a YAML file.  Raises InvalidInput if it cannot be read or repeats a key."""
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), Loader=_Loader)
    except InvalidInput as error:
        raise InvalidInput(error.what, where=f"{path.name}, {error.where}") from error
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InvalidInput(f"cannot be read: {error}", where=path.name) from error
    if not isinstance(content, dict):
        raise InvalidInput("is not a mapping", where=path.name)
    return content


class _Entry:
    """A mapping in a file, whose keys must all be asked for."""

    def __init__(self, where: str, content: Any) -> None:
        if not isinstance(content, Mapping):
            raise InvalidInput("is not a mapping", where=where, received=repr(content))
        # YAML reads the word null as None.
        self.content = {"null" if key is None else key: value for key, value in content.items()}
        self.where = where
        self.asked: set[str] = set()

    def take(
        self, key: str, kinds: type | tuple[type, ...], default: Any = None, *, needed: bool = True
    ) -> Any:
        """Return the value of a key, of one of these types."""
        self.asked.add(key)
        if key not in self.content:
            if needed:
                raise InvalidInput(f"no {key!r}", where=self.where)
            return default
        value = self.content[key]
        if not isinstance(value, kinds) or isinstance(value, bool):
            wanted = kinds if isinstance(kinds, tuple) else (kinds,)
            raise InvalidInput(
                f"{key!r} is of the wrong type",
                where=self.where,
                expected=" or ".join(kind.__name__ for kind in wanted),
                received=repr(value),
            )
        return value

    def text(self, key: str, *, needed: bool = True) -> str:
        """Return a text; the parts of a list are joined by semicolons."""
        value = self.take(key, (str, list), "", needed=needed)
        return _joined(value, f"{self.where}, {key}")

    def mapping(self, key: str) -> dict[str, Any]:
        """Return a mapping, empty if the key is missing."""
        return self.take(key, dict, {}, needed=False)

    def names(self, key: str, *, needed: bool = True) -> tuple[str, ...]:
        """Return a list of texts."""
        value = self.take(key, list, [], needed=needed)
        if not all(isinstance(name, str) for name in value):
            raise InvalidInput(f"{key!r} is not a list of names", where=self.where, received=repr(value))
        return tuple(value)

    def done(self) -> None:
        """Refuse keys that were not asked for."""
        if unknown := [str(key) for key in self.content if key not in self.asked]:
            raise InvalidInput(
                f"unknown key {unknown[0]!r}",
                where=self.where,
                expected="one of " + ", ".join(sorted(self.asked)),
            )


def _joined(value: Any, where: str) -> str:
    parts = value if isinstance(value, list) else [value]
    if not all(isinstance(part, str) for part in parts):
        raise InvalidInput("is not a text", where=where, received=repr(value))
    return "; ".join(" ".join(part.split()) for part in parts)


def _number(value: Any, where: str) -> float:
    """Return a number, also from a text such as ``1/3`` or ``1e-6``."""
    try:
        if isinstance(value, bool):
            raise ValueError
        return float(Fraction(value)) if isinstance(value, str) and "/" in value else float(value)
    except (TypeError, ValueError, ZeroDivisionError):
        raise InvalidInput("is not a number", where=where, received=repr(value)) from None


# --- from mappings to objects -----------------------------------------------------------------------------


def _paper(key: str, entry: _Entry, all_claims: Mapping[str, Any]) -> Paper:
    equations = [_equation(key, item, entry.where) for item in entry.take("equations", list)]
    unnumbered = [
        _equation(key, item, entry.where) for item in entry.take("unnumbered", list, [], needed=False)
    ]
    people = entry.take("people", int, LEAST_PEOPLE, needed=False)
    claims = [_claim(key, name, all_claims, entry.where, people) for name in entry.mapping("claims")]
    quantities = [
        _quantity(key, name, body, entry.where) for name, body in entry.mapping("quantities").items()
    ]
    paper = Paper(
        key=key,
        title=entry.text("title"),
        authors=entry.text("authors"),
        year=entry.take("year", int),
        venue=entry.text("venue"),
        figures=entry.names("figures"),
        beyond=entry.names("beyond", needed=False),
        equations=tuple(equations),
        unnumbered=tuple(unnumbered),
        claims=tuple(claims),
        quantities=tuple(quantities),
    )
    entry.done()
    for item in paper.measured:
        where = f"{entry.where}, {item.name}"
        if not item.name.startswith(f"{key}_"):
            raise InvalidInput(f"the name does not begin with {key}_", where=where)
        if item.figure:
            require_choice(f"{where}, figure", item.figure, (*paper.figures, *paper.beyond))
    return paper


def _equation(key: str, content: Any, file: str) -> Equation:
    entry = _Entry(f"{file}, equations", content)
    number = entry.text("number")
    entry.where = f"{file}, equation {number}"
    equation = Equation(
        paper=key,
        number=number,
        words=entry.text("words"),
        printed=f"pipeline.{entry.text('printed')}",
        used=f"pipeline.{used}" if (used := entry.take("used", (str, type(None)))) else "",
        test=f"tests/{entry.text('test')}",
        note=entry.text("note", needed=False),
    )
    entry.done()
    if not (equation.used or equation.note):
        raise InvalidInput("nothing uses it, and no note says why", where=entry.where)
    return equation


def _claim(key: str, name: str, all_claims: Mapping[str, Any], file: str, people: int) -> Claim:
    entry = _Entry(f"{file}, {name}", _like(name, all_claims, f"{file}, {name}"))
    published = entry.take("published", (int, float, type(None)), needed=False)
    figure = entry.text("figure", needed=False)
    untestable = entry.text("untestable", needed=False)
    judged = not untestable
    bounds = _Entry(f"{entry.where}, bounds", entry.take("bounds", dict, {}, needed=judged))
    reproduced, direction, reason = (
        bounds.take("reproduced", dict, needed=judged),
        bounds.take("direction", dict, needed=False),
        bounds.text("reason", needed=judged),
    )
    bounds.done()
    measure = entry.take("measure", dict, needed=judged)
    null = entry.take("null", (int, float, str, dict), needed=False)
    no_null = ""
    if isinstance(null, Mapping) and set(null) == {"none"}:
        no_null, null = _joined(null["none"], f"{entry.where}, null"), None
    claim = Claim(
        name=name,
        paper=key,
        section=entry.text("section"),
        kind=Kind(require_choice(f"{entry.where}, kind", entry.text("kind"), list(Kind))),
        quote=entry.text("quote"),
        published=None if published is None else float(published),
        unit=entry.text("unit", needed=False),
        figure=figure,
        how=entry.text("how", needed=judged),
        measure=_measure(measure, figure, f"{entry.where}, measure") if measure else None,
        null=_null(null, figure, f"{entry.where}, null"),
        no_null=no_null,
        least_people=entry.take("people", int, people, needed=False),
        reproduced=_interval(reproduced, published, bounds.where) if reproduced else None,
        direction=_interval(direction, published, bounds.where) if direction else None,
        reason=reason,
        why={data: _joined(text, f"{entry.where}, why") for data, text in entry.mapping("why").items()},
        untestable=untestable,
        history=entry.text("history", needed=False),
    )
    entry.done()
    if untestable and (figure or measure or reproduced):
        raise InvalidInput("has a figure, a measure or bounds although it is untestable", where=entry.where)
    if judged and not figure:
        raise InvalidInput("no 'figure'", where=entry.where)
    _check_bounds(claim, bounds.where)
    return claim


def _like(name: str, all_claims: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return the keys of a claim, with those of the claims that it is ``like`` as defaults."""
    body, trail = all_claims[name], [name]
    if not isinstance(body, Mapping):
        raise InvalidInput("is not a mapping", where=where, received=repr(body))
    body = dict(body)
    while (other := body.pop("like", None)) is not None:
        if other not in all_claims or other in trail:
            raise InvalidInput("must be another claim", where=f"{where}, like", received=str(other))
        trail.append(other)
        body = {**all_claims[other], **body}
        if "like" in all_claims[other]:
            body["like"] = all_claims[other]["like"]
    return body


def _quantity(key: str, name: str, content: Any, file: str) -> Quantity:
    entry = _Entry(f"{file}, {name}", content)
    figure = entry.text("figure")
    quantity = Quantity(
        name=name,
        paper=key,
        figure=figure,
        how=entry.text("how"),
        measure=_measure(entry.take("measure", dict), figure, entry.where),
        unit=entry.text("unit", needed=False),
    )
    entry.done()
    return quantity


def _measure(content: Mapping[str, Any], figure: str, where: str) -> Measure:
    """Return a measure from a mapping of its name to its arguments."""
    if len(content) != 1 or not all(isinstance(arguments, Mapping) for arguments in content.values()):
        raise InvalidInput(
            "must be one name with its arguments",
            where=where,
            received=", ".join(map(str, content)) or "nothing",
        )
    ((name, given),) = content.items()
    arguments = {}
    for argument, value in given.items():
        if argument == "table" or argument.endswith("_table"):
            if not (isinstance(value, str) and value.rpartition("/")[2].startswith("table")):
                raise InvalidInput("is not a table", where=f"{where}, {argument}", received=repr(value))
            owner, _, table = value.rpartition("/")
            arguments[argument] = (owner or figure) + ("" if table == "table" else f"/{table}")
        else:
            arguments[argument] = _argument(value, figure, f"{where}, {argument}")
    return Measure(name, arguments)


def _null(content: Any, figure: str, where: str) -> Measure | float | None:
    if isinstance(content, Mapping):
        return _measure(content, figure, where)
    return None if content is None else _number(content, where)


def _argument(value: Any, figure: str, where: str) -> Any:
    if isinstance(value, Mapping):
        return _measure(value, figure, where)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return tuple(_argument(item, figure, where) for item in value)
    if not isinstance(value, str | int | float):
        raise InvalidInput("is no argument of a measure", where=where, received=repr(value))
    return value


def _interval(content: Mapping[str, Any], published: float | None, where: str) -> Interval:
    """Return bounds: ``exactly``, ``within`` a distance of the published number, or one or two ends."""
    values = {str(key): _number(value, f"{where}, {key}") for key, value in content.items()}
    if set(values) == {"exactly"}:
        return Interval(values["exactly"], values["exactly"])
    if set(values) == {"within"} and published is not None:
        return Interval(published - values["within"], published + values["within"])
    doubled = {"at_least", "above"} <= set(values) or {"at_most", "below"} <= set(values)
    if not values or not set(values) <= {"at_least", "above", "at_most", "below"} or doubled:
        raise InvalidInput(
            "must be exactly, within (of a published number), or at_least or above, at_most or below",
            where=where,
            received=", ".join(values) or "nothing",
        )
    interval = Interval(
        values.get("at_least", values.get("above", -math.inf)),
        values.get("at_most", values.get("below", math.inf)),
        low_open="above" in values,
        high_open="below" in values,
    )
    if interval.low >= interval.high:
        raise InvalidInput("the ends contradict each other", where=where, received=str(interval))
    return interval


def _check_bounds(claim: Claim, where: str) -> None:
    inner, outer = claim.reproduced, claim.direction
    if inner is not None and claim.published is not None and claim.published not in inner:
        raise InvalidInput("the published number would not reproduce the paper", where=where)
    if (
        inner is not None
        and outer is not None
        and (outer == inner or outer.low > inner.low or outer.high < inner.high)
    ):
        raise InvalidInput("the direction is not wider than what is reproduced", where=where)
