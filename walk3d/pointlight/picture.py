"""Animated GIF of moving dots."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from pipeline.validation import require_count

_OVERSAMPLING = 4
"""Factor by which pictures are drawn larger than the file, so that dots move by fractions of a pixel."""


def draw_gif(
    path: Path,
    places: np.ndarray,
    size: tuple[int, int],
    *,
    dot_px: float,
    hundredths: int,
    comment: str = "",
) -> None:
    """Write white dots on black as a GIF that plays in a loop.

    Parameters
    ----------
    path : Path
    places : (T, P, 2)
        Positions in pixels, right and down.
    size : (int, int)
        Width and height, pixels.
    dot_px : float
        Radius of a dot, pixels.
    hundredths : int
        Duration of a frame in hundredths of a second; viewers need at least two.
    comment : str
        Description and source, stored in the file.
    """
    require_count("hundredths of a second", hundredths, at_least=2)
    frames = []
    for dots in places * _OVERSAMPLING:
        fine = Image.new("L", (size[0] * _OVERSAMPLING, size[1] * _OVERSAMPLING))
        pen = ImageDraw.Draw(fine)
        for right, down in dots.tolist():
            reach = dot_px * _OVERSAMPLING
            pen.ellipse((right - reach, down - reach, right + reach, down + reach), fill=255)
        frames.append(fine.resize(size, Image.Resampling.BOX))
    # Equal frames are not merged, so that each frame of the file is a frame of the display.
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
