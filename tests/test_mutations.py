"""Tests of the mutation generator: the mutants of a function, code without mutants, and the nearest tests."""

from __future__ import annotations

import ast
from collections import Counter
from itertools import islice
from pathlib import Path

import pytest

from tests.mutants import read, summary, write
from tests.mutations import ROOT, draw, mutants_of
from tests.nearest_tests import NearestTests


def changed(body: str, parameters: str = "a, b") -> set[str]:
    """Return the bodies of all mutants of a one-line function."""
    source = f"def f({parameters}):\n    {body}\n"
    [mutants] = list(mutants_of("pipeline/x.py", source)) or [[]]
    return {ast.unparse(ast.parse(mutant.apply(source)).body[0].body[0]) for mutant in mutants}


@pytest.mark.parametrize(
    ("body", "bodies"),
    [
        ("return a + b", {"return a - b", "return a"}),
        ("return a / b", {"return a", "return b", "return b / a"}),
        ("return a < b", {"return a <= b", "return a > b"}),
        ("return a is None", {"return a is not None"}),
        ("return not a", {"return bool(a)"}),
        ("return a and b", {"return a or b", "return a", "return b"}),
        ("return -a", {"return a"}),
        ("return a[:b]", {"return a[:b + 1]", "return a[:b - 1]"}),
        ("return a[7]", {"return a[8]", "return a[6]"}),
        ("return 0.25", {"return 0.5"}),
        ("return True", {"return False"}),
        ("a -= b", {"a += b"}),
        ("return a.sum(axis=b)", set()),
        ("return a.sum(axis=-1)", {"return a.sum(axis=0)", "return a.sum(axis=1)", "return a.sum(axis=-2)",
                                   "return a.sum(axis=-0)"}),
        ("return a.T", {"return a"}),
        ("return f(a, b)", {"return f(b, a)"}),
        ("return max(a, b)", set()),
        ("return a['left_hip']", {"return a['right_hip']"}),
        ("return a.left", {"return a.right"}),
        ("return f'{a + b} mm'", set()),
        ("return 'a' + b", set()),
        ("raise InvalidInput(a + b)", set()),
        ("'a text about left'", set()),
        ("x: a + b", set()),
    ],
)  # fmt: skip
def test_a_function_has_these_changes(body: str, bodies: set[str]) -> None:
    assert changed(body) == bodies


def test_a_default_is_changed_and_an_annotation_is_not() -> None:
    source = "def f(a: 'left' = 3) -> 'right':\n    return a\n"
    [mutants] = mutants_of("pipeline/x.py", source)
    assert {mutant.after for mutant in mutants} == {"2", "4"}


@pytest.mark.thorough
def test_mutants_are_drawn_by_the_seed_and_compile() -> None:
    drawn = list(draw("1"))
    assert drawn[:9] == list(islice(draw("1"), 9)) != list(islice(draw("2"), 9))
    assert len({mutant.function for mutant in drawn}) == len(drawn) > 2000
    for mutant in drawn[:200]:
        source = (ROOT / mutant.file).read_text(encoding="utf-8")
        assert ast.dump(ast.parse(mutant.apply(source))) != ast.dump(ast.parse(source))
    share = Counter(mutant.file.split("/")[1] for mutant in drawn)["core"] / len(drawn)
    assert abs(Counter(mutant.file.split("/")[1] for mutant in drawn[:100])["core"] - 100 * share) <= 1


@pytest.mark.thorough
def test_the_nearest_tests_are_those_that_call_the_function() -> None:
    tests = NearestTests()
    [doctests, first, *others] = tests.nearest("pipeline.core.newton.minimise", files=3)
    assert doctests == "pipeline/core/newton.py"
    assert first.startswith("tests/core/test_newton.py::")
    assert len({name.partition("::")[0] for name in others}) == 3
    assert tests.nearest("pipeline.storage.tables.read", files=1)[1].startswith(
        "tests/storage/test_tables.py"
    )
    assert not any("golden" in name for name in others)


def test_results_are_kept_and_counted(tmp_path: Path) -> None:
    row = dict.fromkeys(("file", "line", "operator", "before", "after", "seconds"), "1")
    rows = [
        row | {"package": "pipeline/core", "function": "f", "noticed_by": "tests/a.py::test_b"},
        row | {"package": "pipeline/core", "function": "g", "noticed_by": ""},
    ]
    write(tmp_path / "1.csv", rows)
    assert list(read(tmp_path / "1.csv").values()) == rows
    assert summary(rows).splitlines()[-1].split() == ["all", "2", "1", "50%"]
