"""Pictures of the figures as SVG and PNG files; the only package that imports matplotlib.

The same input gives the same bytes on every run.  All sizes, letters and line widths are in `pipeline.pictures.style`,
all colours in `pipeline.palette`; `pipeline.charts` and `pipeline.scenes` describe the content.  Matplotlib is slow to
import and few commands draw, so each module is imported where it draws.

================  ==================================================================================
`picture`         the argument of a figure's `draw`
`charts`          charts in panels, from tidy tables
`postures`        rows of stick figures, original and reconstructed
`walking`         an animated walker: the camera's image, and the turning reconstruction (SVG)
`tallies`         counts in rows of bars, a colour for each kind
`embedding`       finished pictures, reduced: as text inside a page, or as bytes
================  ==================================================================================

>>> from pipeline.charts import Axis, Chart, Sheet
>>> from pipeline.palette import Style
>>> from pipeline.pictures.charts import draw_charts
>>> from pipeline.pictures.style import Canvas
>>> METHODS = {"least_squares": Style("approach I", "least_squares"), "map": Style("approach II", "map")}
>>> VIEW = Axis(label="View", unit="°")
>>> CHARTS = Sheet(charts=[
...     Chart(x="view_angle_deg", abscissa=VIEW, y=y, by="method", styles=METHODS, label=label, unit=unit)
...     for y, label, unit in [("absolute_error_mm2", "Absolute error", "mm²"), ("relative_error", "Its share", "")]
... ])
>>> def picture(table, stem):
...     draw_charts(Canvas(stem, CHARTS, {"table": table}))
"""
