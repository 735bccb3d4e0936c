"""How figures of the anatomical reconstruction draw its methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from pipeline import pictures
from pipeline.palette import Style
from pipeline.studies.walks.people_intervals import Interval


def steps(
    table: pd.DataFrame, names: Sequence[str], column: str, styles: Mapping[str, Style]
) -> tuple[list[pictures.Series], list[float]]:
    """A point with its interval for each method, and the places of the methods on the abscissa."""
    rows = table.set_index("method")
    series: list[pictures.Series] = []
    for place, name in enumerate(names):
        value, low, high = (float(rows.at[name, column + end]) for end in ("", "_low", "_high"))
        colour = styles[name].colour if name in styles else "black"
        series.append(pictures.Series(x=np.full(2, float(place)), y=np.array([low, high]), colour=colour))
        series.append(
            pictures.Series(x=np.array([float(place)]), y=np.array([value]), colour=colour, line="points")
        )
    return series, [float(place) for place in range(len(names))]


def points_of(
    table: pd.DataFrame, names: Sequence[str], by: str, column: str, styles: Mapping[str, Style]
) -> list[pictures.Series]:
    """A point with its interval for each method at each of some conditions, the methods side by side."""
    rows = table.set_index([by, "method"])
    series: list[pictures.Series] = []
    for number, (method, style) in enumerate(styles.items()):
        aside = 0.5 * (number / max(len(styles) - 1, 1) - 0.5)
        x = np.arange(len(names)) + aside
        value, low, high = (
            np.array([float(rows.at[(name, method), column + end]) for name in names])
            for end in ("", "_low", "_high")
        )
        series.append(
            pictures.Series(
                x=np.repeat(x, 2),
                y=np.stack([low, high], axis=1).ravel(),
                units=np.repeat(np.arange(len(names)), 2),
                colour=style.colour,
            )
        )
        series.append(pictures.Series(x=x, y=value, label=style.label, colour=style.colour, line="points"))
    return series


def one_row(interval: Interval, name: str) -> dict[str, float]:
    """The columns of an interval of one number."""
    return {column: float(values[0]) for column, values in interval.columns(name).items()}
