"""Axes that figures of walks share."""

from __future__ import annotations

from typing import Any

from pipeline.charts import Axis

VIEW: dict[str, Any] = {"x": "view_angle_deg", "abscissa": Axis(ticks=30)}
"""The abscissa of charts over the view angle."""
