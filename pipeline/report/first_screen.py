"""Pictures at the top of the README, drawn from published figures: a walker, a curve, and the verdicts.

The curve is that of zhang2007's figure 5.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import papers
from pipeline.charts import Axis, Chart, Sheet
from pipeline.core import camera, fourier
from pipeline.core.choice import nearest_to_medians
from pipeline.palette import Style
from pipeline.papers import Agreement, Beyond
from pipeline.pictures.charts import draw_charts
from pipeline.pictures.style import Canvas
from pipeline.pictures.tallies import draw_tallies
from pipeline.pictures.walking import draw_walking
from pipeline.report.ledger_picture import name_of
from pipeline.report.players import errors_of_walkers
from pipeline.report.published import Published, PublishedFigure
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput

RECORDED = "optical"
"""Name of the data set of recorded people."""

FIGURE = "zhang2007_fig5"
"""Name of the figure from which the walker and the curve are drawn."""

VIEW_DEG = 0.0
"""View angle of the walker, degrees: from behind, where the image contains least information on depth."""
_FRAMES, _CYCLES, _FIRST = 20, 5, 12
"""Frames per gait cycle, gait cycles per turn of the walker, and index of the frame in the still picture."""

_METHODS = {
    "average_walker": Style("average walker, the same for all", "baseline", line="dotted"),
    "least_squares": Style("least squares", "least_squares"),
    "map": Style("with a prior (MAP)", "map", line="dashed"),
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
"""Colours of the bars of ``verdicts.svg``, in the order of the bars.

Claims that agree are first, and among them the claims that beat their baseline.
"""
_DARK = "<style>@media (prefers-color-scheme: dark) {:root {filter: invert(.93) hue-rotate(180deg)}}</style>"
"""Style for a dark page, which inverts the lightness of colours and preserves their hues."""


def draw_first_screen(results: Published, recorded: Published, to: Path) -> list[Path]:
    """Write ``walker.svg``, ``walker_still.svg``, ``curve.svg`` and ``verdicts.svg``, and return their paths.

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
        If the figure with the walkers is missing, or was made without the view of the picture.
    """
    figure, curve_of = (published.figures.get(FIGURE) for published in (results, recorded))
    if figure is None or curve_of is None:
        lacking = results if figure is None else recorded
        raise InvalidInput(
            "a figure that the pictures of the README need is missing", lacking.data, FIGURE, code="not_made"
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
    caption = (
        f"{FIGURE}, {recorded.data}: recorded walkers, leave-one-out; bands: 95 % intervals over people."
    )
    sheet = Sheet(charts=[curve], panel_size=(4.3, 2.45))
    draw_charts(Canvas(to / "curve", sheet, {"table": table}, caption, "Error in depth by view angle"))
    caption = (
        f"Verdicts on numbers and sentences of the papers. Upper rows: recorded people ({recorded.data}); lower rows:"
        f" generated people ({results.data}). Baseline: a simpler method, fixed by rule; claims about data have none."
    )
    draw_tallies(
        Canvas(to / "verdicts", caption=caption, title="Verdicts on the papers"),
        [
            (f"{name_of(paper)}, {words}", _counts(rows))
            for key, paper in papers.all_papers().items()
            if paper.figures
            for words, published_set in (("recorded", recorded), ("generated", results))
            if (rows := published_set.claims_of(paper=key))
        ],
        _ANSWERS,
        hatched=[Agreement.DIFFERS],
        width=4.3,
    )
    for name in ("curve", "verdicts"):  # the vector files are small and sharp at any size
        (to / f"{name}.png").unlink()
        written.append(to / f"{name}.svg")
    for path in written:
        drawn = path.read_text("utf-8")
        path.write_text(drawn.replace("</svg>", f"{_DARK}</svg>"), "utf-8")
    return written


def _walker(figure: PublishedFigure, to: Path) -> list[Path]:
    """Draw the walker whose depth errors in the picture's view are nearest to the median errors of the methods.

    Nearness is measured by the ratio of error and median.
    """
    arrays = figure.arrays
    views = np.flatnonzero(arrays["demonstration_view_deg"] == VIEW_DEG)
    methods = arrays["methods"].tolist()
    if not views.size or "map" not in methods:
        raise InvalidInput("no walker was reconstructed from the view of the README picture", figure.name,
                           f"map at {VIEW_DEG:g}°", ", ".join(methods), code="no_such_view")  # fmt: skip
    view, angle = views[0], np.radians(VIEW_DEG)
    method = methods.index("map")
    error_mm = errors_of_walkers(figure.table("table_people") or {}, arrays["walker"], VIEW_DEG)
    r = nearest_to_medians(error_mm)
    truth = arrays["original"][r]
    reconstruction = camera.combine(camera.project(truth, angle), arrays["missing"][method, r, view], angle)
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
            f"dashed: the truth. {error_mm['map'][r]:.0f} mm off in depth"
            f" (average walker: {error_mm['average_walker'][r]:.0f} mm)",
        ),
    )
    files = [to / "walker.svg", to / "walker_still.svg"]
    for path, still in zip(files, (None, _FIRST), strict=True):
        draw_walking(
            path,
            WALKER15.bones,
            observed=fourier.synthesise(camera.project(truth, angle), 1.0, cycle),
            original=turning(truth),
            reconstructed=turning(reconstruction),
            seconds=1.0 / arrays["stride_hz"][r],
            estimated=arrays["unmeasured"][r],
            words=words,
            still=still,
        )
    return files


def _counts(claims: Iterable[Mapping[str, Any]]) -> dict[str, int]:
    """Return the number of a paper's claims in each bar of ``verdicts.svg``."""
    tally = papers.count(claims, papers.OF_PAPERS)
    within = {Beyond.YES: _BEYOND, Beyond.NOT_APPLICABLE: _WITHOUT, Beyond.UNKNOWN: _UNKNOWN}
    bars: Counter[str] = Counter()
    for (agreement, beyond), times in tally.answers.items():
        bars[within.get(beyond, _ALIKE) if agreement is Agreement.AGREES else agreement] += times
    return {bar: times for bar, times in bars.items() if bar in _ANSWERS}
