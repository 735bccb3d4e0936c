"""The presets: one YAML file in ``conf/experiment`` for each figure."""

from __future__ import annotations

from pipeline.resources import CONF


def presets() -> list[str]:
    """Return the names of the presets, sorted."""
    return sorted(path.stem for path in (CONF / "experiment").glob("*.yaml"))


def first_comment(name: str) -> str:
    """Return the first comment of a preset: paper, figure and what it shows."""
    lines = (CONF / "experiment" / f"{name}.yaml").read_text(encoding="utf-8").splitlines()
    return next((line[2:].strip() for line in lines if line.startswith("# ") and "@package" not in line), "")
