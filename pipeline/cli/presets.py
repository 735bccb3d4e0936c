"""The presets: one YAML file in a folder ``experiment`` for each figure."""

from __future__ import annotations

from collections.abc import Sequence

from pipeline import plugins


def presets() -> list[str]:
    """Return the names of the presets, sorted."""
    return list(plugins.conf_files("experiment"))


def split_named(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the figures that ``experiment=a,b`` names, none if it is not given, and the other arguments."""
    of_figures = [item for item in arguments if item.startswith("experiment=")]
    named = [name for item in of_figures for name in item.partition("=")[2].split(",")]
    return list(dict.fromkeys(named)), [item for item in arguments if item not in of_figures]


def apart(arguments: Sequence[str], names: Sequence[str]) -> tuple[dict[str, str], list[str]]:
    """Return the options of these names, and the other arguments."""
    own = [item for item in arguments if "=" in item and item.partition("=")[0] in names]
    return dict(item.split("=", 1) for item in own), [item for item in arguments if item not in own]


def first_comment(name: str) -> str:
    """Return the first comment of a preset: paper, figure and what it shows."""
    text = plugins.conf_files("experiment")[name].read_text("utf-8", errors="replace")
    return next(
        (line[2:].strip() for line in text.splitlines() if line.startswith("# ") and "@package" not in line),
        "",
    )


def listed() -> str:
    """Return the documentation's table of the figures: name and first comment of each preset, as Markdown."""
    rows = (f"| `{name}` | {first_comment(name)} |" for name in presets())
    return "\n".join(["| figure | shows |", "|---|---|", *rows])
