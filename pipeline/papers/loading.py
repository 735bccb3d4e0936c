"""Reading and validating the papers' data files, ``conf/paper/<key>.yaml``.

An error is refused with the file and the claim or equation: a key that is unknown, missing or repeated, a value of the
wrong type, contradictory bounds, a placeholder without a number, a cause that nothing tested.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipeline.papers import criteria
from pipeline.papers.claims import LEAST_PEOPLE, Baseline, Claim, Kind, Quantity
from pipeline.papers.entries import Entry, number, read_mapping
from pipeline.papers.explanations import (
    CAUSAL,
    Explanation,
    Run,
    Support,
    of_run,
    placeholders,
    read_runs,
    typed_numbers,
)
from pipeline.validation import InvalidInput, require_choice

Runs = Mapping[tuple[str, str, str], Run]
"""Runs by data set, group and switch."""


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

    figure: str
    question: str
    sentences: tuple[str, ...]


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
    beyond: tuple[str, ...]
    equations: tuple[Equation, ...]
    unnumbered: tuple[Equation, ...]
    claims: tuple[Claim, ...]
    quantities: tuple[Quantity, ...]
    order: int
    subject: str
    page: Page

    @property
    def measured(self) -> tuple[Claim | Quantity, ...]:
        """Claims and quantities."""
        return (*self.claims, *self.quantities)


INTERVENTIONS = "interventions.csv"
"""Numbers of runs with a switch, which explanations quote."""

BETTER = {"": 0, "more": 1, "less": -1}

BASELINES = "baselines.yaml"
"""The baseline of each class of measures; no claim chooses its own."""


def load(folder: Path) -> dict[str, Paper]:
    """Return the papers of a folder by key, oldest first.

    Raises
    ------
    InvalidInput
        If a file cannot be read or is invalid; the sentence names file and entry.
    """
    files = [path for path in sorted(folder.glob("*.yaml")) if path.name != BASELINES]
    raw = {path.stem: Entry(path.name, read_mapping(path)) for path in files}
    baselines = read_baselines(folder / BASELINES)
    claims = {name: body for paper in raw.values() for name, body in paper.mapping("claims").items()}
    runs = read_runs(folder / INTERVENTIONS)
    papers = [_paper(key, entry, claims, runs, baselines) for key, entry in raw.items()]
    names = Counter(item.name for paper in papers for item in paper.measured)
    for paper in papers:
        for item in paper.measured:
            where = f"{paper.key}.yaml, {item.name}"
            if names[item.name] > 1:
                raise InvalidInput("the name is there twice", where=where)
            if isinstance(item, Claim):
                if item.same_as and item.same_as not in names:
                    raise InvalidInput(f"no claim {item.same_as!r}", where=where)
                _check_explanations(item, set(names), where)
    return {paper.key: paper for paper in sorted(papers, key=lambda paper: (paper.year, paper.key))}


def read_baselines(path: Path) -> dict[str, Baseline]:
    """Return the baselines by class of measure."""
    found = {}
    for name, content in read_mapping(path).items():
        entry = Entry(f"{path.name}, {name}", content)
        value = entry.take("value", (int, float, str, type(None)), needed=False)
        found[name] = Baseline(
            measures=name,
            reason=entry.text("reason"),
            name=entry.text("baseline", needed=False),
            knows=entry.text("knows", needed=False),
            replace={str(old): str(new) for old, new in entry.mapping("replace").items()},
            value=None if value is None else number(value, entry.where),
            better=BETTER[
                require_choice(f"{entry.where}, better", entry.text("better", needed=False), list(BETTER))
            ],
        )
        entry.done()
        if bool(found[name].name) != bool(found[name].replace or value is not None):
            raise InvalidInput("a baseline has its name and its words or its value", where=entry.where)
    return found


def _check_explanations(claim: Claim, known: set[str], where: str) -> None:
    """Refuse names that nothing has, and typed numbers that are neither the paper's nor of the criterion."""
    for data_name, explanation in claim.why.items():
        where_why = f"{where}, why {data_name}"
        asked = [(of_run(name) or ("", name))[1] for name in placeholders(explanation.text)]
        for name in (*asked, *explanation.beside):
            if name and name != "value" and name not in known:
                raise InvalidInput(f"no claim and no quantity {name!r}", where=where_why)
        said = " ".join(map(str, (claim.quote, claim.how, claim.measure, claim.agrees, claim.close)))
        said += " ".join(explanation.run.overrides) if explanation.run else ""
        for typed in typed_numbers(explanation.text):
            if typed not in typed_numbers(said.replace("{", "").replace("}", "")):
                raise InvalidInput(
                    f"the number {typed} is typed",
                    where=where_why,
                    expected="a placeholder, or a number of the quotation, the measure, the bounds or the run",
                )


def _paper(
    key: str, entry: Entry, all_claims: Mapping[str, Any], runs: Runs, baselines: Mapping[str, Baseline]
) -> Paper:
    equations = [_equation(key, item, entry.where) for item in entry.take("equations", list)]
    unnumbered = [
        _equation(key, item, entry.where) for item in entry.take("unnumbered", list, [], needed=False)
    ]
    year = entry.take("year", int)
    clips = require_choice(f"{entry.where}, clips", entry.text("clips"), list(LEAST_PEOPLE))
    of_paper = LEAST_PEOPLE[clips], entry.take("sample", int, 0, needed=False)
    figures = Entry(f"{entry.where}, rests_on", entry.mapping("rests_on"))
    rests_on = {figure: figures.names(figure) for figure in figures.content}
    claims = [
        _claim(key, name, all_claims, entry.where, of_paper, runs, baselines)
        for name in entry.mapping("claims")
    ]
    quantities = [
        _quantity(key, name, body, entry.where) for name, body in entry.mapping("quantities").items()
    ]
    conditions = {claim.name for claim in claims if claim.kind is Kind.CONDITION}
    for figure, named in rests_on.items():
        require_choice(f"{figures.where}, figure", figure, entry.names("figures"))
        for condition in set(named) - conditions:
            raise InvalidInput(f"no claim {condition!r} is a condition", where=figures.where)
    claims = [
        claim if claim.kind is Kind.CONDITION else replace(claim, rests_on=rests_on.get(claim.figure, ()))
        for claim in claims
    ]
    paper = Paper(
        key=key,
        title=entry.text("title"),
        authors=entry.text("authors"),
        year=year,
        venue=entry.text("venue"),
        figures=entry.names("figures"),
        beyond=entry.names("beyond", needed=False),
        equations=tuple(equations),
        unnumbered=tuple(unnumbered),
        claims=tuple(claims),
        quantities=tuple(quantities),
        order=entry.take("order", int, year, needed=False),
        subject=entry.text("subject", needed=False) or key,
        page=_page(Entry(f"{entry.where}, page", entry.mapping("page"))),
    )
    entry.done()
    if paper.page.figure:
        require_choice(f"{entry.where}, page, figure", paper.page.figure, (*paper.figures, *paper.beyond))
    for item in paper.measured:
        where = f"{entry.where}, {item.name}"
        if not item.name.startswith(f"{key}_"):
            raise InvalidInput(f"the name does not begin with {key}_", where=where)
        if item.figure:
            require_choice(f"{where}, figure", item.figure, (*paper.figures, *paper.beyond))
    return paper


def _page(entry: Entry) -> Page:
    page = Page(
        entry.text("figure", needed=False),
        entry.text("question", needed=False),
        entry.names("sentences", needed=False),
    )
    entry.done()
    return page


def _equation(key: str, content: Any, file: str) -> Equation:
    entry = Entry(f"{file}, equations", content)
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


def _claim(
    key: str,
    name: str,
    all_claims: Mapping[str, Any],
    file: str,
    of_paper: tuple[int, int],
    runs: Runs,
    baselines: Mapping[str, Baseline],
) -> Claim:
    entry = Entry(f"{file}, {name}", _like(name, all_claims, f"{file}, {name}"))
    published = entry.take("published", (int, float, type(None)), needed=False)
    figure = entry.text("figure", needed=False)
    untestable = entry.text("untestable", needed=False)
    judged = not untestable
    bounds = Entry(f"{entry.where}, bounds", entry.take("bounds", dict, {}, needed=judged))
    agrees, close, reason = (
        bounds.take("agrees", dict, needed=judged),
        bounds.take("close", dict, needed=False),
        bounds.text("reason", needed=judged),
    )
    bounds.done()
    measure = entry.take("measure", dict, needed=judged)
    kind = Kind(require_choice(f"{entry.where}, kind", entry.text("kind"), list(Kind)))
    compared = judged and kind is not Kind.CONDITION
    measures = entry.text("class", needed=compared)
    if compared:
        require_choice(f"{entry.where}, class", measures, list(baselines))
    least, sample = of_paper
    claim = Claim(
        name=name,
        paper=key,
        section=entry.text("section"),
        kind=kind,
        quote=entry.text("quote"),
        published=None if published is None else float(published),
        unit=entry.text("unit", needed=False),
        figure=figure,
        how=entry.text("how", needed=judged),
        measure=criteria.measure(measure, figure, f"{entry.where}, measure") if measure else None,
        help=entry.text("help", needed=False),
        baseline=baselines[measures] if compared else None,
        same_as=entry.text("same_as", needed=False),
        assumed={data_name: str(text) for data_name, text in entry.mapping("assumed").items()},
        only=entry.names("only", needed=False),
        people=max(least, entry.take("people", int, least, needed=False)),
        sample=entry.take("sample", int, sample, needed=False),
        agrees=criteria.interval(agrees, published, bounds.where) if agrees else None,
        close=criteria.interval(close, published, bounds.where) if close else None,
        reason=reason,
        why={
            data_name: _explanation(why, f"{entry.where}, why {data_name}", runs)
            for data_name, why in entry.mapping("why").items()
        },
        untestable=untestable,
        written=entry.text("written", needed=False),
    )
    entry.done()
    if untestable and (figure or measure or agrees):
        raise InvalidInput("has a figure, a measure or bounds although it is untestable", where=entry.where)
    if judged and not figure:
        raise InvalidInput("no 'figure'", where=entry.where)
    criteria.check_bounds(claim, bounds.where)
    if claim.baseline and claim.baseline.replace and claim.of_baseline is None:
        raise InvalidInput(
            f"its measure names nothing that the baseline of {measures!r} replaces", where=entry.where
        )
    return claim


def _explanation(content: Any, where: str, runs: Runs) -> Explanation:
    """Return an explanation from one text, named by what supports it, and the run or the names that do."""
    entry = Entry(where, content)
    texts = {support: entry.text(support, needed=False) for support in Support}
    run, beside = entry.take("run", dict, {}, needed=False), entry.names("beside", needed=False)
    entry.done()
    given = [support for support, text in texts.items() if text]
    if len(given) != 1:
        raise InvalidInput(
            "must have one text",
            where=where,
            expected=" or ".join(Support),
            received=", ".join(given) or "none",
        )
    support, text = given[0], texts[given[0]]
    if (support is Support.TESTED) != bool(run or beside) or (run and beside):
        raise InvalidInput("what is tested needs its run, or what is measured beside it", where=where)
    if support is Support.SHOWN and (word := CAUSAL.search(text)):
        raise InvalidInput(
            f"{word[0]!r} names a cause",
            where=where,
            expected="an explanation that is tested, or says untested",
        )
    if not run and any(of_run(name) for name in placeholders(text)):
        raise InvalidInput("quotes a run, and names none", where=where)
    return Explanation(support=support, text=text, run=_run(run, where, runs) if run else None, beside=beside)


def _run(content: Mapping[str, Any], where: str, runs: Runs) -> Run:
    entry = Entry(f"{where}, run", content)
    key = (entry.text("data"), entry.text("group"), entry.text("switch"))
    entry.done()
    return runs.get(key) or Run(*key)


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
    entry = Entry(f"{file}, {name}", content)
    figure = entry.text("figure")
    quantity = Quantity(
        name=name,
        paper=key,
        figure=figure,
        how=entry.text("how"),
        measure=criteria.measure(entry.take("measure", dict), figure, entry.where),
        unit=entry.text("unit", needed=False),
    )
    entry.done()
    return quantity
