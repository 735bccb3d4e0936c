"""Tables of errors in simulated clips, by clip, person, heading or condition."""

from __future__ import annotations

from typing import Any

import pandas as pd

from pipeline.studies.replicated import aggregate
from walk3d.film.study.measured import ERRORS, VERDICTS
from walk3d.film.walk.cycle import EVENTS

TURNED_DEG = 30.0
"""Error of the view, degrees, above which a clip counts as reconstructed from a mistaken view."""
WRONG_CADENCE_PERCENT = 15.0
"""Error of the cadence, per cent, above which the estimate counts as another harmonic of the true cadence."""


def errors_by(people: pd.DataFrame, by: list[str]) -> pd.DataFrame:
    """Return the mean errors of clips for each group of table rows, with confidence intervals over people."""
    means = {name: (name, "mean") for name in ERRORS}
    table = aggregate(people, by, means, ERRORS, cluster="person", count="clips")
    return table[[*by, "clips", *(f"{name}{end}" for name in ERRORS for end in ("", "_low", "_high"))]]


def views_by(clips: pd.DataFrame, group: pd.Series) -> list[dict[str, Any]]:
    """Return a table row for each group of clips, with errors of view and cadence, and coverage of error bars."""
    rows = []
    for key, part in clips.groupby(group, sort=True):
        off, cadence = part["view_distance_deg"], part["cadence_error_percent"].abs()
        rows.append(
            {
                group.name: key,
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
