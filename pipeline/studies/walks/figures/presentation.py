"""How figures of walks name and draw the two approaches, and their baselines."""

from __future__ import annotations

from typing import Any

from pipeline.palette import Style

METHODS = {
    "least_squares": Style("approach I (least squares)", "least_squares"),
    "map": Style("approach II (MAP)", "map", line="dashed"),
}

BASELINES = {
    "average_walker": Style("average walker", "baseline", line="dotted", banded=False, interval=False),
    "least_squares_1": Style(
        "one eigenwalker, least squares", "amber", line="dotted", banded=False, interval=False
    ),
    "map_1": Style("one eigenwalker, MAP", "sky", line="dotted", banded=False, interval=False),
}
"""Baselines."""

TRIED = {**METHODS, "anatomical": Style("anatomical", "green")}
"""The papers' approaches and the third one."""

CURVES = {**TRIED, **BASELINES}

VIEW: dict[str, Any] = {"x": "view_angle_deg", "ticks": 30}
"""The abscissa of charts over the view angle."""
