"""Readers for entries of a paper's YAML file: claims, quantities and explanations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from pipeline.papers import criteria
from pipeline.papers.claims import LONGEST_SHORT, Baseline, Bounds, Claim, Kind, Quantity
from pipeline.papers.entries import mapping, number, record, text, whole
from pipeline.papers.explanations import Explanation, Run, Support, of_run, placeholders
from pipeline.papers.intervals import Interval
from pipeline.validation import InvalidInput, require_choice

Runs = Mapping[tuple[str, str, str], Run]
"""Sensitivity runs by data set, and by group and name of the switch that changes one assumption."""


@dataclass(frozen=True)
class _Limits:
    """Bounds of a claim, as written in a paper's YAML file."""

    agrees: Mapping[str, Any] = field(default_factory=dict)
    close: Mapping[str, Any] = field(default_factory=dict)
    registered: float = 0.0
    reason: str = ""


def claim_entry(
    key: str,
    name: str,
    all_claims: Mapping[str, Any],
    of_paper: Mapping[str, int],
    runs: Runs,
    baselines: Mapping[str, Baseline],
    registered: Mapping[tuple[str, str], float],
) -> Claim:
    """Return one claim of a paper, read from its entry in the paper's YAML file.

    Parameters
    ----------
    key, name : str
        Key of the paper; name of the claim.
    all_claims : mapping
        Entries of all claims by name, since an entry may be ``like`` another one.
    of_paper : mapping of str to int
        Least number of people for a verdict and number of people in the paper.
    runs : mapping
        Runs with a switch, which explanations quote.
    baselines : mapping of str to Baseline
        Baseline of each class of measures.
    registered : mapping of (str, str) to float
        Registered value of a condition, by data set and name.

    Raises
    ------
    InvalidInput
        If the entry is invalid; the message names the file and the claim.
    """
    where = f"{key}.yaml, {name}"
    plain = {**of_paper, **_like(name, all_claims, where)}
    judged = not plain.get("untestable")
    compared = judged and plain.get("kind") != Kind.CONDITION
    measures, bounds = plain.pop("class", ""), plain.pop("bounds", {})
    share = number(bounds.get("registered", 0.0), f"{where}, bounds, registered") / 100.0
    ends = () if share else ("agrees",)
    limits = record(
        _Limits,
        bounds,
        f"{where}, bounds",
        needed=(*ends, "reason") if judged else (),
        readers={"registered": number},
    )
    written = text(plain.pop("written", ""), f"{where}, written")
    figure, published = plain.get("figure", ""), plain.get("published")

    def interval(content: Mapping[str, Any]) -> Interval | None:
        return criteria.interval(content, published, f"{where}, bounds") if content else None

    readers = {
        "people": lambda value, where: max(of_paper["people"], whole(value, where)),
        "measure": lambda value, where: criteria.measure(mapping(value, where), figure, where),
        "why": lambda value, where: {
            data: _explanation(why, f"{where} {data}", runs) for data, why in mapping(value, where).items()
        },
        "sensitivity": lambda value, where: {
            data: tuple(_explanation(why, f"{where} {data}", runs) for why in whys)
            for data, whys in mapping(value, where).items()
        },
        "short": lambda value, where: _short(value, where),
    }
    claim = record(
        Claim,
        plain,
        where,
        needed=("how", "measure", "figure") if judged else (),
        readers=readers,
        parts=("text", "scope"),
        name=name,
        paper=key,
        baseline=baselines.get(measures) if compared else None,
        bounds=Bounds(
            agrees=interval(limits.agrees),
            close=interval(limits.close),
            reason=limits.reason,
            written=written,
            registered=_registered(name, share, registered),
        ),
        rests_on=(),
    )
    if compared and not measures:
        raise InvalidInput("the key 'class' is missing", where, code="missing_key", key="class")
    if compared:
        require_choice(f"{where}, class", measures, list(baselines))
    if claim.baseline and claim.baseline.assumed:
        assumed = {**claim.baseline.assumed, **claim.scope.assumed}
        claim = replace(claim, scope=replace(claim.scope, assumed=assumed))
    if share and (compared or limits.agrees):
        raise InvalidInput(
            "only a claim of kind 'condition' without other bounds may have a registered value",
            f"{where}, bounds",
            code="registered_not_a_condition",
        )
    _require_consistent(claim, where, measures)
    return claim


def _registered(
    name: str, share: float, values: Mapping[tuple[str, str], float]
) -> dict[str, Interval] | None:
    """Return the accepted interval for a condition by data set: a relative tolerance around the registered value.

    Return None if the claim has no such tolerance.
    """
    if not share:
        return None
    entries = {data: value for (data, item), value in values.items() if item == name}
    return {data: Interval(x - share * abs(x), x + share * abs(x)) for data, x in entries.items()}


def _require_consistent(claim: Claim, where: str, measures: str) -> None:
    """Raise InvalidInput if fields of a claim contradict each other; `measures` is the claim's class of measures."""
    if claim.scope.untestable and (claim.figure or claim.measure or claim.bounds.agrees):
        raise InvalidInput(
            "the claim is marked untestable, but has a figure, a measure or bounds",
            where,
            code="untestable_with_measure",
        )
    criteria.check_bounds(claim, f"{where}, bounds")
    if claim.baseline and claim.baseline.replace and claim.of_baseline is None:
        raise InvalidInput(
            f"the baseline of the class {measures!r} replaces no word in the claim's measure",
            where,
            code="baseline_replaces_nothing",
        )


@dataclass(frozen=True)
class _Why:
    """Explanation as written in a paper's YAML file: its text, and the runs or quantities that support it."""

    shown: str = ""
    tested: str = ""
    untested: str = ""
    run: Run | None = None
    beside: tuple[str, ...] = ()


def _explanation(content: Any, where: str, runs: Runs) -> Explanation:
    def run(value: Any, where: str) -> Run:
        named = record(Run, value, where, overrides=(), scale="", without={}, with_it={})
        return runs.get((named.data, named.group, named.switch), named)

    why = record(_Why, content, where, readers={"run": run})
    supports = [support for support in Support if getattr(why, support)]
    if len(supports) != 1:
        raise InvalidInput(
            "the explanation must have exactly one of the keys " + ", ".join(Support),
            where,
            received=", ".join(supports) or "none",
            code="not_one_text",
        )
    support, words = supports[0], str(getattr(why, supports[0]))
    if (support is Support.TESTED) != bool(why.run or why.beside) or (why.run and why.beside):
        raise InvalidInput(
            "only an explanation with the key 'tested' needs evidence: either the key 'run' or the key 'beside'",
            where,
            code="no_support",
        )
    if not why.run and any(of_run(name) for name in placeholders(words)):
        raise InvalidInput(
            "the explanation quotes numbers of a sensitivity run, but has no key 'run'",
            where,
            code="run_not_named",
        )
    return Explanation(support=support, text=words, run=why.run, comparisons=why.beside)


def _short(value: Any, where: str) -> str:
    words = text(value, where)
    if not 0 < len(words) <= LONGEST_SHORT:
        raise InvalidInput(
            "the claim's short name is too long" if words else "the claim's short name is empty",
            where,
            f"1 to {LONGEST_SHORT} characters",
            f"{len(words)}",
            code="wrong_length",
        )
    return words


def _like(name: str, all_claims: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return the entry of a claim; missing keys are taken from the claim that its key ``like`` names."""
    body, trail = mapping(all_claims[name], where), {name}
    while (other := body.pop("like", None)) is not None:
        if other not in all_claims or other in trail:
            raise InvalidInput(
                "the value must be the name of another claim",
                f"{where}, like",
                received=other,
                code="unknown_claim",
                name=other,
            )
        trail.add(other)
        body = {**all_claims[other], **body}
    return body


def quantity_entry(key: str, name: str, content: Any, where: str) -> Quantity:
    """Return a quantity of a paper, read from its YAML entry.

    Raises InvalidInput if the entry is invalid.
    """
    figure = mapping(content, where).get("figure", "")
    reader = {"measure": lambda value, where: criteria.measure(mapping(value, where), figure, where)}
    return record(Quantity, content, where, readers=reader, name=name, paper=key)
