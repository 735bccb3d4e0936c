"""What the README tells people to do works as it stands there."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from pipeline.__main__ import compose, presets
from pipeline.studies.options import Config

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("example", "expected", "within"), [(0, 30.0, 5.0), (1, 0.27, 0.1), (2, 0.5, 0.5)], ids=str
)
def test_the_library_examples_do_what_they_say(
    capsys: pytest.CaptureFixture[str], example: int, expected: float, within: float
) -> None:
    codes = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert len(codes) == 3
    exec(compile(codes[example], "README.md", "exec"), {})
    said = capsys.readouterr().out
    assert abs(float(said.split()[-1]) - expected) <= within
    assert "red" not in said


def test_every_make_target_named_exists() -> None:
    named = set(re.findall(r"`?(?:^|[`\s])make ([a-z][a-z0-9_]*)", README, re.MULTILINE))
    targets = set(re.findall(r"^([a-z]+):", MAKEFILE, re.MULTILINE)) | set(presets())
    assert {"sweeps", "test", "data"} <= named
    assert named <= targets, named - targets


def test_every_override_named_composes() -> None:
    for line in re.findall(r"^make run ARGS=\"([^\"]+)\"", README, re.MULTILINE):
        words = [w for w in line.split() if "=" in w and not w.startswith("hydra/")]
        plain = [re.sub(r"=(\w+),.*", r"=\1", w.replace("'", "")) for w in words]
        assert compose(plain).figure in presets(), line


@pytest.mark.parametrize("option", sorted(set(re.findall(r"`((?:sweep|model|dataset)\.\w+)`", README))))
def test_every_option_of_the_table_exists(option: str) -> None:
    group, name = option.split(".")
    assert any(hasattr(getattr(chosen, group), name) for chosen in composed())


@cache
def composed() -> list[Config]:
    """Every preset as it stands."""
    return [compose([f"experiment={figure}"]) for figure in presets()]


def test_every_preset_is_listed() -> None:
    for figure in presets():
        assert figure in README
