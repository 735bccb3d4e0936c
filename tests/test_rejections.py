"""Tests that every `InvalidInput` of the package has a code."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from pipeline.validation import InvalidInput

ROOT = Path(__file__).parents[1]
CODED = ("pipeline", "walk3d")


@pytest.mark.parametrize("part", CODED)
def test_every_rejection_has_a_code(part: str) -> None:
    rejections: dict[str, set[str | None]] = {}
    for file in sorted((ROOT / part).rglob("*.py")):
        calls = [node for node in ast.walk(ast.parse(file.read_text("utf-8"))) if isinstance(node, ast.Call)]
        sentences = [argument for call in calls if ast.unparse(call.func) == "str" for argument in call.args]
        rejections |= {
            f"{file}:{call.lineno}": {keyword.arg for keyword in call.keywords}
            for call in calls
            if ast.unparse(call.func) in ("InvalidInput", "_invalid", "damaged") and call not in sentences
        }
    assert rejections
    assert not [at for at, names in rejections.items() if not names & {"code", None}]


def test_a_long_name_is_shortened_and_a_path_is_whole() -> None:
    path = Path("/home") / "/".join(["person", "recordings"] * 14) / "walk.c3d"
    assert str(InvalidInput("the file is truncated", path)) == f"{path}: the file is truncated"
    name = "left" * 500
    sentence = str(InvalidInput(f"two columns have the name {name!r}", "a.csv"))
    assert sentence == f"a.csv: two columns have the name '{name[:59]}…{name[-59:]}'"
