"""Measures that only the tables of walks ask for: zhang2004 and zhang2007."""

from __future__ import annotations

import numpy as np

from pipeline.studies.measures import Expression, Table, distinct, mean, ratio, values

BANDS_DEG = {"frontal": (0.0, 10.0), "oblique": (30.0, 60.0), "profile": (80.0, 90.0)}
"""Bands of the view angle, degrees either side of the frontal view, the same for every claim: the papers name these
views without limits."""


def representation_length(
    joints_table: Table, harmonics_table: Table, coordinates: int, frequency: bool = False
) -> float:
    """Length of a Fourier representation: joints × coordinates × (1 + 2 harmonics), as the tables name them.

    With `frequency` one more where the table of harmonics has a column ``frequency_hz``.
    """
    blocks = 1.0 + 2.0 * distinct(harmonics_table, ["harmonic"])
    return distinct(joints_table, ["joint"]) * coordinates * blocks + float(
        frequency and "frequency_hz" in harmonics_table.columns
    )


def mean_in_band(table: Table, column: str, method: str, band: str) -> float:
    """Mean of a column over the views of a band, left and right alike."""
    low, high = BANDS_DEG[band]
    rows = f"method == {method!r} and abs(view_angle_deg) >= {low} and abs(view_angle_deg) <= {high}"
    return mean(table, column, Expression(rows))


def asymmetry_percent(table: Table, column: str, method: str) -> float:
    """Mean |f(−α) − f(α)| over the oblique pairs (0 < α < 90), in per cent of the mean of f over them."""
    chosen = f"method == {method!r}"
    curve = dict(zip(values(table, "view_angle_deg", chosen), values(table, column, chosen), strict=True))
    if len(curve) < len(values(table, column, chosen)):
        return np.nan  # an angle stands twice
    pairs = np.array([(curve[-a], curve[a]) for a in curve if 0.0 < a < 90.0 and -a in curve]).reshape(-1, 2)
    return (
        100.0 * ratio(float(np.abs(pairs[:, 0] - pairs[:, 1]).mean()), float(pairs.mean()))
        if len(pairs)
        else np.nan
    )


def angle_bias_deg(table: Table, method: str) -> float:
    """Mean over the views of |mean estimated angle − true angle|, the short way round the circle."""
    chosen = f"method == {method!r}"
    off = values(table, "estimated_mean_deg", chosen) - values(table, "view_angle_deg", chosen)
    return float(np.abs((off + 180.0) % 360.0 - 180.0).mean()) if off.size else np.nan
