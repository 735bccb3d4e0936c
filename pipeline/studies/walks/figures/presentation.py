"""How figures of walks name and draw the two approaches."""

from __future__ import annotations

from pipeline.palette import Style

METHODS = {
    "least_squares": Style("approach I (least squares)", "least_squares"),
    "map": Style("approach II (MAP)", "map", line="dashed"),
}

VIEW_AXIS = "Viewpoint (degree)"
