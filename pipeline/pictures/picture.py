"""Class for the picture of one figure, with methods that draw charts, heat maps, postures, skeletons and motions."""

from __future__ import annotations

from pipeline.pictures.charts import draw_charts
from pipeline.pictures.matrix import draw_heat_map
from pipeline.pictures.motions import draw_motion
from pipeline.pictures.postures import draw_postures
from pipeline.pictures.skeletons import draw_skeletons
from pipeline.pictures.style import Canvas


class Picture(Canvas):
    """A picture that is drawn lazily: the first call to any of its methods writes the files."""

    charts = draw_charts
    heat_map = draw_heat_map
    postures = draw_postures
    skeletons = draw_skeletons
    motion = draw_motion
