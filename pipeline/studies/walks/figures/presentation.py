"""How figures of walks name and draw the two approaches, and what they are held against."""

from __future__ import annotations

from dataclasses import replace

from pipeline.palette import Style

METHODS = {
    "least_squares": Style("approach I (least squares)", "least_squares"),
    "map": Style("approach II (MAP)", "map", line="dashed"),
}

NULLS = {
    "average_walker": Style("average walker", "null", line="dotted", banded=False),
    "least_squares_1": Style("one eigenwalker, least squares", "amber", line="dotted", banded=False),
    "map_1": Style("one eigenwalker, MAP", "sky", line="dotted", banded=False),
}
"""Reconstructions that do next to nothing."""

TRIED = {**METHODS, "anatomical": Style("anatomical", "green")}
"""The papers' approaches and the third one."""

CURVES = {**TRIED, **NULLS}

UNNAMED = {name: replace(style, label="") for name, style in TRIED.items()}
"""For a second band around the same lines."""

VIEW_AXIS = "Viewpoint (degree)"
