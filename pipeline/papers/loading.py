"""Reading and validating the papers' data files, ``conf/paper/<key>.yaml``.

An error is refused with the file and the claim or equation: a key that is unknown, missing or repeated, a value of the
wrong type, contradictory bounds, a placeholder without a number.
"""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipeline.papers.claim_entries import Runs, claim_entry, quantity_entry
from pipeline.papers.claims import LEAST_PEOPLE, Baseline, Claim, Kind, Quantity
from pipeline.papers.entries import mapping, names, number, read_mapping, record, text, whole
from pipeline.papers.explanations import Run, of_run, placeholders, read_runs
from pipeline.reading import read_file
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


@dataclass(frozen=True)
class Page:
    """What the report says of a paper before its figures.

    Attributes
    ----------
    figure : str
        The one that stands for it.
    question : str
        That the paper answers.
    sentences : tuple of str
        Numbers of ours stand as placeholders, by the names of claims.
    """

    figure: str = ""
    question: str = ""
    sentences: tuple[str, ...] = ()


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
    order : int
        Place among the papers in which figures are made: its year, if its file does not say.
    subject : str
        Papers on one subject are made together.
    page : Page
    """

    key: str
    title: str
    authors: str
    year: int
    venue: str
    figures: tuple[str, ...]
    equations: tuple[Equation, ...]
    beyond: tuple[str, ...] = ()
    unnumbered: tuple[Equation, ...] = ()
    claims: tuple[Claim, ...] = ()
    quantities: tuple[Quantity, ...] = ()
    order: int = 0
    subject: str = ""
    page: Page = Page()

    @property
    def measured(self) -> tuple[Claim | Quantity, ...]:
        """Claims and quantities."""
        return (*self.claims, *self.quantities)


INTERVENTIONS = "interventions.csv"
"""Numbers of runs with a switch, which explanations quote."""

REGISTERED = "registered.csv"
"""Values of conditions on the published results, by data set: renewed with each scientific change."""

BETTER = {"": 0, "more": 1, "less": -1}

OWN_YEAR = 9999
"""Year of a user's own claims, by which they come last."""

BASELINES = "baselines.yaml"
"""The baseline of each class of measures; no claim chooses its own."""


def load(folders: Sequence[Path], added: Mapping[str, Mapping[str, Any]] | None = None) -> dict[str, Paper]:
    """Return the papers of folders by key, oldest first.

    Parameters
    ----------
    folders : sequence of Path
        Each with files of papers, ``baselines.yaml`` and ``interventions.csv``, or some of them.
    added : mapping, optional
        Contents of further files by key; what they leave out is that of a user's own claims on walks.

    Raises
    ------
    InvalidInput
        If a file cannot be read or is invalid; the sentence names file and entry.
    """
    files = [path for folder in folders for path in sorted(folder.glob("*.yaml")) if path.name != BASELINES]
    raw = {path.stem: read_mapping(path) for path in files}
    raw |= {key: _completed(key, content) for key, content in (added or {}).items()}
    baselines: dict[str, Baseline] = {}
    runs: dict[tuple[str, str, str], Run] = {}
    registered: dict[tuple[str, str], float] = {}
    for folder in folders:
        baselines |= read_baselines(folder / BASELINES) if (folder / BASELINES).is_file() else {}
        runs |= read_runs(folder / INTERVENTIONS)
        registered |= read_registered(folder / REGISTERED)
    claims = {name: body for paper in raw.values() for name, body in paper.get("claims", {}).items()}
    papers = [_paper(key, content, claims, runs, baselines, registered) for key, content in raw.items()]
    names = Counter(item.name for paper in papers for item in paper.measured)
    shorts = Counter((paper.key, claim.text.short) for paper in papers for claim in paper.claims)
    for paper in papers:
        for item in paper.measured:
            where = f"{paper.key}.yaml, {item.name}"
            if names[item.name] > 1:
                raise InvalidInput("the name is there twice", where, code="duplicate_name")
            if isinstance(item, Claim):
                if shorts[paper.key, item.text.short] > 1:
                    raise InvalidInput(
                        f"another claim has the short name {item.text.short!r}",
                        where,
                        code="duplicate_name",
                    )
                if item.same_as and item.same_as not in names:
                    raise InvalidInput(
                        f"no claim {item.same_as!r}", where, code="unknown_claim", name=item.same_as
                    )
                _check_explanations(item, set(names), where)
    return {paper.key: paper for paper in sorted(papers, key=lambda paper: (paper.year, paper.key))}


def _completed(key: str, content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a file of claims with what a user's own claims leave out."""
    claims = mapping(content.get("claims", {}), f"{key}, claims")
    figures = sorted({str(mapping(body, name).get("figure", "")) for name, body in claims.items()} - {""})
    left_out = {"title": key, "authors": "", "year": OWN_YEAR, "venue": "", "figures": [], "equations": []}
    return {**left_out, "clips": "walks", "beyond": figures, **content}


def read_registered(path: Path) -> dict[tuple[str, str], float]:
    """Return the registered values by data set and name of the condition; none if there is no table.

    Raises
    ------
    InvalidInput
        If a value is not a number.
    """
    if not path.is_file():
        return {}
    with io.StringIO(read_file(path).decode("utf-8"), newline="") as lines:
        return {
            (row["data"], row["name"]): number(row["value"], f"{path.name}, {row['data']}, {row['name']}")
            for row in csv.DictReader(lines)
        }


def read_baselines(path: Path) -> dict[str, Baseline]:
    """Return the baselines by class of measure."""
    found = {}
    for name, content in read_mapping(path).items():
        where = f"{path.name}, {name}"
        plain = {
            "name" if key == "baseline" else key: value for key, value in mapping(content, where).items()
        }
        better = {"better": lambda value, where: BETTER[require_choice(where, value, list(BETTER))]}
        made = found[name] = record(Baseline, plain, where, readers=better, measures=name)
        if bool(made.name) != bool(made.replace or made.value is not None):
            raise InvalidInput(
                "a baseline has its name and its words or its value", where, code="incomplete_baseline"
            )
    return found


def _check_explanations(claim: Claim, known: set[str], where: str) -> None:
    """Refuse names that nothing has."""
    for data_name, explanation in claim.explanations:
        where_why = f"{where}, why {data_name}"
        asked = [(of_run(name) or ("", name))[1] for name in placeholders(explanation.text)]
        for name in (*asked, *explanation.beside):
            if name and name != "value" and name not in known:
                raise InvalidInput(
                    f"no claim and no quantity {name!r}", where_why, code="unknown_claim", name=name
                )


def _paper(
    key: str,
    content: Mapping[str, Any],
    all_claims: Mapping[str, Any],
    runs: Runs,
    baselines: Mapping[str, Baseline],
    registered: Mapping[tuple[str, str], float],
) -> Paper:
    file, plain = f"{key}.yaml", dict(content)
    plain.setdefault("order", plain.get("year"))
    plain.setdefault("subject", key)
    clips = require_choice(f"{file}, clips", plain.pop("clips", ""), list(LEAST_PEOPLE))
    own = {"people": LEAST_PEOPLE[clips], "sample": whole(plain.pop("sample", 0), f"{file}, sample")}
    rests_on = mapping(plain.pop("rests_on", {}), f"{file}, rests_on")

    def claims(value: Any, where: str) -> tuple[Claim, ...]:
        return tuple(
            claim_entry(key, name, all_claims, own, runs, baselines, registered)
            for name in mapping(value, where)
        )

    def quantities(value: Any, where: str) -> tuple[Quantity, ...]:
        items = mapping(value, where).items()
        return tuple(quantity_entry(key, name, body, f"{file}, {name}") for name, body in items)

    def equations(value: list[Any], where: str) -> tuple[Equation, ...]:
        return tuple(_equation(key, one, file) for one in value)

    readers = {
        "equations": equations,
        "unnumbered": equations,
        "claims": claims,
        "quantities": quantities,
        "page": lambda value, where: record(Page, value, where),
    }
    paper = record(Paper, plain, file, readers=readers, key=key)
    figures = (*paper.figures, *paper.beyond)
    if paper.page.figure:
        require_choice(f"{file}, page, figure", paper.page.figure, figures)
    for item in paper.measured:
        if not item.name.startswith(tuple(f"{name}_" for name in (key, *figures))):
            raise InvalidInput(
                f"the name does not begin with {key}_ or a figure's name",
                f"{file}, {item.name}",
                code="wrong_prefix",
            )
        if item.figure:
            require_choice(f"{file}, {item.name}, figure", item.figure, figures)
    conditions = {claim.name for claim in paper.claims if claim.kind is Kind.CONDITION}
    for figure, named in rests_on.items():
        require_choice(f"{file}, rests_on, figure", figure, figures)
        for condition in set(names(named, f"{file}, rests_on, {figure}")) - conditions:
            raise InvalidInput(
                f"no claim {condition!r} is a condition",
                f"{file}, rests_on",
                code="not_a_condition",
                name=condition,
            )
    resting = [
        claim
        if claim.name in conditions
        else replace(claim, scope=replace(claim.scope, rests_on=tuple(rests_on.get(claim.figure, ()))))
        for claim in paper.claims
    ]
    return replace(paper, claims=tuple(resting))


def _equation(key: str, content: Any, file: str) -> Equation:
    plain = mapping(content, f"{file}, equations")
    where = f"{file}, equation {plain.get('number')}"
    readers = {
        "printed": lambda value, where: f"pipeline.{text(value, where)}",
        "used": lambda value, where: "" if value is None else f"pipeline.{text(value, where)}",
        "test": lambda value, where: f"tests/{text(value, where)}",
    }
    equation = record(Equation, plain, where, readers=readers, paper=key)
    if not (equation.used or equation.note):
        raise InvalidInput("nothing uses it, and no note says why", where, code="unexplained_equation")
    return equation
