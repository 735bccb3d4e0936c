"""Overrides as people type them in a shell, put into Hydra's grammar."""

from __future__ import annotations

import re
from collections.abc import Sequence

from pipeline.validation import InvalidInput

_WORDS = {
    "data.path", "data.pattern", "data.person", "data.mirror", "data.raw", "data.table", "data.name", "results",
    "skeleton.mapping", "input.path", "output.path", "model_folder",
}  # fmt: skip
"""Options that are text as the user's shell passes it: paths, patterns, names."""

_NAMES = {f"sweep.{of}{name}" for of in ("", "papers_") for name in ("lengths", "root")}
"""Options with a choice that is called ``true``."""

_GROUPS = {"scale", "data", "dataset", "model", "sweep", "figure"}
"""Options that choose a file by its name, of which Hydra takes no number, truth value or null."""


def quoted(overrides: Sequence[str]) -> list[str]:
    """Return overrides in Hydra's grammar: text with letters or signs of its own is quoted, a mapping is an option.

    A comma is one of these signs, except with ``-m``, where it stands between variants.

    Examples
    --------
    >>> quoted(["data.path=/daten/müller/x", "data.person=^(.{4})", "skeleton=auto", "seed=3"])
    ["data.path='/daten/müller/x'", "data.person='^(.{4})'", 'skeleton.mapping=auto', 'seed=3']
    >>> quoted(["sweep.lengths=true,estimated", "sweep.root='true'"])
    ["sweep.lengths='true',estimated", "sweep.root='true'"]
    >>> quoted(["scale=0", "scale=full"])
    ["scale='0'", 'scale=full']
    """
    variants = "," if {"-m", "--multirun"} & set(overrides) else ""
    return [_quoted(item, rf"[A-Za-z0-9_./:{variants}-]*") for item in overrides]


def _quoted(item: str, plain: str) -> str:
    key, equals, value = item.partition("=")
    if not key:
        raise InvalidInput(
            "this is not an override", expected="option=value", received=repr(item), code="not_an_override"
        )
    if key == "skeleton" and equals:
        key = "skeleton.mapping"
    if key in _NAMES:
        value = re.sub(r"(?<!')\btrue\b", "'true'", value)
    if key in _GROUPS:
        value = re.sub(r"(?i)^(true|false|null|nan|inf|[-+.\d_e]*\d[-+.\d_e]*)$", r"'\1'", value)
    if key not in _WORDS or re.fullmatch(rf"{plain}|(['\"]).*\1|\$\{{.*\}}", value, re.DOTALL):
        return f"{key}{equals}{value}"
    # A backslash only counts before a quote, and the last one stands before the closing quote.
    inner = re.sub(r"(\\*)'", r"\1\1\\'", value)
    inner = re.sub(r"(\\+)$", r"\1\1", inner)
    return f"{key}='{inner}'"
