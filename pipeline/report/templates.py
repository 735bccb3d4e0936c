"""Templates, style and scripts that the pages share."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jinja2

from pipeline.palette import COLOURS, ON_DARK, ROLES
from pipeline.skeleton import WALKER15

_FOLDER = Path(__file__).resolve().parent / "page"

_LIGHTER = {
    "black": "#E4E6E3",
    "orange": "#FF8B4A",
    "blue": "#5CB3EA",
    "green": "#3CCBA0",
    "purple": "#E5A3C6",
    "amber": "#F0B845",
    "sky": "#8CCDF2",
    "grey": "#A7ADB3",
}
"""The palette for thin lines on a dark ground."""


def environment(*folders: Path) -> jinja2.Environment:
    """Return the environment of the templates here and in further folders; an unknown name is an error."""
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader([_FOLDER, *folders]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def style(*further: Path) -> str:
    """Return the style sheet, with the palette for light and dark grounds, and further ones from other folders."""
    colours = {
        name: {"light": colour, "dark": _LIGHTER.get(name, COLOURS[ON_DARK.get(name, name)])}
        for name, colour in COLOURS.items()
    }
    template = environment().from_string((_FOLDER / "style.css").read_text("utf-8"))
    return "\n".join([template.render(colours=colours), *(path.read_text("utf-8") for path in further)])


def scripts(names: Sequence[str | Path]) -> str:
    """Return scripts as one: those here by file name, others by path."""
    return "\n".join((_FOLDER / name).read_text("utf-8") for name in names)


def in_every_page(style: str, script: str) -> dict[str, Any]:
    """Return what the templates of all pages are given: style and script, their policy, the palette, the bones."""
    return {
        "policy": policy(style, script),
        "style": style,
        "script": script,
        "roles": packed_json({**{name: name for name in COLOURS}, **ROLES}),
        "colour_of": ROLES,
        "bones": packed_json(WALKER15.bones),
    }


def policy(style: str, script: str) -> str:
    """Return the policy of a page that loads nothing: its own style and script by their digests, pictures inside it."""

    def digest(text: str) -> str:
        return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()

    return (
        f"default-src 'none'; script-src 'sha256-{digest(script)}'; style-src 'sha256-{digest(style)}';"
        " img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def packed_json(value: Any) -> str:
    """Return JSON that may stand inside a ``<script>`` element: no ``<`` in it.

    Examples
    --------
    >>> packed_json({"a": "</script>"})
    '{"a":"\\\\u003c/script>"}'
    """
    text = json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
