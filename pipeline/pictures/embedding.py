"""Pictures as text inside a page: reduced to a width, WebP, base64."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PIL import Image

_QUALITY = 74


def reduced(path: Path, width: int, part: Sequence[float] | None = None) -> tuple[bytes, int, int]:
    """Return a PNG, or a part of it, as WebP, at most so many pixels wide, with its width and height."""
    with Image.open(path) as stored:
        picture = stored.convert("RGB")
    if part is not None:
        left, top, right, bottom = part
        wide, high = picture.size
        picture = picture.crop(
            (round(left * wide), round(top * high), round(right * wide), round(bottom * high))
        )
    if picture.width > width:
        size = (width, round(picture.height * width / picture.width))
        picture = picture.resize(size, Image.Resampling.LANCZOS)
    content = io.BytesIO()
    picture.save(content, "WEBP", quality=_QUALITY, method=4)
    return content.getvalue(), picture.width, picture.height


def embedded(path: Path, width: int, part: Sequence[float] | None = None) -> dict[str, Any]:
    """Return a picture as a data address with its size in pixels: ``uri``, ``width``, ``height``.

    Parameters
    ----------
    path : Path
        A PNG.
    width : int
        Largest width, px; smaller pictures keep theirs.
    part : sequence of float, optional
        Left, top, right and bottom of the part to show, as shares of width and height.
    """
    content, wide, high = reduced(path, width, part)
    text = base64.b64encode(content).decode()
    return {"uri": f"data:image/webp;base64,{text}", "width": wide, "height": high}
