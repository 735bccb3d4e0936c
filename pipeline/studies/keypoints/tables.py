"""Tables of simulated clips: each clip, each person, and both by heading or by condition."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from pipeline.core.keypoint_walk.calibration import ANGLE_KINDS, LEVELS
from pipeline.core.keypoint_walk.verdict import Verdict
from pipeline.studies.keypoints.measured import FilmedErrors
from pipeline.studies.replicated import interval_over_people

LEVELS_PERCENT = tuple(round(100 * level) for level in LEVELS)
TURNED_DEG = 30.0
"""A view that is farther off has been mistaken for another."""
WRONG_CADENCE_PERCENT = 15.0
"""A frequency that is farther off is another harmonic's."""
ERRORS = ["error_mm", *(f"{kind}_error_deg" for kind in ANGLE_KINDS)]


def clips_of(sweep: FilmedErrors) -> pd.DataFrame:
    """One row for each clip: view, cadence, residual, coverage of bars."""
    return pd.DataFrame(
        {
            "person": sweep.person,
            "walk": sweep.clip,
            "heading_deg": sweep.heading_deg,
            "overground": sweep.overground.astype(int),
            "view_error_deg": sweep.view_error_deg,
            "view_distance_deg": np.abs(sweep.view_error_deg),
            "cadence_error_percent": sweep.cadence_error_percent,
            "residual_percent": sweep.residual_percent,
            **{f"covered_{p}_percent": 100 * sweep.covered[:, k] for k, p in enumerate(LEVELS_PERCENT)},
            **{
                f"covered_{p}_raw_percent": 100 * sweep.covered_raw[:, k]
                for k, p in enumerate(LEVELS_PERCENT)
            },
        }
    )


def people_of(sweep: FilmedErrors, **by: np.ndarray) -> pd.DataFrame:
    """One row for each clip and method: errors of joints and angles; `by` are further columns (C,)."""
    C, M = sweep.error_mm.shape
    return pd.DataFrame(
        {
            "person": np.repeat(sweep.person, M),
            **{name: np.repeat(values, M) for name, values in by.items()},
            "method": np.tile(sweep.methods, C),
            "error_mm": sweep.error_mm.ravel(),
            **{name: sweep.angle_error_deg[..., k].ravel() for k, name in enumerate(ERRORS[1:])},
        }
    )


def errors_by(people: pd.DataFrame, by: list[str]) -> dict[str, list[Any]]:
    """Mean errors over clips, with their intervals over people, by columns of `people_of`."""
    rows = []
    for keys, part in people.groupby(by, sort=True):
        low, high = interval_over_people(part["person"].to_numpy(), part[ERRORS].to_numpy())
        row = dict(zip(by, keys, strict=True)) | {"clips": len(part)}
        for k, name in enumerate(ERRORS):
            row |= {name: part[name].mean(), f"{name}_low": low[k], f"{name}_high": high[k]}
        rows.append(row)
    return pd.DataFrame(rows).to_dict("list")


def views_by(clips: pd.DataFrame, of: pd.Series) -> dict[str, list[Any]]:
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
                **{name: part[name].mean() for name in clips if name.startswith("covered_")},
                **{
                    name: part[name].mean()
                    for name in (*(f"{verdict}_percent" for verdict in Verdict), *LABELS)
                    if name in part
                },
            }
        )
    return pd.DataFrame(rows).to_dict("list")


LABELS = ("labels_right_percent", "labels_unsure_percent", "labels_wrong_unsaid_percent")


def verdicts_of(sweep: FilmedErrors) -> dict[str, np.ndarray]:
    """Verdict and labels of each clip, as 0 or 100 per cent."""
    right, unsure = sweep.labels_right, sweep.labels_unsure
    return {
        **{f"{verdict}_percent": 100.0 * (sweep.verdict == verdict) for verdict in Verdict},
        **dict(zip(LABELS, (100.0 * right, 100.0 * unsure, 100.0 * ~(right | unsure)), strict=True)),
    }
