"""Placement of notes inside axes so that a note covers no other note and as few data points as possible."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from pipeline.charts import Line, Reference
from pipeline.pictures import style as look

_GAP = 3.0
"""Distance of a note from the line or point that it labels, points."""

_FORBIDDEN = 1e6
"""Cost of a note that covers another note or leaves the axes, as a number of covered data points."""

_ALONG = 100
"""Number of points along a reference line that count as obstacles for notes."""

Box = tuple[float, float, float, float]


class Notes:
    """Notes in axes whose position and limits no longer change.

    Parameters
    ----------
    axes : Axes
    lines : sequence of Line
        Lines that notes should not cover.
    references : sequence of Reference
        Lines and points that notes should not cover either.
    """

    def __init__(self, axes: Axes, lines: Sequence[Line], references: Sequence[Reference]) -> None:
        self.axes, self.boxes = axes, list[Box]()
        self.size = np.array(axes.bbox.size) * 72.0 / axes.figure.dpi  # points
        across = np.linspace(0.0, 1.0, _ALONG)
        obstacles = [_dense(self._at(np.column_stack([line.x, line.y])), line) for line in lines]
        for reference in references:
            at = self.place_of(reference)
            ends = [
                across * size if np.isnan(p) else np.full(_ALONG, p)
                for p, size in zip(at, self.size, strict=True)
            ]
            if np.isnan(at).sum() == 1:
                obstacles.append(np.column_stack(ends))
        self.obstacles = np.concatenate([np.empty((0, 2)), *obstacles])

    def place_of(self, reference: Reference) -> np.ndarray:
        """Return the position (2,) of a reference line or point from the lower left corner of the axes, points.

        A coordinate along which the reference is a line is NaN.
        """
        corner = np.array([self.axes.get_xlim()[0], self.axes.get_ylim()[0]])
        position = np.array([np.nan if v is None else float(v) for v in (reference.x, reference.y)])
        at = self._at(np.where(np.isnan(position), corner, position)[None])[0]
        return np.where(np.isnan(position), np.nan, at)

    def write(self, reference: Reference) -> None:
        """Write the label of a reference line or point next to it."""
        if not reference.label:
            return
        x, y = self.place_of(reference)
        room = (self.size[0] if np.isnan(x) else max(x, self.size[0] - x)) - 2 * _GAP
        label = look.wrapped(reference.label, room, look.NOTE_SIZE)
        wide = max(look.text_width(line, look.NOTE_SIZE) for line in label.split("\n"))
        high = 1.25 * look.NOTE_SIZE * (1 + label.count("\n"))
        inner = self.size - [wide + 2 * _GAP, high + 2 * _GAP]
        fractions = (1.0, 0.0, 0.5, 0.25, 0.75, 0.9, 0.1)
        lefts = [_GAP + f * inner[0] for f in fractions] if np.isnan(x) else [x + _GAP, x - wide - _GAP]
        lows = [_GAP + f * inner[1] for f in fractions] if np.isnan(y) else [y + _GAP, y - high - _GAP]
        if not np.isnan(x + y):
            lows.append(y - 0.5 * high)
            lefts = [x + 2 * _GAP, x - wide - 2 * _GAP]
        boxes = [(left, low, left + wide, low + high) for low in lows for left in lefts]
        box = min(boxes, key=self._cost)
        self.boxes.append(box)
        self.axes.text(
            box[0] / self.size[0], box[1] / self.size[1], label, transform=self.axes.transAxes, fontsize=look.NOTE_SIZE,
            color=look.NOTE_COLOUR, va="bottom", clip_on=False,
        )  # fmt: skip

    def _at(self, data: np.ndarray) -> np.ndarray:
        axes = self.axes
        return axes.transAxes.inverted().transform(axes.transData.transform(data)) * self.size

    def _cost(self, box: Box) -> float:
        left, low, right, top = box
        wide, high = self.size
        outside = left < 0 or low < 0 or right > wide or top > high
        over = sum(left < b[2] and b[0] < right and low < b[3] and b[1] < top for b in self.boxes)
        x, y = self.obstacles.T
        covered = ((x > left - 1) & (x < right + 1) & (y > low - 1) & (y < top + 1)).sum()
        return _FORBIDDEN * (outside + over) + covered


def _dense(points: np.ndarray, line: Line) -> np.ndarray:
    """Return closely spaced points (N, 2) along a line of a chart; series that are drawn as points are unchanged."""
    if line.style.line == "points" or line.strands is not None or len(points) < 2:
        return points
    fine, numbers = np.linspace(0, len(points) - 1, max(len(points), 3 * _ALONG)), np.arange(len(points))
    return np.stack([np.interp(fine, numbers, points[:, k]) for k in (0, 1)], axis=-1)
