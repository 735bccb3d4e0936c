"""What the README tells people to do works as it stands there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pipeline.__main__ import compose, presets

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")


def test_the_library_example_recovers_the_view(capsys: pytest.CaptureFixture[str]) -> None:
    code = re.search(r"```python\n(.*?)```", README, re.DOTALL)
    assert code is not None
    exec(compile(code[1], "README.md", "exec"), {})
    assert abs(float(capsys.readouterr().out) - 30.0) < 5.0


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
    options = [getattr(compose([f"experiment={figure}"]), group) for figure in presets()]
    assert any(hasattr(chosen, name) for chosen in options)


def test_every_preset_is_listed() -> None:
    for figure in presets():
        assert figure in README
