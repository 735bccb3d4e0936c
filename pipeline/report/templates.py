"""Templates, style sheets and scripts of the HTML pages, and encoding of values for these pages."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.palette import COLOURS, ON_DARK, ROLES
from pipeline.skeleton import WALKER15

if TYPE_CHECKING:
    import jinja2

_LARGEST = 32767
"""Largest signed integer of 16 bits, to which `quantised` scales the largest value."""
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
"""Lighter versions of the palette colours, for thin lines on a dark background."""


def environment() -> jinja2.Environment:
    """Return the Jinja environment of the templates, which raises an error for an unknown name in a template."""
    import jinja2  # the page of a single walk does not need it

    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(_FOLDER),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def style(*further: Path) -> str:
    """Return the style sheet with the palette for light and dark backgrounds, followed by further style sheets."""
    light = "".join(f"--c-{name}: {colour}; " for name, colour in COLOURS.items())
    dark = "".join(
        f"--c-{name}: {_LIGHTER.get(name, COLOURS[ON_DARK.get(name, name)])}; " for name in COLOURS
    )
    sheet, night = (_FOLDER / "style.css").read_text("utf-8"), (_FOLDER / "dark.css").read_text("utf-8")
    night = night.replace("/* palette */", dark).strip()
    texts = [sheet.replace("/* palette */", light).replace("/* dark */", night)]
    return "\n".join([*texts, *(path.read_text("utf-8") for path in further)])


def scripts(names: Sequence[str | Path]) -> str:
    """Return scripts joined into one string.

    Scripts of this package are given by file name, other scripts by path.
    """
    return "\n".join((_FOLDER / name).read_text("utf-8") for name in names)


def in_every_page(style: str, script: str) -> dict[str, Any]:
    """Return the values that the template of every page needs.

    They are the style, the script, their security policy, the palette and the bones.
    """
    return {
        "policy": policy(style, script),
        "style": style,
        "script": script,
        "roles": packed_json({**{name: name for name in COLOURS}, **ROLES}),
        "colour_of": ROLES,
        "bones": packed_json(WALKER15.bones),
    }


def policy(style: str, script: str) -> str:
    """Return a content security policy that allows only the given style and script, and embedded pictures."""

    def digest(text: str) -> str:
        return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()

    return (
        f"default-src 'none'; script-src 'sha256-{digest(script)}'; style-src 'sha256-{digest(style)}';"
        " img-src data: blob:; base-uri 'none'; form-action 'none'"
    )


def packed_json(value: Any) -> str:
    """Return JSON without ``<``, so that it is safe inside a ``<script>`` element.

    Examples
    --------
    >>> packed_json({"a": "</script>"})
    '{"a":"\\\\u003c/script>"}'
    """
    text = json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def quantised(values: np.ndarray) -> dict[str, str]:
    """Return values (N, …) as base64 strings: integers of 16 bits, their offsets and their scales.

    A value is ``offset + scale * integer``; each position along the other axes has an offset and a scale.
    """
    low, high = values.min(axis=0), values.max(axis=0)
    offset = ((low + high) / 2.0).astype(np.float32)
    reach = np.maximum(high - offset, offset - low)
    scale = np.where(reach > 0.0, reach / _LARGEST, 1.0).astype(np.float32)
    integers = np.rint((values - offset) / scale).clip(-_LARGEST, _LARGEST)
    return {
        "offset": encoded(offset, "<f4"),
        "scale": encoded(scale, "<f4"),
        "integers": encoded(integers, "<i2"),
    }


def encoded(values: np.ndarray, dtype: str) -> str:
    """Return the bytes of an array as a base64 string."""
    return base64.b64encode(np.ascontiguousarray(values, dtype).tobytes()).decode()
