"""Charts as plain values: the columns of tables that are drawn, and the axes.

A figure declares its charts once.  `pipeline.pictures` prints them, `pipeline.recordings` logs those whose abscissa is
the recording's timeline, and `pipeline.report` shows them on the page.  Pictures and page have the same lines
(`lines_of`) and the same limits (`pipeline.chart_limits`).  This module uses neither matplotlib nor rerun.

>>> chart = Chart(x="view_angle_deg", y="error_mm", by="method", label="Error", unit="mm", styles={"map": Style("MAP")})
>>> table = {"view_angle_deg": [0, 30], "error_mm": [1.0, 2.0], "method": ["map", "map"]}
>>> [(line.key, line.y.tolist()) for line in lines_of(chart, {"table": table})]
[('map', [1.0, 2.0])]
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from pipeline import tidy
from pipeline.palette import CYCLE, Style, Styles, style_keys, style_of
from pipeline.validation import InvalidInput

Ends = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Lines:
    """Lines drawn from one table, with one line for each series.

    Columns ``<y>_low`` and ``<y>_high`` of the table, if present, are the interval of `y`.

    Attributes
    ----------
    y, x : str
        Columns of ordinate and abscissa; if `x` is empty, the abscissa is that of the chart.
    table : str, or mapping of str to sequence
        Name of a table of the figure, or the columns themselves.
    by : str
        Column that names the series; empty for one series of all rows.
    where : mapping
        Filter of the rows: for each column, the accepted value or values.
    styles : mapping of str to Style, or Style, optional
        Styles of the series that are drawn, in order; or one style for all series.
    band : str, or (str, str)
        Column of the standard deviation, or columns of the ends, of a band around the line.
    strands : str
        Column that distinguishes the lines of one series; over an abscissa of names they join its points.
    less : str
        Column that is subtracted from the ordinate.
    times : float
        Factor on the ordinate.
    """

    y: str
    x: str = ""
    table: str | Mapping[str, Any] = "table"
    by: str = ""
    where: Mapping[str, Any] = field(default_factory=dict)
    styles: Styles = None
    band: str | tuple[str, str] = ""
    strands: str = ""
    less: str = ""
    times: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Reference:
    """Reference in a chart: a horizontal or vertical line, a point, or a line through the origin.

    Attributes
    ----------
    x, y : float or str, optional
        Position of a line, or of a point if both are given.  A text names a claim and stands for its published number.
    left_of : float
        If not 0, the claim's number is subtracted from this value.
    slope : float, optional
        Slope of a line through the origin.
    below, percent : str, float or str
        Series, and the percentage by which the line lies below it.
    label : str
    published : bool
        Whether a paper prints the value.
    """

    x: float | str | None = None
    y: float | str | None = None
    left_of: float = 0.0
    slope: float | None = None
    below: str = ""
    percent: float | str = 0.0
    label: str = ""
    published: bool = False


@dataclass(frozen=True, kw_only=True)
class Axis:
    """Abscissa of a chart.

    Attributes
    ----------
    label, unit : str
        Label and unit; by default derived from the column's name.
    log : bool
    limits : (float, float), optional
    ticks : float, or sequence of float, optional
        Step or positions of the ticks: of the abscissa, or of the ordinate if the abscissa has names.
    words : mapping of str to str
        Labels by value for an abscissa of names, in order; the chart then has one row of points per name.
    """

    label: str = ""
    unit: str = ""
    log: bool = False
    limits: tuple[float, float] | None = None
    ticks: float | Sequence[float] | None = None
    words: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Chart(Lines):
    """Chart with one pair of axes.

    Attributes
    ----------
    label, unit : str
        Label and unit of the ordinate; by default derived from the column's name (``missing_variance_mm2``).
    abscissa : Axis
    name : str
        Name of the quantity, for entities and files; empty for the name of the column.
    title : str
    also : sequence of Lines
        Further lines.
    references : sequence of Reference
    timeline : str
        Timeline of recordings, if it is not `x`.  Its values are whole numbers: of the logarithm to base 10 if the
        name begins with ``log10_``, in thousandths if it ends in ``_per_mille``.
    zero : bool
        Whether the ordinate begins at 0.
    log_y : bool
    least : float
        Lower bound of a logarithmic ordinate, to which smaller values are clamped.
    limits : (float, float), optional
        Range that the ordinate covers at least.
    page, picture : bool
        Whether the page and the picture show the chart.
    """

    label: str = ""
    unit: str = ""
    abscissa: Axis = Axis()
    name: str = ""
    title: str = ""
    also: Sequence[Lines] = ()
    references: Sequence[Reference] = ()
    timeline: str = ""
    zero: bool = False
    log_y: bool = False
    least: float = 0.0
    limits: tuple[float, float] | None = None
    page: bool = True
    picture: bool = True

    @property
    def quantity(self) -> str:
        """Name of the quantity on the ordinate; by default the name of the column."""
        return self.name or self.y

    @property
    def axes(self) -> tuple[str, str]:
        """Labels of the abscissa and the ordinate, with units."""
        return _axis(self.abscissa.label, self.abscissa.unit, self.x), _axis(self.label, self.unit, self.y)


UNITS = {
    "_mm2": "mm²",
    "_mm": "mm",
    "_deg": "°",
    "_percent": "%",
    "_px": "px",
    "_s": "s",
    "_frames": "frames",
}
"""Unit of a table column by the ending of the column's name."""


def _axis(label: str, unit: str, column: str) -> str:
    end = next((end for end in UNITS if column.endswith(end)), "")
    label = label or column.removesuffix(end).replace("_", " ")
    unit = unit or UNITS.get(end, "")
    return f"{label} ({unit})" if unit else label


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """Charts of a figure, and their arrangement in the figure's picture.

    Attributes
    ----------
    charts : sequence of Chart
    caption : str
        Text after the figure's title and data.
    columns : int
        Number of panels in a row.
    share_y : bool
        Whether the panels of a row share the ordinate.
    letters : bool
        Whether titles begin with (a), (b), …
    panel_size : (float, float), optional
        Width and height of a panel in inches.
    """

    charts: Sequence[Chart] = ()
    caption: str = ""
    columns: int = 1
    share_y: bool = False
    letters: bool = True
    panel_size: tuple[float, float] | None = None

    def with_published(self, number: Callable[[str], float], shown: bool = True) -> Sheet:
        """Return the sheet with published values in place of claims' names; if not `shown`, without references."""

        def resolved(reference: Reference) -> Reference:
            values = {"x": reference.x, "y": reference.y, "percent": reference.percent}
            named: dict[str, Any] = {n: number(v) for n, v in values.items() if isinstance(v, str)}
            if reference.left_of and "y" in named:
                named |= {"y": reference.left_of - named["y"], "left_of": 0.0}
            label = reference.label or ("published" if named else "")
            return replace(reference, **named, label=label, published=bool(named) or reference.published)

        def changed(chart: Chart) -> Chart:
            references = [resolved(reference) for reference in chart.references]
            return replace(chart, references=[r for r in references if shown or not r.published])

        return replace(self, charts=[changed(chart) for chart in self.charts])


@dataclass(frozen=True)
class Line:
    """Values and style of one line in a chart.

    Attributes
    ----------
    key : str
        Name of the series.
    style : Style
        Style, always with a colour.
    x, y : (N,) float
    band, interval : ((N,), (N,)) float, optional
        Lower and upper ends; NaN where unknown.
    strands : (N,), optional
        Line to which each point belongs.
    """

    key: str
    style: Style
    x: np.ndarray
    y: np.ndarray
    band: Ends | None = None
    interval: Ends | None = None
    strands: np.ndarray | None = None


def lines_of(chart: Chart, tables: Mapping[str, Any]) -> list[Line]:
    """Return the lines of a chart, with values from the tables of the chart's figure.

    Rows without a finite value are left out.  Over an abscissa of names, the series are drawn next to each other.

    Raises
    ------
    InvalidInput
        If a table or column is missing, or no row matches.
    """
    drawn: list[Line] = []
    for lines in (chart, *chart.also):
        table = tables.get(lines.table) if isinstance(lines.table, str) else lines.table
        if table is None:
            raise InvalidInput(
                "the figure has no table of this name", lines.table, ", ".join(tables), code="no_table"
            )
        drawn += _lines(chart, lines, table, len(drawn))
    if (
        chart.abscissa.words
        and len(drawn) > 1
        and len(np.unique(places := np.concatenate([line.x for line in drawn]))) < len(places)
        and not any(lines.strands for lines in (chart, *chart.also))
    ):
        step = 0.5 / (len(drawn) - 1)
        drawn = [replace(line, x=line.x - 0.25 + step * n) for n, line in enumerate(drawn)]
    return drawn


def _lines(chart: Chart, lines: Lines, table: Any, number: int) -> list[Line]:
    x, y = lines.x or chart.x, lines.y
    around = [lines.band] if isinstance(lines.band, str) else list(lines.band)
    ends = [name for name in (f"{y}_low", f"{y}_high") if name in table]
    columns = [x, y, *filter(None, [*around, lines.strands, lines.less]), *ends]
    keys = style_keys(lines.styles)
    drawn: list[Line] = []
    for key, rows in tidy.groups(table, columns, by=lines.by, where=lines.where, keys=keys).items():
        key = key or (keys[0] if len(keys) == 1 else y)
        style = style_of(lines.styles, key)
        less = rows[lines.less] if lines.less else 0.0

        def scaled(column: str, rows: Mapping[str, np.ndarray] = rows, less: Any = less) -> np.ndarray:
            values = lines.times * (np.asarray(rows[column], float) - less)
            return np.maximum(values, chart.least) if chart.log_y else values

        values, band, interval = scaled(y), None, None
        if around[0] and style.banded:
            half = rows[around[0]]
            band = (
                (scaled(around[0]), scaled(around[1]))
                if len(around) == 2
                else (values - lines.times * half, values + lines.times * half)
            )
        if len(ends) == 2 and style.interval:
            interval = (scaled(ends[0]), scaled(ends[1]))
        places = list(chart.abscissa.words)
        at = np.array([places.index(str(v)) for v in rows[x]] if places else rows[x], float)
        rows_drawn = np.flatnonzero(np.isfinite(values) & np.isfinite(at))
        if chart.abscissa.log:
            rows_drawn = rows_drawn[at[rows_drawn] > 0]
        rows_drawn = rows_drawn[np.argsort(at[rows_drawn], kind="stable")]
        if rows_drawn.size:
            colour = style.colour or CYCLE[(number + len(drawn)) % len(CYCLE)]
            drawn.append(
                Line(
                    key,
                    replace(style, colour=colour),
                    at[rows_drawn],
                    values[rows_drawn],
                    _known(band, rows_drawn),
                    _known(interval, rows_drawn),
                    rows[lines.strands][rows_drawn] if lines.strands else None,
                )
            )
    return drawn


def _known(ends: Ends | None, rows: np.ndarray) -> Ends | None:
    """Return the ends of the intervals in selected rows of a table; both ends are NaN if either end is unknown.

    Returns None if no interval has both ends.
    """
    if ends is None:
        return None
    low, high = (end[rows] for end in ends)
    if (low > high).any():
        raise InvalidInput(
            "the low end of an interval is above its high end", expected="low ≤ high", code="swapped_ends"
        )
    finite = np.isfinite(low) & np.isfinite(high)
    return (np.where(finite, low, np.nan), np.where(finite, high, np.nan)) if finite.any() else None


def on_timeline(timeline: str, values: np.ndarray) -> np.ndarray:
    """Return positions (N,) of abscissa values on a recording's timeline, rounded to whole numbers except for ``time``.

    Examples
    --------
    >>> on_timeline("log10_eta_per_mille", np.array([1.0, 2.0])), on_timeline("view_angle_deg", np.array([30.0]))
    (array([  0., 301.]), array([30.]))
    """
    values = np.log10(values) if timeline.startswith("log10_") else values
    values = 1000.0 * values if timeline.endswith("_per_mille") else values
    return values if timeline == "time" else np.rint(values)
