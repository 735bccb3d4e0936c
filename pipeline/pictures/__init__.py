"""Printed pictures of the figures, each as an SVG and a PNG; the only package that imports matplotlib.

The same input gives the same bytes on every run.  All sizes, letters and line widths are in `pipeline.pictures.style`,
all colours in `pipeline.palette`; what is drawn is described by `pipeline.charts` and `pipeline.scenes`.  Matplotlib
takes long to import, and few commands draw: each module is imported by its own name, where something is drawn.

================  ==================================================================================
`picture`         what the `draw` of a figure is given
`charts`          charts in panels, from tidy tables
`postures`        rows of stick figures, original and reconstructed
`walking`         a walker who walks: what a camera sees, and his reconstruction turning (SVG)
`tallies`         counts in rows of bars, a colour to each kind
`embedding`       a picture that is drawn, reduced: as text inside a page, or its bytes
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
