"""Reader of the papers' data files, ``conf/paper/<key>.yaml``.

Errors raise InvalidInput with the file and the claim or equation.  Examples are unknown, missing or repeated keys,
values of the wrong type, contradictory bounds, and placeholders without a number.
"""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
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
    """Numbered equation of a paper, and the names of the functions that compute it.

    Attributes
    ----------
    paper, number : str
        Key of the paper and number, such as ``"zhang2007"`` and ``"3.15"``: together the tag in the source.
    words : str
        The equation in one line.
    printed : str
        Dotted name of the function that computes the printed form, the reference of the tests.
    used : str
        Dotted name of the function that the results use; empty if the results do not need the equation.
    test : str
        File of the tests of the equation.
    note : str
        Misprints or ambiguities, with our reading; empty without them.
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
    """Introduction of a paper on its page of the report.

    Attributes
    ----------
    figure : str
        Preset of the figure that represents the paper.
    question : str
        Question that the paper answers.
    sentences : tuple of str
        Sentences with placeholders for our numbers, by the names of claims.
    agrees : mapping of str to str
        Sentences with our number and its baseline's, by the name of the claim whose verdict they have.
    """

    figure: str = ""
    question: str = ""
    sentences: tuple[str, ...] = ()
    agrees: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Paper:
    """Paper with its figures, equations, claims and quantities.

    Attributes
    ----------
    key, title, authors, venue : str
    year : int
    figures, beyond : tuple of str
        Presets of the paper's figures; our presets that go beyond the paper.
    equations : tuple of Equation
    unnumbered : tuple of Equation
        Formulas that the paper prints without a number, in printed order.  Their "number" is their left-hand side.
    claims : tuple of Claim
    quantities : tuple of Quantity
    order : int
        Position of the paper when all figures are made; by default the year.
    subject : str
        Subject; the figures of papers on one subject are made together.
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
        """All claims and quantities of the paper."""
        return (*self.claims, *self.quantities)


INTERVENTIONS = "interventions.csv"
"""Name of the table with the values from sensitivity runs, which explanations quote."""

REGISTERED = "registered.csv"
"""Name of the table of registered values, with which the values of conditions are compared, by data set."""

BETTER = {"": 0, "more": 1, "less": -1}

OWN_YEAR = 9999
"""Publication year that is assigned to claims of users, so that they are sorted after all papers."""

BASELINES = "baselines.yaml"
"""Name of the file with the baseline of each class of measures."""


def load(folders: Sequence[Path], added: Mapping[str, Mapping[str, Any]] | None = None) -> dict[str, Paper]:
    """Load the papers from YAML files in given folders; return them by key, sorted by year.

    Parameters
    ----------
    folders : sequence of Path
        Folders with some or all of: files of papers, ``baselines.yaml``, ``interventions.csv``.
    added : mapping, optional
        Contents of further files by key; omitted keys default to those of a user's claims on walks.

    Raises
    ------
    InvalidInput
        If a file cannot be read or is invalid; the message names the file and the entry.
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
                raise InvalidInput("two claims or quantities have this name", where, code="duplicate_name")
            if isinstance(item, Claim):
                if shorts[paper.key, item.text.short] > 1:
                    raise InvalidInput(
                        f"another claim has the short name {item.text.short!r}",
                        where,
                        code="duplicate_name",
                    )
                if item.same_as and item.same_as not in names:
                    raise InvalidInput(
                        f"the key 'same_as' names an unknown claim: {item.same_as!r}",
                        where,
                        code="unknown_claim",
                        name=item.same_as,
                    )
                _check_explanations(item, set(names), where)
    return {paper.key: paper for paper in sorted(papers, key=lambda paper: (paper.year, paper.key))}


def _completed(key: str, content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a user's YAML file of claims, with defaults for the keys that only papers need."""
    claims = mapping(content.get("claims", {}), f"{key}, claims")
    figures = sorted({str(mapping(body, name).get("figure", "")) for name, body in claims.items()} - {""})
    left_out = {"title": key, "authors": "", "year": OWN_YEAR, "venue": "", "figures": [], "equations": []}
    return {**left_out, "clips": "walks", "beyond": figures, **content}


def read_registered(path: Path) -> dict[tuple[str, str], float]:
    """Read the registered values by data set and name of the condition; return an empty dict without a table.

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
    """Read the baselines from a YAML file; return them by class of measures."""
    baselines = {}
    for name, content in read_mapping(path).items():
        where = f"{path.name}, {name}"
        plain = {
            "name" if key == "baseline" else key: value for key, value in mapping(content, where).items()
        }
        better = {"better": lambda value, where: BETTER[require_choice(where, value, list(BETTER))]}
        baseline = baselines[name] = record(Baseline, plain, where, readers=better, measures=name)
        if bool(baseline.name) != bool(baseline.replace or baseline.value is not None):
            raise InvalidInput(
                "a baseline needs the key 'baseline' together with the key 'replace' or 'value'",
                where,
                code="incomplete_baseline",
            )
    return baselines


def _check_explanations(claim: Claim, all_names: set[str], where: str) -> None:
    """Raise InvalidInput if an explanation names an unknown claim or quantity."""
    for data_name, explanation in claim.explanations:
        where_why = f"{where}, why {data_name}"
        quoted = [(of_run(name) or ("", name))[1] for name in placeholders(explanation.text)]
        for name in (*quoted, *explanation.comparisons):
            if name and name != "value" and name not in all_names:
                raise InvalidInput(
                    f"the explanation names an unknown claim or quantity: {name!r}",
                    where_why,
                    code="unknown_claim",
                    name=name,
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
    sizes = {"people": LEAST_PEOPLE[clips], "sample": whole(plain.pop("sample", 0), f"{file}, sample")}
    rests_on = mapping(plain.pop("rests_on", {}), f"{file}, rests_on")

    def claims(value: Any, where: str) -> tuple[Claim, ...]:
        return tuple(
            claim_entry(key, name, all_claims, sizes, runs, baselines, registered)
            for name in mapping(value, where)
        )

    def quantities(value: Any, where: str) -> tuple[Quantity, ...]:
        items = mapping(value, where).items()
        return tuple(quantity_entry(key, name, body, f"{file}, {name}") for name, body in items)

    def equations(value: list[Any], where: str) -> tuple[Equation, ...]:
        return tuple(_equation(key, entry, file) for entry in value)

    def sentences(value: Any, where: str) -> dict[str, str]:
        return {name: text(sentence, where) for name, sentence in mapping(value, where).items()}

    readers = {
        "equations": equations,
        "unnumbered": equations,
        "claims": claims,
        "quantities": quantities,
        "page": lambda value, where: record(Page, value, where, readers={"agrees": sentences}),
    }
    paper = record(Paper, plain, file, readers=readers, key=key)
    figures = (*paper.figures, *paper.beyond)
    for name in paper.page.agrees:
        require_choice(f"{file}, page, agrees", name, [claim.name for claim in paper.claims])
    if paper.page.figure:
        require_choice(f"{file}, page, figure", paper.page.figure, figures)
    for item in paper.measured:
        if not item.name.startswith(tuple(f"{name}_" for name in (key, *figures))):
            raise InvalidInput(
                f"the name of a claim or quantity must begin with {key}_ or with the name of a figure",
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
                f"{condition!r} is not the name of a claim of kind 'condition'",
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
        raise InvalidInput(
            "the equation needs a function that uses it (key 'used') or a reason why it is not used (key 'note')",
            where,
            code="unexplained_equation",
        )
    return equation
