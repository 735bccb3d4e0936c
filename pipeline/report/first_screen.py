"""The pictures that the README begins with: a walker, figure 5's curve and the verdicts, from published figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import papers
from pipeline.charts import Axis, Chart, Sheet
from pipeline.core import camera, fourier
from pipeline.palette import Style
from pipeline.papers import Agreement, Beyond
from pipeline.pictures.charts import draw_charts
from pipeline.pictures.style import Canvas
from pipeline.pictures.tallies import draw_tallies
from pipeline.pictures.walking import draw_walking
from pipeline.report.ledger_picture import name_of
from pipeline.report.players import errors_of_walkers, nearest_to_medians
from pipeline.report.published import Published, PublishedFigure
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput

RECORDED = "optical"
"""Data set of recorded people."""

FIGURE = "zhang2007_fig5"
"""The figure that has walker and curve."""

VIEW_DEG = 0.0
"""From straight behind, where the depth is lost."""
_FRAMES, _CYCLES, _FIRST = 20, 5, 12
"""Frames of a cycle, cycles of a turn, and the frame of the still picture."""

_METHODS = {
    "average_walker": Style("average walker, the same for all", "baseline"),
    "least_squares": Style("least squares", "least_squares"),
    "map": Style("with a prior (MAP)", "map"),
}

_BEYOND, _WITHOUT, _ALIKE, _UNKNOWN = (
    "agrees, beyond its baseline",
    "agrees, has no baseline",
    "agrees, not beyond its baseline",
    "agrees, baseline not known",
)
_ANSWERS = {
    _BEYOND: "green",
    _WITHOUT: "blue",
    _ALIKE: "sky",
    _UNKNOWN: "purple",
    Agreement.CLOSE: "amber",
    Agreement.UNDECIDED: "silver",
    Agreement.DIFFERS: "orange",
    Agreement.UNTESTABLE: "grey",
}
"""Bars in their order: what agrees first, and within it what needs the method."""
_DARK = "<style>@media (prefers-color-scheme: dark) {:root {filter: invert(.93) hue-rotate(180deg)}}</style>"
"""On a dark page: light on dark, hues as they are."""


def draw_first_screen(results: Published, recorded: Published, to: Path) -> list[Path]:
    """Write ``walker.svg``, ``walker_still.svg``, ``curve.svg`` and ``verdicts.svg``; return the files.

    Parameters
    ----------
    results : Published
        Results of synthetic people: the walker, and the second row of verdicts.
    recorded : Published
        Results of recorded people: the curve, and the first row of verdicts.
    to : Path

    Raises
    ------
    InvalidInput
        If the figure with the walkers is not made, or was not made with the view of the picture.
    """
    figure, curve_of = (one.figures.get(FIGURE) for one in (results, recorded))
    if figure is None or curve_of is None:
        lacking = results if figure is None else recorded
        raise InvalidInput(
            "the pictures need a figure that is not made", lacking.data, FIGURE, code="not_made"
        )
    to.mkdir(parents=True, exist_ok=True)
    written = _walker(figure, to)
    table = curve_of.table("table")
    assert table is not None
    curve = Chart(
        x="view_angle_deg",
        abscissa=Axis(label="seen from", unit="°; 0: the front, ±90: the side", ticks=30),
        y="rms_error_mm",
        by="method",
        styles=_METHODS,
        label="error in depth",
        unit="mm",
        zero=True,
    )
    told = f"{FIGURE}, {recorded.data}: recorded walkers, each left out in turn; bands: 95 % intervals over people."
    sheet = Sheet(charts=[curve], panel_size=(4.3, 2.45))
    draw_charts(Canvas(to / "curve", sheet, {"table": table}, told))
    told = (
        f"Numbers and sentences of the papers, with our bounds; above {recorded.data}, recorded people, below"
        f" {results.data}, generated people. Baseline: a simpler method, fixed by rule; what describes the data has"
        " none."
    )
    draw_tallies(
        Canvas(to / "verdicts", caption=told),
        [
            (f"{name_of(paper)}, {words}", _counts(rows))
            for key, paper in papers.all_papers().items()
            if paper.figures
            for words, of in (("recorded", recorded), ("generated", results))
            if (rows := of.claims_of(paper=key))
        ],
        _ANSWERS,
        width=4.3,
    )
    for name in ("curve", "verdicts"):  # the vector files are as small and sharp at any size
        (to / f"{name}.png").unlink()
        written.append(to / f"{name}.svg")
    for path in written:
        drawn = path.read_text("utf-8")
        path.write_text(drawn.replace("</svg>", f"{_DARK}</svg>"), "utf-8")
    return written


def _walker(figure: PublishedFigure, to: Path) -> list[Path]:
    """Draw the walker whose errors from this view are nearest to the medians, by the ratio, of all methods."""
    arrays = figure.arrays
    views = np.flatnonzero(arrays["demonstration_view_deg"] == VIEW_DEG)
    methods = arrays["methods"].tolist()
    if not views.size or "map" not in methods:
        raise InvalidInput("nobody was reconstructed from the picture's view", figure.name,
                           f"map at {VIEW_DEG:g}°", ", ".join(methods), code="no_such_view")  # fmt: skip
    view, angle = views[0], np.radians(VIEW_DEG)
    method = methods.index("map")
    of = errors_of_walkers(figure.table("table_people") or {}, arrays["walker"], VIEW_DEG)
    r = nearest_to_medians(of)
    truth = arrays["original"][r]
    again = camera.combine(camera.project(truth, angle), arrays["missing"][method, r, view], angle)
    cycle = np.arange(_FRAMES) / _FRAMES
    turns = angle + np.arange(_FRAMES * _CYCLES) / (_FRAMES * _CYCLES) * 2.0 * np.pi
    times = np.tile(cycle, _CYCLES)

    def turning(coefficients: np.ndarray) -> np.ndarray:
        frames = fourier.synthesise(coefficients, 1.0, times)
        return np.stack([camera.project(frame, turn) for frame, turn in zip(frames, turns, strict=True)])

    words = (
        ("What one camera sees", "fifteen points, flat: no depth"),
        (
            "Computed from these points alone",
            f"dashed: the truth. {of['map'][r]:.0f} mm off in depth"
            f" (average walker: {of['average_walker'][r]:.0f} mm)",
        ),
    )
    files = [to / "walker.svg", to / "walker_still.svg"]
    for path, still in zip(files, (None, _FIRST), strict=True):
        draw_walking(
            path,
            WALKER15.bones,
            seen=fourier.synthesise(camera.project(truth, angle), 1.0, cycle),
            original=turning(truth),
            reconstructed=turning(again),
            seconds=1.0 / arrays["stride_hz"][r],
            estimated=arrays["unmeasured"][r],
            words=words,
            still=still,
        )
    return files


def _counts(claims: Iterable[Mapping[str, Any]]) -> dict[str, int]:
    """Return the length of each bar for the claims of a paper."""
    tally = papers.count(claims, papers.OF_PAPERS)
    within = {Beyond.YES: _BEYOND, Beyond.NOT_APPLICABLE: _WITHOUT, Beyond.UNKNOWN: _UNKNOWN}
    bars: Counter[str] = Counter()
    for (agreement, beyond), times in tally.answers.items():
        bars[within.get(beyond, _ALIKE) if agreement is Agreement.AGREES else agreement] += times
    return {bar: times for bar, times in bars.items() if bar in _ANSWERS}
