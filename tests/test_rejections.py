"""Codes of rejections: every InvalidInput that the package raises has one."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CODED = (
    "pipeline/core",
    "pipeline/synthetic",
    "pipeline/studies",
    "pipeline/papers",
    "pipeline/stages",
    "pipeline/plugins.py",
    "pipeline/validation.py",
    "walk3d",
)


@pytest.mark.parametrize("part", CODED)
def test_every_rejection_has_a_code(part: str) -> None:
    path = ROOT / part
    rejections = {
        f"{file}:{call.lineno}": {keyword.arg for keyword in call.keywords}
        for file in ([path] if path.is_file() else sorted(path.rglob("*.py")))
        for call in ast.walk(ast.parse(file.read_text("utf-8")))
        if isinstance(call, ast.Call) and ast.unparse(call.func) in ("InvalidInput", "_invalid")
    }
    assert rejections
    assert not [at for at, names in rejections.items() if not names & {"code", None}]
