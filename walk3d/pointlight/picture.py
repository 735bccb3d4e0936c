"""Moving pictures of dots as GIF."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from pipeline.validation import require_count

_FINER = 4
"""Pixels drawn to one that is kept, so that dots move by parts of a pixel."""


def draw_gif(
    path: Path,
    places: np.ndarray,
    size: tuple[int, int],
    *,
    dot_px: float,
    hundredths: int,
    comment: str = "",
) -> None:
    """Write white dots on black as a GIF that repeats itself for ever.

    Parameters
    ----------
    path : Path
    places : (T, P, 2)
        Pixels, right and down.
    size : (int, int)
        Width and height.
    dot_px : float
        Radius.
    hundredths : int
        Hundredths of a second that a frame lasts; players show no fewer than two.
    comment : str
        What is shown, and its source, in the file.
    """
    require_count("hundredths of a second", hundredths, at_least=2)
    frames = []
    for dots in places * _FINER:
        fine = Image.new("L", (size[0] * _FINER, size[1] * _FINER))
        pen = ImageDraw.Draw(fine)
        for right, down in dots.tolist():
            reach = dot_px * _FINER
            pen.ellipse((right - reach, down - reach, right + reach, down + reach), fill=255)
        frames.append(fine.resize(size, Image.Resampling.BOX))
    # Equal frames are not joined to one of twice the time: a frame of the file is a frame of the display.
    frames[0].save(
        path,
        format="GIF",
        save_all=True,
        append_images=frames[1:],
        duration=10 * hundredths,
        loop=0,
        disposal=1,
        optimize=False,
        comment=comment.encode()[:255],
    )
