"""Declarations of charts: lines from tables, references, axes, and their arrangement in a picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from pipeline.palette import Styles


@dataclass(frozen=True, kw_only=True)
class Lines:
    """Lines from one table, one line per series.

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
    """Reference value in a chart: a horizontal or vertical line, a point, or a line through the origin.

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
    named : bool
        Whether the lines are labelled at their right ends, not in the legend; in pictures only.
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
    named: bool = False
    page: bool = True
    picture: bool = True

    @property
    def quantity(self) -> str:
        """Name of the quantity, by default that of the column."""
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
"""Unit by the end of a column's name."""


def _axis(label: str, unit: str, column: str) -> str:
    end = next((end for end in UNITS if column.endswith(end)), "")
    label = label or column.removesuffix(end).replace("_", " ")
    unit = unit or UNITS.get(end, "")
    return f"{label} ({unit})" if unit else label


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """Charts of a figure and their arrangement in its picture.

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

    def with_published(self, number: Callable[[str], float]) -> Sheet:
        """Return the sheet with published numbers in place of the names of their claims."""

        def resolved(reference: Reference) -> Reference:
            values = {"x": reference.x, "y": reference.y, "percent": reference.percent}
            named: dict[str, Any] = {n: number(v) for n, v in values.items() if isinstance(v, str)}
            if reference.left_of and "y" in named:
                named |= {"y": reference.left_of - named["y"], "left_of": 0.0}
            label = reference.label or ("published" if named else "")
            return replace(reference, **named, label=label, published=bool(named) or reference.published)

        return self._with_references(lambda references: [resolved(r) for r in references])

    def without_published(self) -> Sheet:
        """Return the sheet without the references that a paper prints."""
        return self._with_references(lambda references: [r for r in references if not r.published])

    def _with_references(self, change: Callable[[Sequence[Reference]], list[Reference]]) -> Sheet:
        return replace(self, charts=[replace(c, references=change(c.references)) for c in self.charts])
