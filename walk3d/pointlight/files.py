"""Point-light displays and their file contents: animated SVG, CSV, and the Body Movement Library's format."""

from __future__ import annotations

from html import escape

import numpy as np

from pipeline.shortened import shortened
from pipeline.validation import require_count, require_range, require_shape

PTD_RATE_HZ = 60.0
"""Frame rate of the Body Movement Library, Hz."""

_MM_PER_INCH = 25.4
_MARGIN = 0.08
"""Margin on each side of the picture, relative to the height of the picture."""


@shortened
class PointLights:
    """Dots of a point-light display, with their positions in every frame.

    Attributes
    ----------
    names : tuple of str
        Joint of each of the P dots, or a name for the dot.
    positions : (T, P, 2)
        Positions to the right and up, mm.
    frame_rate_hz : float
    of_walker : (P,) bool
        True for dots of the walker, False for noise dots.
    loops : bool
        True if the display can be repeated without a jump.
    """

    names: tuple[str, ...]
    positions: np.ndarray
    frame_rate_hz: float
    of_walker: np.ndarray
    loops: bool

    def _repr_html_(self) -> str:
        """Return the display as an animated SVG, for notebooks."""
        return as_svg(self)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest coordinates, each (2,), of all dots in all frames, mm."""
        return self.positions.min(axis=(0, 1)), self.positions.max(axis=(0, 1))


def pixels(lights: PointLights, height_px: int) -> tuple[np.ndarray, tuple[int, int]]:
    """Return the dots' positions in a picture (T, P, 2), px, and the picture's width and height, px.

    Parameters
    ----------
    lights : PointLights
    height_px : int
    """
    require_count("height_px", height_px, at_least=16, at_most=4096)
    low, high = lights.bounds
    margin = _MARGIN * height_px
    extent = np.maximum(high - low, 1e-9)
    # A walker who crosses the picture makes it wide, at most four times its height.
    scale = min((height_px - 2 * margin) / extent[1], (4 * height_px - 2 * margin) / extent[0])
    width = max(int(np.ceil(scale * extent[0] + 2 * margin)), height_px // 2)
    centre = (low + high) / 2
    right = width / 2 + scale * (lights.positions[..., 0] - centre[0])
    down = height_px / 2 - scale * (lights.positions[..., 1] - centre[1])
    return np.stack([right, down], axis=-1), (width, height_px)


def as_svg(
    lights: PointLights, *, height_px: int = 400, dot_px: float = 4.0, title: str = "point-light walker"
) -> str:
    """Return an animated SVG that any browser plays in a loop, without a script.

    Parameters
    ----------
    lights : PointLights
    height_px : int
    dot_px : float
        Radius of a dot.
    title : str
        Description for readers who cannot see the picture.
    """
    places, (width, height) = pixels(lights, height_px)
    require_range("dot_px", dot_px, above=0, at_most=height_px)
    seconds = f"{len(places) / lights.frame_rate_hz:.6g}s"
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}"'
        ' role="img">',
        f"<title>{escape(title, quote=False)}</title>",
        f'<rect width="{width}" height="{height}" fill="#000"/>',
        '<g fill="#fff">',
    ]
    for dot in range(places.shape[1]):
        lines.append(
            f'<circle r="{dot_px:g}" cx="{places[0, dot, 0]:.2f}" cy="{places[0, dot, 1]:.2f}">'
            + "".join(
                f'<animate attributeName="{name}" calcMode="discrete" dur="{seconds}" repeatCount="indefinite"'
                f' values="{";".join(f"{value:.2f}" for value in places[:, dot, axis])}"/>'
                for axis, name in enumerate(("cx", "cy"))
            )
            + "</circle>"
        )
    return "\n".join([*lines, "</g>", "</svg>", ""])


def as_csv(lights: PointLights) -> str:
    """Return CSV text with a row for each frame and dot: frame, time, dot, kind, and position, mm."""
    lines = ["frame,time_s,dot,kind,x_mm,y_mm"]
    kinds = ["walker" if is_walker else "noise" for is_walker in lights.of_walker]
    for frame, places in enumerate(lights.positions.tolist()):
        time = f"{frame / lights.frame_rate_hz:.6f}"
        lines += [
            f"{frame},{time},{name},{kind},{x:.4f},{y:.4f}"
            for name, kind, (x, y) in zip(lights.names, kinds, places, strict=True)
        ]
    return "\n".join([*lines, ""])


def as_ptd(positions_mm: np.ndarray) -> str:
    """Return a walk as text in the Body Movement Library's format: the frame count, then 45 values per frame.

    The values are in inches.

    The order of points is that of WALKER15: head, sternum, left arm, right arm, pelvis, left leg, right leg.

    Parameters
    ----------
    positions_mm : (T, 15, 3)
        Positions at the frame rate `PTD_RATE_HZ`.
    """
    positions_mm = require_shape("positions_mm", positions_mm, ("T", 15, 3))
    rows = [" ".join(f"{value:.6f}" for value in row) for row in positions_mm.reshape(-1, 45) / _MM_PER_INCH]
    return "\n".join([str(len(rows)), *rows, ""])
