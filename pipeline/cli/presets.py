"""Presets of figures: one YAML file for each figure, in a folder ``experiment``."""

from __future__ import annotations

from collections.abc import Sequence

from pipeline import plugins


def presets() -> list[str]:
    """Return the sorted names of the presets."""
    return list(plugins.conf_files("experiment"))


def split_named(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the names of the figures in ``experiment=a,b``, and the other arguments."""
    of_figures = [item for item in arguments if item.startswith("experiment=")]
    named = [name for item in of_figures for name in item.partition("=")[2].split(",")]
    return list(dict.fromkeys(named)), [item for item in arguments if item not in of_figures]


def split_options(arguments: Sequence[str], names: Sequence[str]) -> tuple[dict[str, str], list[str]]:
    """Return the values of the options with the given names, and the other arguments."""
    options = [item for item in arguments if "=" in item and item.partition("=")[0] in names]
    return dict(item.split("=", 1) for item in options), [item for item in arguments if item not in options]


def first_comment(name: str) -> str:
    """Return the first comment of a preset's file, which states paper, figure and content."""
    text = plugins.conf_files("experiment")[name].read_text("utf-8", errors="replace")
    return next(
        (line[2:].strip() for line in text.splitlines() if line.startswith("# ") and "@package" not in line),
        "",
    )


def listed() -> str:
    """Return the documentation's table of figures in Markdown: name and first comment of each preset."""
    rows = (f"| `{name}` | {first_comment(name)} |" for name in presets())
    return "\n".join(["| figure | shows |", "|---|---|", *rows])
