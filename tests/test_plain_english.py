"""Tests that sources and documentation break no more rules of plain English than their allowances permit."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import plain_english
from tests.plain_english import ALLOWANCES, RULES, Violation, length, paragraphs, sentences

STRICT = (
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "data",
    "docs",
    "results",
    "tutorial.py",
    "gait_pipeline",
)
"""Packages and pages in which no rule may be broken."""


@pytest.mark.parametrize("name", sorted(plain_english.violations()))
def test_a_package_breaks_no_more_rules_than_it_may(name: str) -> None:
    """Each package breaks each rule at most as often as its allowance permits.

    ``python -m tests.plain_english FOLDER`` prints the passages.  Rewrite them: the allowance does not rise.
    """
    allowed = plain_english.allowances()
    for rule in RULES:
        broken = [violation for violation in plain_english.violations()[name] if violation.rule == rule]
        listed = "\n".join(f"{violation.where}: {violation.text}" for violation in broken)
        assert len(broken) <= allowed.get((name, rule), 0), f"{rule}:\n{listed}"


def test_documentation_has_no_allowance() -> None:
    assert not {name for name, _ in plain_english.allowances()} & set(STRICT)
    assert {name for name in STRICT if name != "gait_pipeline"} <= set(plain_english.violations())


def test_each_allowance_is_of_a_package_that_exists() -> None:
    assert {name for name, _ in plain_english.allowances()} <= set(plain_english.violations())


def test_each_exception_is_a_file_that_breaks_a_rule_and_has_a_reason() -> None:
    for name, reason in plain_english.EXCEPTIONS.items():
        assert reason
        assert plain_english.judge_source(plain_english.ROOT / name), name


def judged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, text: str) -> list[Violation]:
    """Return the broken rules in a file with this text."""
    monkeypatch.setattr(plain_english, "ROOT", tmp_path)
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return (plain_english.judge_page if path.suffix == ".md" else plain_english.judge_source)(path)


LONG = " ".join(["word"] * 31)


@pytest.mark.parametrize(
    ("name", "text", "rules"),
    [
        ("a.md", "The file is told to nobody.", ["words", "words"]),
        ("a.md", f"{LONG}.", ["sentences"]),
        ("a.md", f"Short.\n\n- item\n- {LONG}", ["sentences"]),
        ("a.md", "Bars (of one kind) cover the truth (of the other).", ["brackets"]),
        ("a.md", f"Short. ({LONG})", ["sentences"]),
        ("a.py", '"""Of the truth."""', ["first_words"]),
        ("a.py", 'RATE = 1\n"""What a second has."""', ["first_words"]),
        ("a.py", f'"""Return {LONG}.\n\nNotes."""', ["sentences"]),
        ("a.py", "found = [one for one in ()]", ["names", "names"]),
        ("a.py", f'raise InvalidInput("a", expected="{"e" * 300}", code="c")', ["messages"]),
        ("a.py", f'tell(f"{"t" * 295}{{number}}")', ["messages"]),
    ],
)
def test_a_broken_rule_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, text: str, rules: list[str]
) -> None:
    assert [violation.rule for violation in judged(tmp_path, monkeypatch, name, text)] == rules


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.md", f"Number of harmonics.\n\n```\n{LONG}\n```\n\n| {LONG} |\n|---|\n\n# {LONG}"),
        ("a.md", f"Options (`a`) and files (`b`). Word {' '.join(['word'] * 29)}."),
        ("a.py", '"""Number of harmonics of the ground truth.\n\nSo is a later paragraph."""'),
        (
            "a.py",
            f'estimate = f("{"x" * 400}")\nraise InvalidInput("the file is truncated", where="a.c3d", code="cut")',
        ),
    ],
)
def test_plain_text_passes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, text: str) -> None:
    assert judged(tmp_path, monkeypatch, name, text) == []


def test_prose_is_split_into_paragraphs_items_and_sentences() -> None:
    text = "First line\nsecond line. Next one, e.g. this.\n\n1. item\n   goes on\n2. [link](a.md#b) `x y z`"
    assert [prose for _, prose in paragraphs(text)] == [
        "First line second line. Next one, e.g. this.", "item goes on", "[link](a.md#b) `x y z`",
    ]  # fmt: skip
    assert sentences("First line. Next one, e.g. this. `code` ends it.") == [
        "First line.", "Next one, e.g this.", "code ends it.",
    ]  # fmt: skip
    assert length("A mean of 3.5 mm (of 12 people)") == 6


def test_allowances_shrink_and_never_rise(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table = tmp_path / ALLOWANCES.name
    head = ",".join(["package", *RULES])
    zeros = ",".join("0" for _ in RULES[1:])
    table.write_text(f"{head}\na,5,{zeros}\nb,1,{zeros}\n", encoding="utf-8")
    monkeypatch.setattr(plain_english, "ALLOWANCES", table)
    monkeypatch.setattr(
        plain_english, "counts", lambda: {("a", "words"): 3, ("b", "words"): 2, ("c", "words"): 9}
    )
    plain_english.lower()
    assert plain_english.allowances()["a", "words"] == 3
    assert plain_english.allowances()["b", "words"] == 1
    assert ("c", "words") not in plain_english.allowances()
