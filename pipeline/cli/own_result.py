"""One-line result for the user's own recordings, printed at the top of the summary."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline import plugins
from pipeline.storage import tables

MEASURES = {
    "rms_error_mm": ("depth, all views", " mm"),
    "absolute_angle_error_median_deg": ("view angle, median off", "°"),
}
"""Columns of ``table.csv`` that contain the error of each method, with the quantity and unit of the error."""
_WORDS = {"map": "MAP"}
FEW_PEOPLE = 20
"""Number of people below which the summary suggests adding a model learnt from other people."""


def own_result(folder: Path) -> str:
    """Return a line with the number of people and the mean error of each method, from a figure's folder.

    Variants of a method, whose names end in a number, are left out.  Without an error column the line is empty.
    """
    table = tables.read(folder / "table.csv")
    measure = next((name for name in MEASURES if name in table), "")
    if not measure or "method" not in table:
        return ""
    quantity, unit = MEASURES[measure]
    methods = [name for name in dict.fromkeys(table["method"].tolist()) if not name[-1].isdigit()]
    means = {name: np.nanmean(table[measure][table["method"] == name]) for name in methods}
    ordered = sorted(methods, key=lambda name: means[name])
    parts = [f"{_WORDS.get(name, name.replace('_', ' '))} {means[name]:.3g}{unit}" for name in ordered]
    clips = tables.read(folder / "table_ingest.csv")
    people = set(clips["person"][clips["verdict"] == "kept"].tolist()) if "person" in clips else set()
    line = f"{folder.name}: error of {quantity}: {', '.join(parts)}" + (
        f"; {len(people)} people" if people else ""
    )
    if 0 < len(people) < FEW_PEOPLE and (priors := [name for name in plugins.priors() if name not in means]):
        line += f" (few to learn from: model.prior={priors[0]} adds a model of other people)"
    return line
