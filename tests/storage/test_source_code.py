"""Tests that a cached result depends on the source code that computes it, and on no other code."""

from __future__ import annotations

import ast
from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline import plugins
from pipeline.storage import source_code
from pipeline.storage.source_code import sources_digest

FILES = {
    "__init__.py": '"""The package."""\n',
    "core/__init__.py": '"""Mathematics."""\n',
    "core/camera.py": '"""Cameras."""\n\nSCALE = 1\n"""Of an image."""\n',
    "core/unused.py": "VALUE = 1\n",
    "studies/__init__.py": "",
    "studies/walks.py": '''"""Walks."""
from pipeline.core import camera


def measure():
    """Return something."""
    from pipeline.late import VALUE  # inside a function

    return camera.SCALE + VALUE
''',
    "late.py": "VALUE = 2\n",
    "cli.py": "from pipeline.studies import walks\n",
}


@pytest.fixture
def edited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str, str, str], str]:
    """Function ``edited(file, old, new)`` that returns the digest of studies.walks after a change in a file."""
    monkeypatch.setattr(plugins, "PACKAGE", tmp_path / "pipeline")
    source_code._module.cache_clear()
    for name, text in FILES.items():
        path = tmp_path / "pipeline" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def edited(name: str, old: str, new: str) -> str:
        path = tmp_path / "pipeline" / name
        assert old in path.read_text(encoding="utf-8")
        path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
        source_code._module.cache_clear()
        return sources_digest(["pipeline.studies.walks"])

    yield edited
    source_code._module.cache_clear()


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("core/unused.py", "1", "2"),
        ("cli.py", "walks", "walks  # a remark"),
        ("core/camera.py", "Cameras.", "Cameras, in other words."),
        ("core/camera.py", "Of an image.", "Of a picture."),
        ("studies/walks.py", "Return something.", "Return the sum."),
        ("studies/walks.py", "# inside a function", "# late"),
        ("core/__init__.py", '"""Mathematics."""', "from pipeline.core import unused"),
    ],
)
def test_what_the_study_does_not_compute_with_leaves_the_digest(
    edited: Callable[[str, str, str], str], name: str, old: str, new: str
) -> None:
    before = sources_digest(["pipeline.studies.walks"])
    assert edited(name, old, new) == before


def test_relative_imports_are_followed(edited: Callable[[str, str, str], str], tmp_path: Path) -> None:
    before = edited("studies/walks.py", "from pipeline.core import camera", "from ..core import camera")
    assert edited("core/camera.py", "SCALE = 1", "SCALE = 2") != before


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("core/camera.py", "SCALE = 1", "SCALE = 2"),
        ("late.py", "2", "3"),
        ("studies/walks.py", "+ VALUE", "- VALUE"),
    ],
)
def test_what_it_computes_with_changes_it(
    edited: Callable[[str, str, str], str], name: str, old: str, new: str
) -> None:
    before = sources_digest(["pipeline.studies.walks"])
    assert edited(name, old, new) != before


def test_a_word_in_the_command_line_and_another_study_leave_walks_alone() -> None:
    """The model of walks does not depend on the sources of the command line or of another study."""
    reached = source_code.reached(["pipeline.studies.eigenwalkers.model"])
    assert "pipeline.core.linear_model" in reached
    foreign = (
        "pipeline.cli.",
        "pipeline.stages",
        "pipeline.studies.limbs",
        "pipeline.pictures",
        "pipeline.papers",
    )
    assert [name for name in sorted(reached) if name.startswith(foreign)] == []


@pytest.mark.parametrize(
    ("line", "is_text"), [("'words'", True), ("3", False), ("...", False), ("f()", False)]
)
def test_only_a_statement_of_text_is_text(line: str, is_text: bool) -> None:
    assert source_code._is_text(ast.parse(line).body[0]) is is_text
