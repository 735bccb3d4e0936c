"""Conversion of overrides from shell input to the grammar of Hydra."""

from __future__ import annotations

import re
from collections.abc import Sequence

from pipeline.validation import InvalidInput

_WORDS = {
    "data.path", "data.pattern", "data.person", "data.mirror", "data.raw", "data.table", "data.name", "results",
    "skeleton.mapping", "input.path", "output.path", "model_folder",
}  # fmt: skip
"""Names of options whose value is plain text: paths, patterns, names."""

_NAMES = {f"sweep.{prefix}{name}" for prefix in ("", "papers_") for name in ("lengths", "root")}
"""Names of options with a choice called ``true``, which Hydra would read as a boolean."""

_GROUPS = {"scale", "data", "dataset", "model", "sweep", "figure"}
"""Names of options that select a YAML file of options by the file's name.

Hydra rejects unquoted numbers, booleans and null as values of these options.
"""


def quoted(overrides: Sequence[str]) -> list[str]:
    """Return overrides in Hydra's grammar: special characters are quoted, and ``skeleton=`` is expanded.

    A comma is a special character, except with ``-m``, where it separates variants.

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
            "this argument is not an override",
            expected="option=value",
            received=repr(item),
            code="not_an_override",
            typed=True,
        )
    if key == "skeleton" and equals:
        key = "skeleton.mapping"
    if key in _NAMES:
        value = re.sub(r"(?<!')\btrue\b", "'true'", value)
    if key in _GROUPS:
        value = re.sub(r"(?i)^(true|false|null|nan|inf|[-+.\d_e]*\d[-+.\d_e]*)$", r"'\1'", value)
    if key not in _WORDS or re.fullmatch(rf"{plain}|(['\"]).*\1|\$\{{.*\}}", value, re.DOTALL):
        return f"{key}{equals}{value}"
    # Backslashes are special only before a quote: before an inner quote, and at the end, before the closing quote.
    inner = re.sub(r"(\\*)'", r"\1\1\\'", value)
    inner = re.sub(r"(\\+)$", r"\1\1", inner)
    return f"{key}='{inner}'"
