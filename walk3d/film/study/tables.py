"""Tables of simulated clips: each clip, each person, and both by heading or by condition."""

from __future__ import annotations

from typing import Any

import pandas as pd

from pipeline.studies.replicated import aggregate
from walk3d.film.study.measured import ERRORS, VERDICTS
from walk3d.film.walk.cycle import EVENTS

TURNED_DEG = 30.0
"""A view that is farther off has been mistaken for another."""
WRONG_CADENCE_PERCENT = 15.0
"""A frequency that is farther off is another harmonic's."""


def errors_by(people: pd.DataFrame, by: list[str]) -> pd.DataFrame:
    """Mean errors over clips, with their intervals over people, by some columns."""
    means = {name: (name, "mean") for name in ERRORS}
    table = aggregate(people, by, means, ERRORS, cluster="person", count="clips")
    return table[[*by, "clips", *(f"{name}{end}" for name in ERRORS for end in ("", "_low", "_high"))]]


def views_by(clips: pd.DataFrame, of: pd.Series) -> list[dict[str, Any]]:
    """Errors of view and cadence, and coverage, of clips grouped by a column."""
    rows = []
    for key, part in clips.groupby(of, sort=True):
        off, cadence = part["view_distance_deg"], part["cadence_error_percent"].abs()
        rows.append(
            {
                of.name: key,
                "clips": len(part),
                "view_error_median_deg": off.median(),
                "view_error_90_deg": off.quantile(0.9),
                "view_error_worst_deg": off.max(),
                "turned_percent": 100.0 * (off > TURNED_DEG).mean(),
                "cadence_error_median_percent": cadence.median(),
                "wrong_cadence_percent": 100.0 * (cadence > WRONG_CADENCE_PERCENT).mean(),
                **{f"{event}_error_median_ms": part[f"{event}_error_ms"].median() for event in EVENTS},
                **{name: part[name].mean() for name in clips if name.startswith("covered_")},
                **{name: part[name].mean() for name in VERDICTS if name in part},
            }
        )
    return rows
