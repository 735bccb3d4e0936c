"""Charts as plain values: the columns of tables that are drawn, and their axes.

A figure declares its charts once.  `pipeline.pictures` prints them, `pipeline.recordings` logs those whose abscissa is
the recording's timeline, and `pipeline.report` shows them on the page.  Pictures and page have the same lines
(`lines_of`) and the same limits (`ordinate_limits`).  This package uses neither matplotlib nor rerun.

>>> from pipeline.palette import Style
>>> chart = Chart(x="view_angle_deg", y="error_mm", by="method", label="Error", unit="mm", styles={"map": Style("MAP")})
>>> table = {"view_angle_deg": [0, 30], "error_mm": [1.0, 2.0], "method": ["map", "map"]}
>>> [(line.key, line.y.tolist()) for line in lines_of(chart, {"table": table})]
[('map', [1.0, 2.0])]
"""

from pipeline.charts.json_form import from_json, to_json
from pipeline.charts.limits import abscissa_limits, ordinate_limits, with_shared_limits
from pipeline.charts.lines import Ends, Line, lines_of, on_timeline
from pipeline.charts.values import Axis, Chart, Lines, Reference, Sheet

__all__ = [
    "Axis",
    "Chart",
    "Ends",
    "Line",
    "Lines",
    "Reference",
    "Sheet",
    "abscissa_limits",
    "from_json",
    "lines_of",
    "on_timeline",
    "ordinate_limits",
    "to_json",
    "with_shared_limits",
]
