"""Animated SVG of a walker: the points that a camera sees, next to the reconstruction seen from a turning view.

The file has no script: ``<animate>`` elements move the points and bones.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from pipeline.palette import hex_colour
from pipeline.pictures.stick_figures import Bones
from pipeline.validation import InvalidInput, require_finite

_WIDTH, _HEIGHT, _MARGIN, _HEADING = 880, 372, 14, 58
"""Width, height and margin of the picture, and height of the text above each half of the picture, px."""

_FILL_SHARE = 0.9
"""Fraction of the height of each half of the picture that the walker fills."""

_NIGHT, _PAPER, _INK, _QUIET = "#14171a", "#ffffff", "#1b1d20", "#595f66"
"""Colours of the picture's dark half, of its background, of titles, and of the text below titles."""


def draw_walking(
    path: Path,
    bones: Bones,
    *,
    observed: np.ndarray,
    original: np.ndarray,
    reconstructed: np.ndarray,
    seconds: float,
    estimated: np.ndarray,
    words: Sequence[tuple[str, str]],
    still: int | None = None,
) -> None:
    """Write an SVG of a walker: observed points left, original (dashed) and reconstruction right.

    Projections are in mm, with the second axis up; the frames repeat in a loop.

    Parameters
    ----------
    path : Path
        ``….svg``; the folder must exist.
    bones : sequence of (int, int)
        Pairs of joints.
    observed : (F, J, 2) float
        Points in the camera's image.
    original, reconstructed : (K, J, 2) float
        Points from a view that turns; K is a multiple of F.
    seconds : float
        Duration of the F frames of `observed`.
    estimated : (J,) bool
        Unmeasured joints, which are drawn hollow.
    words : sequence of (str, str)
        A title and a line below it, for the left and the right half.
    still : int, optional
        Draw this frame only, for readers who prefer reduced motion.

    Raises
    ------
    InvalidInput
        If K is not a multiple of F, or numbers are not finite.
    """
    observed, original, body = (
        require_finite(f"{path}, walker", part) for part in (observed, original, reconstructed)
    )
    if len(original) % len(observed):
        raise InvalidInput(
            "the turning view does not cover a whole number of gait cycles",
            path,
            "a multiple of the number of frames in a gait cycle",
            code="not_whole_cycles",
        )
    pairs = np.asarray(bones)
    if still is not None:
        observed, original, body = observed[[still % len(observed)]], original[[still]], body[[still]]
    high = max(part[..., 1].max() for part in (observed, original, body))
    low = min(part[..., 1].min() for part in (observed, original, body))
    scale = _FILL_SHARE * (_HEIGHT - _HEADING - 2 * _MARGIN) / (high - low)
    floor = _HEIGHT - _MARGIN - 0.5 * (1 - _FILL_SHARE) * (_HEIGHT - _HEADING - 2 * _MARGIN)

    def placed(postures: np.ndarray, middle: float) -> np.ndarray:
        return np.stack(
            [middle + scale * postures[..., 0], floor - scale * (postures[..., 1] - low)], axis=-1
        )

    half = 0.42 * _WIDTH
    left, right = 0.5 * half + _MARGIN, 0.5 * (half + _WIDTH)
    turning = seconds * len(original) / len(observed)
    body, truth = placed(body, right), placed(original, right)
    blue, grey = hex_colour("reconstruction"), hex_colour("reference")
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {_HEIGHT}" width="{_WIDTH}"'
        f' height="{_HEIGHT}" role="img" font-family="system-ui, sans-serif" stroke-linecap="round"'
        ' stroke-linejoin="round" fill="none">',
        f"<title>{escape(words[0][0])}. {escape(words[1][0])}</title>",
        f"<desc>{escape(words[0][1])}. {escape(words[1][1])}</desc>",
        f'<rect width="{_WIDTH}" height="{_HEIGHT}" rx="12" fill="{_PAPER}"/>',
        f'<rect x="{_MARGIN}" y="{_HEADING}" width="{half - _MARGIN:.0f}" height="{_HEIGHT - _HEADING - _MARGIN}"'
        f' rx="8" fill="{_NIGHT}"/>',
        *_headings(words, (_MARGIN, half + 2 * _MARGIN)),
        _animated(_dots(placed(observed, left)), seconds, 'stroke="#ffffff" stroke-width="9"'),
        _animated(
            _lines(truth, pairs), turning, f'stroke="{grey}" stroke-width="2.5" stroke-dasharray="6 6"'
        ),
        _animated(_lines(body, pairs), turning, f'stroke="{blue}" stroke-width="4"'),
        _animated(_dots(body), turning, f'stroke="{blue}" stroke-width="11"'),
    ]
    if estimated.any():
        parts.append(_animated(_dots(body[:, estimated]), turning, f'stroke="{_PAPER}" stroke-width="6"'))
    path.write_text("\n".join([*parts, "</svg>", ""]), "utf-8")


def _headings(words: Sequence[tuple[str, str]], places: tuple[float, float]) -> list[str]:
    return [
        f'<text x="{x:.0f}" y="{y}" font-size="{size}" fill="{colour}"{weight}>{escape(text)}</text>'
        for x, lines in zip(places, words, strict=True)
        for text, y, size, colour, weight in (
            (lines[0], 24, 17, _INK, ' font-weight="600"'),
            (lines[1], 46, 14, _QUIET, ""),
        )
    ]


def _dots(points: np.ndarray) -> list[str]:
    """Return one SVG path for each frame of points (F, J, 2).

    A path consists of lines of length zero, whose round ends look like dots.
    """
    return ["".join(f"M{x:.1f} {y:.1f}h0" for x, y in frame) for frame in points]


def _lines(points: np.ndarray, pairs: np.ndarray) -> list[str]:
    return [
        "".join(f"M{a[0]:.1f} {a[1]:.1f}L{b[0]:.1f} {b[1]:.1f}" for a, b in frame[pairs]) for frame in points
    ]


def _animated(frames: Sequence[str], seconds: float, look: str) -> str:
    """Return an SVG path that loops through its frames, or a static path if there is only one frame."""
    if len(frames) == 1:
        return f'<path d="{frames[0]}" {look}/>'
    return (
        f'<path d="{frames[0]}" {look}><animate attributeName="d" dur="{seconds:.3f}s" repeatCount="indefinite"'
        f' values="{";".join([*frames, frames[0]])}"/></path>'
    )
