"""Pictures as text inside an HTML page: WebP of reduced width, or compressed SVG, encoded as base64."""

from __future__ import annotations

import base64
import gzip
import io
import re
from pathlib import Path
from typing import Any

from PIL import Image

from pipeline.reading import read_file
from pipeline.validation import InvalidInput

_QUALITY = 74
"""Quality of WebP pictures, 0 to 100."""
_SIZE = re.compile(rb'<svg [^>]*?width="([\d.]+)pt" height="([\d.]+)pt"')


def reduced(path: Path, width: int) -> tuple[bytes, int, int]:
    """Return a PNG as WebP, at most `width` pixels wide, and the width and height of the result, px."""
    try:
        with Image.open(io.BytesIO(read_file(path)), formats=["PNG"]) as stored:
            picture = stored.convert("RGB")
    except (
        OSError,
        ValueError,
        SyntaxError,
        Image.DecompressionBombError,
        Image.DecompressionBombWarning,
    ) as error:
        raise InvalidInput(
            "the picture cannot be read; make the figure again", path, "a PNG", error, code="unreadable"
        ) from error
    if picture.width > width:
        size = (width, round(picture.height * width / picture.width))
        picture = picture.resize(size, Image.Resampling.LANCZOS)
    content = io.BytesIO()
    picture.save(content, "WEBP", quality=_QUALITY, method=4)
    return content.getvalue(), picture.width, picture.height


def embedded(path: Path, width: int) -> dict[str, Any]:
    """Return a picture as a data URI with its size, px, under the keys ``uri``, ``width`` and ``height``.

    Parameters
    ----------
    path : Path
        A PNG.
    width : int
        Largest width, px; smaller pictures keep theirs.
    """
    content, wide, high = reduced(path, width)
    text = base64.b64encode(content).decode()
    return {"uri": f"data:image/webp;base64,{text}", "width": wide, "height": high}


def packed_vector(path: Path, max_bytes: int) -> dict[str, Any] | None:
    """Return a compressed SVG as base64 with its size, points: keys ``packed``, ``width`` and ``height``.

    None if its text is longer than `max_bytes`.
    """
    content = read_file(path)
    size = _SIZE.search(content)
    text = base64.b64encode(gzip.compress(content, mtime=0)).decode()
    if size is None or len(text) > max_bytes:
        return None
    return {"packed": text, "width": round(float(size[1])), "height": round(float(size[2]))}
