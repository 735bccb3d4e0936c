"""Lines over an abscissa, a line to each series, in panels: the picture of nearly every table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes

from pipeline import tidy
from pipeline.palette import Style, Styles, style_keys, style_of
from pipeline.pictures import style as look
from pipeline.pictures.panels import (
    Band,
    Panel,
    Series,
    checked_lines,
    draw_data,
    draw_notes,
    legend_handles,
    limit_ordinates,
)
from pipeline.validation import InvalidInput, require_choice, require_range


def draw_lines(
    path_stem: Path,
    panels: Sequence[Panel],
    table: tidy.Table | None = None,
    *,
    x: str = "",
    by: str = "",
    styles: Styles = None,
    xlabel: str = "",
    columns: int = 1,
    caption: str = "",
    legend: str = "panels",
    share_y: str = "none",
    letters: bool = True,
    panel_size: tuple[float, float] = look.PANEL_SIZE,
) -> None:
    """Draw panels of lines, row by row, into ``path_stem.svg`` and ``path_stem.png``.

    Parameters
    ----------
    path_stem : Path
        Without a suffix; the folder must exist.
    panels : sequence of Panel
    table : mapping of str to (N,) array
        A tidy table, such as a `pandas.DataFrame`; not needed by panels that have only `series`.
    x, by : str
        Columns of the abscissa and of the name of the series; empty `by` for one series of all rows.
    styles : mapping of str to Style, or Style, optional
        Of each series, in the order of drawing: the table may have no others; or one style for all.
    xlabel : str
        Of panels that have none of their own.
    columns : int
        Panels side by side.
    caption : str
        Set small under the picture: data set, number of walkers, components.
    legend : str
        ``panels`` for one above each panel whose entries differ from those of the panel before, ``figure`` for one
        above the whole picture.
    share_y : str
        Which panels share an ordinate: ``none``, those of a ``row``, or ``all``.
    letters : bool
        Whether titles begin with (a), (b), … if there are several panels.
    panel_size : (float, float)
        Width and height of a panel in inches.

    Raises
    ------
    InvalidInput
        If there is nothing to draw, a column is missing, lengths differ, or numbers are not finite.
    """
    where = str(path_stem)
    require_range(f"{where}, panels", len(panels), at_least=1)
    require_range(f"{where}, columns", columns, at_least=1)
    require_choice(f"{where}, legend", legend, ("panels", "figure"))
    require_choice(f"{where}, share_y", share_y, ("none", "row", "all"))
    names = [f"{path_stem.name} {p.title or f'panel {i + 1}'}" for i, p in enumerate(panels)]
    lines = [
        checked_lines(panel, _series_of(panel, table, x, by, styles), name)
        for panel, name in zip(panels, names, strict=True)
    ]
    rows = -(-len(panels) // columns)
    with look.applied_style():
        width, height = panel_size
        figure = look.new_figure(width * columns + look.FRAME, height * rows + look.FRAME)
        drawn: list[Axes] = []
        for number, panel in enumerate(panels):
            first = {"none": None, "row": number - number % columns, "all": 0}[share_y]
            shared = drawn[first] if first is not None and first < number else None
            axes = figure.add_subplot(rows, columns, number + 1, sharey=shared)
            letter = f"({chr(ord('a') + number)})" if letters and len(panels) > 1 else ""
            draw_data(axes, panel, lines[number])
            axes.set(title=f"{letter} {panel.title}".strip(), ylabel=panel.ylabel)
            axes.set_xlabel(xlabel if panel.xlabel is None else panel.xlabel)
            if share_y != "none" and number % columns:
                axes.tick_params(labelleft=False)
            drawn.append(axes)
        limit_ordinates(drawn, panels, lines, share_y, columns)
        for axes, panel, of_panel, name in zip(drawn, panels, lines, names, strict=True):
            draw_notes(axes, panel, of_panel, name)
        named = [legend_handles(of_panel) for of_panel in lines]
        header = 0.0
        if legend == "figure":
            entries = {handle.get_label(): handle for handles in named for handle in handles}
            header = look.legend_above_figure(figure, list(entries.values())) if entries else 0.0
        else:
            before: list[Any] = []
            for axes, handles in zip(drawn, named, strict=True):
                labels = [handle.get_label() for handle in handles]
                if labels and labels != before:  # repeating the legend of the panel before would tell nothing
                    look.legend_above_axes(axes, handles)
                before = labels
        look.finish(figure, path_stem, caption, header=header)


def series(
    table: tidy.Table,
    *,
    x: str,
    y: str,
    by: str = "",
    band: str | tuple[str, str] = "",
    styles: Styles = None,
    where: tidy.Where | None = None,
    units: str = "",
) -> list[Series]:
    """Return the lines of a tidy table, for the `series` of a panel that draws more than one table or column.

    Parameters
    ----------
    table : mapping of str to (N,) array
    x, y, by : str
        Columns of the abscissa, the ordinate and the name of the series; empty `by` for one series of all rows.
    band : str, or (str, str)
        Column of the standard deviation or error, or columns of the lower and upper end of the band.
    styles : mapping of str to Style, or Style, optional
    where : mapping, optional
    units : str
        Column that tells apart lines of one series.

    Raises
    ------
    InvalidInput
        If a column is missing or a series has no style.
    """
    ends = [band] if isinstance(band, str) else list(band)
    columns = [x, y, *filter(None, [*ends, units])]
    found = []
    for key, rows in tidy.groups(table, columns, by=by, where=where, keys=style_keys(styles)).items():
        style = style_of(styles, key)
        area: Band | None = None
        if ends[0] and style.banded:
            area = rows[ends[0]] if len(ends) == 1 else (rows[ends[0]], rows[ends[1]])
        lines = rows[units] if units else None
        found.append(Series(**asdict(style), x=rows[x], y=rows[y], band=area, units=lines))
    return found


def intervals(
    table: tidy.Table,
    *,
    x: str,
    y: str,
    by: str,
    styles: Mapping[str, Style],
    where: tidy.Where | None = None,
) -> list[Series]:
    """Return lines again, without their names, with bands between the columns ``<y>_low`` and ``<y>_high``.

    For the `series` of a panel whose table gives the lines a wider band, or none.

    Parameters
    ----------
    table : mapping of str to (N,) array
    x, y, by : str
        Columns of the abscissa, the ordinate and the name of the series.
    styles : mapping of str to Style
    where : mapping, optional

    Raises
    ------
    InvalidInput
        If a column is missing or a series has no style.
    """
    unnamed = {key: replace(style, label="", banded=True) for key, style in styles.items()}
    return series(table, x=x, y=y, by=by, band=(f"{y}_low", f"{y}_high"), styles=unnamed, where=where)


def _series_of(panel: Panel, table: tidy.Table | None, x: str, by: str, styles: Styles) -> list[Series]:
    """Return all series of a panel, those of the table first."""
    lines = list(panel.series)
    if panel.y:
        if table is None:
            raise InvalidInput("a panel without a table", where=panel.y)
        by = by if panel.by is None else panel.by
        if panel.legend is not None:
            named, every = panel.legend, styles if isinstance(styles, Mapping) else {}
            styles = {key: s if key in named else replace(s, label="") for key, s in every.items()}
        x = x if panel.x is None else panel.x
        of_table = series(
            table, x=x, y=panel.y, by=by, band=panel.band, styles=styles, where=panel.where, units=panel.units
        )  # fmt: skip
        lines = [*of_table, *lines]
    return lines
