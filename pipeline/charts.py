"""Charts as plain values: what is drawn against what, from which table.

A figure declares its charts once.  `pipeline.pictures` prints them, `pipeline.recordings` logs those whose abscissa is
the recording's timeline, and `pipeline.report` shows them on the page.  Here is neither matplotlib nor rerun.

>>> chart = Chart(x="view_angle_deg", y="error_mm", by="method", label="Error", unit="mm", styles={"map": Style("MAP")})
>>> table = {"view_angle_deg": [0, 30], "error_mm": [1.0, 2.0], "method": ["map", "map"]}
>>> [(line.key, line.y.tolist()) for line in lines_of(chart, {"table": table})]
[('map', [1.0, 2.0])]
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, get_type_hints

import numpy as np

from pipeline import tidy
from pipeline.palette import CYCLE, Style, Styles, style_keys, style_of
from pipeline.validation import InvalidInput, fits

Ends = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Lines:
    """Lines of one table, one to each series.

    Columns ``<y>_low`` and ``<y>_high``, where the table has them, are the interval of `y`.

    Attributes
    ----------
    y, x : str
        Columns; `x` is the chart's if empty.
    table : str, or mapping of str to sequence
        Name of a table of the figure, or columns that none of them has.
    by : str
        Column that names the series; empty for one series of all rows.
    where : mapping
        Column → the value, or several values, of the rows that are drawn.
    styles : mapping of str to Style, or Style, optional
        Of each series in order, others are not drawn; or one style for all.
    band : str, or (str, str)
        Column of the standard deviation, or columns of the ends, of a band around the line.
    strands : str
        Column that tells apart the lines of one series; over an abscissa of names they join its points.
    less : str
        Column that is subtracted.
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
    """A number to compare with: a line across or upright, a point, or a line through the origin.

    Attributes
    ----------
    x, y : float or str, optional
        Place; both for a point.  A text is the name of a claim, whose published number is meant.
    left_of : float
        Of a claim named by `y`, what its number leaves of this; 0 for the number itself.
    slope : float, optional
        Of a line through the origin.
    below, percent : str, float or str
        A line so many per cent below that series.
    label : str
    published : bool
        Whether a paper prints it.
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
    """The abscissa of a chart.

    Attributes
    ----------
    label, unit : str
        Those that the column's name says if not given.
    log : bool
    limits : (float, float), optional
    ticks : float, or sequence of float, optional
        Step of the ticks, or their places: of the abscissa, or of the numbers across from an abscissa of names.
    words : mapping of str to str
        Values of an abscissa of names, in order, and what stands for them: rows of points, names down.
    """

    label: str = ""
    unit: str = ""
    log: bool = False
    limits: tuple[float, float] | None = None
    ticks: float | Sequence[float] | None = None
    words: Mapping[str, str] = field(default_factory=dict)


_FLAT = {
    "label": "x_label",
    "unit": "x_unit",
    "log": "log_x",
    "limits": "x_limits",
    "ticks": "ticks",
    "words": "words",
}
"""Names of the abscissa's fields among the plain values of a chart."""


@dataclass(frozen=True, kw_only=True)
class Chart(Lines):
    """One pair of axes.

    Attributes
    ----------
    label, unit : str
        Of the ordinate; those that its column's name says if not given (``missing_variance_mm2``).
    abscissa : Axis
    name : str
        Of the quantity, for entities and files; that of the column if empty.
    title : str
    also : sequence of Lines
        Further lines.
    references : sequence of Reference
    timeline : str
        Timeline of recordings, if it is not `x`: whole numbers, of the logarithm to base 10 if the name begins with
        ``log10_``, in thousandths if it ends in ``_per_mille``.
    zero : bool
        Whether the ordinate begins at 0.
    log_y : bool
    least : float
        On a logarithmic ordinate, smaller values are drawn there.
    limits : (float, float), optional
        Of the ordinate.
    named : bool
        Whether the names of the lines stand at their right ends, not in the legend; in pictures only.
    page, picture : bool
        Whether the page and the picture show it.
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
    named: bool = False
    page: bool = True
    picture: bool = True

    @property
    def quantity(self) -> str:
        """Name of the quantity."""
        return self.name or self.y

    @property
    def axes(self) -> tuple[str, str]:
        """Words along the abscissa and the ordinate, with units."""
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
"""What the end of a column's name says."""


def _axis(label: str, unit: str, column: str) -> str:
    end = next((end for end in UNITS if column.endswith(end)), "")
    label = label or column.removesuffix(end).replace("_", " ")
    unit = unit or UNITS.get(end, "")
    return f"{label} ({unit})" if unit else label


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """The charts of a figure and how its picture arranges them.

    Attributes
    ----------
    charts : sequence of Chart
    caption : str
        What follows the figure's title and data.
    columns : int
        Panels side by side.
    share_y : bool
        Whether the panels of a row have one ordinate.
    letters : bool
        Whether titles begin with (a), (b), …
    panel_size : (float, float), optional
        Inches.
    """

    charts: Sequence[Chart] = ()
    caption: str = ""
    columns: int = 1
    share_y: bool = False
    letters: bool = True
    panel_size: tuple[float, float] | None = None

    def with_published(self, number: Callable[[str], float]) -> Sheet:
        """Return the sheet with the published numbers in place of the names of their claims."""

        def known(reference: Reference) -> Reference:
            given = {"x": reference.x, "y": reference.y, "percent": reference.percent}
            named: dict[str, Any] = {n: number(v) for n, v in given.items() if isinstance(v, str)}
            if reference.left_of and "y" in named:
                named |= {"y": reference.left_of - named["y"], "left_of": 0.0}
            label = reference.label or ("published" if named else "")
            return replace(reference, **named, label=label, published=bool(named) or reference.published)

        return replace(
            self,
            charts=[replace(chart, references=[known(r) for r in chart.references]) for chart in self.charts],
        )


@dataclass(frozen=True)
class Line:
    """One line, with its numbers.

    Attributes
    ----------
    key : str
        Name of the series.
    style : Style
        With a colour.
    x, y : (N,) float
    band, interval : ((N,), (N,)) float, optional
        Lower and upper ends, NaN where there is none.
    strands : (N,), optional
        Which line each point belongs to.
    """

    key: str
    style: Style
    x: np.ndarray
    y: np.ndarray
    band: Ends | None = None
    interval: Ends | None = None
    strands: np.ndarray | None = None


def lines_of(chart: Chart, tables: Mapping[str, Any]) -> list[Line]:
    """Return the lines of a chart from the tables of its figure.

    Rows without a number are left out.  Over an abscissa of names, the series stand side by side.

    Raises
    ------
    InvalidInput
        If a table or column is missing, or no row is left.
    """
    found: list[Line] = []
    for lines in (chart, *chart.also):
        table = tables.get(lines.table) if isinstance(lines.table, str) else lines.table
        if table is None:
            raise InvalidInput("no such table", lines.table, ", ".join(tables), code="no_table")
        found += _lines(chart, lines, table, len(found))
    if (
        chart.abscissa.words
        and len(found) > 1
        and len(np.unique(places := np.concatenate([line.x for line in found]))) < len(places)
        and not any(lines.strands for lines in (chart, *chart.also))
    ):
        step = 0.5 / (len(found) - 1)
        found = [replace(line, x=line.x - 0.25 + step * n) for n, line in enumerate(found)]
    return found


def _lines(chart: Chart, lines: Lines, table: Any, number: int) -> list[Line]:
    x, y = lines.x or chart.x, lines.y
    around = [lines.band] if isinstance(lines.band, str) else list(lines.band)
    ends = [name for name in (f"{y}_low", f"{y}_high") if name in table]
    columns = [x, y, *filter(None, [*around, lines.strands, lines.less]), *ends]
    keys = style_keys(lines.styles)
    made: list[Line] = []
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
        kept = np.flatnonzero(np.isfinite(values) & np.isfinite(at))
        if chart.abscissa.log:
            kept = kept[at[kept] > 0]
        kept = kept[np.argsort(at[kept], kind="stable")]
        if kept.size:
            colour = style.colour or CYCLE[(number + len(made)) % len(CYCLE)]
            made.append(
                Line(
                    key,
                    replace(style, colour=colour),
                    at[kept],
                    values[kept],
                    _known(band, kept),
                    _known(interval, kept),
                    rows[lines.strands][kept] if lines.strands else None,
                )
            )
    return made


def _known(ends: Ends | None, kept: np.ndarray) -> Ends | None:
    """Return the rows that are kept, with NaN for both ends where one is unknown; None if all are."""
    if ends is None:
        return None
    low, high = (end[kept] for end in ends)
    if (low > high).any():
        raise InvalidInput("an interval whose ends are swapped", expected="low ≤ high", code="swapped_ends")
    known = np.isfinite(low) & np.isfinite(high)
    return (np.where(known, low, np.nan), np.where(known, high, np.nan)) if known.any() else None


def to_json(chart: Chart) -> dict[str, Any]:
    """Return a chart as plain values, without those that are as usual; mappings whose order counts are pairs."""
    plain = _plain(chart)
    abscissa = {_FLAT[name]: value for name, value in plain.pop("abscissa").items()}
    return {
        name: value for name, value in (plain | abscissa).items() if name not in ("named", "page", "picture")
    }


def _plain(value: Any) -> Any:
    if isinstance(value, Lines | Axis | Reference | Style):
        usual = {f.name: f.default for f in fields(value)}
        pairs = ((name, getattr(value, name)) for name in usual)
        return {name: _plain(part) for name, part in pairs if not _is_usual(part, usual[name])}
    if isinstance(value, Mapping):
        inner = [[str(name), _plain(part)] for name, part in value.items()]
        ordered = all(isinstance(part, Style | str) for part in value.values())
        return inner if ordered else dict(inner)
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if isinstance(value, str):
        return str(value)  # of a choice its name
    return float(f"{value:.6g}") if isinstance(value, float) else value


def _is_usual(value: Any, usual: Any) -> bool:
    if isinstance(value, Mapping | list | tuple):
        return not value
    return value is None or (isinstance(value, str | float | bool) and value == usual)


def from_json(plain: Mapping[str, Any], where: str = "") -> Chart:
    """Return a chart from its plain values; `where` says which figure's.

    Raises
    ------
    InvalidInput
        If another version of this software wrote them, or a value is not of the field's type.
    """
    try:
        values = dict(plain)
        values["also"] = [Lines(**_restored(one)) for one in values.get("also", [])]
        values["references"] = [Reference(**one) for one in values.get("references", [])]
        abscissa = {name: values.pop(flat) for name, flat in _FLAT.items() if flat in values}
        if "words" in abscissa:
            abscissa["words"] = dict(abscissa["words"])
        made = Chart(**_restored(values), abscissa=Axis(**abscissa))
        for one in (made, made.abscissa, *made.also, *made.references):
            hints = get_type_hints(type(one))
            if wrong := [name for name, value in vars(one).items() if not fits(value, hints[name])]:
                raise TypeError(f"{wrong[0]} is of another type")
        return made
    except (
        TypeError,
        ValueError,
        AttributeError,
    ) as error:  # a field that there is no more, or another value
        raise InvalidInput(
            "a chart of another version of this software",
            where,
            "the figure, made again",
            error,
            code="other_version",
        ) from None


def _restored(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of lines with their mappings and styles."""
    found = dict(values)
    if "where" in found:
        found["where"] = dict(found["where"])
    styles = found.get("styles")
    if isinstance(styles, list):
        found["styles"] = {key: Style(**style) for key, style in styles}
    elif styles is not None:
        found["styles"] = Style(**styles)
    return found


def on_timeline(timeline: str, values: np.ndarray) -> np.ndarray:
    """Return the whole numbers (N,) at which a recording shows values of an abscissa, as `Chart.timeline` says.

    Examples
    --------
    >>> on_timeline("log10_eta_per_mille", np.array([1.0, 2.0])), on_timeline("view_angle_deg", np.array([30.0]))
    (array([  0., 301.]), array([30.]))
    """
    values = np.log10(values) if timeline.startswith("log10_") else values
    values = 1000.0 * values if timeline.endswith("_per_mille") else values
    return values if timeline == "time" else np.rint(values)
