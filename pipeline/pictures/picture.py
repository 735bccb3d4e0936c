"""The picture of one figure, which its `draw` is given: charts, or what is no chart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.charts import Sheet
from pipeline.pictures.charts import draw_charts
from pipeline.pictures.matrix import draw_heat_map
from pipeline.pictures.motions import draw_motion
from pipeline.pictures.postures import draw_postures
from pipeline.pictures.skeletons import draw_skeletons
from pipeline.pictures.stick_figures import Bones
from pipeline.scenes import HeatMap, MotionScene, PostureRow, SkeletonRow


@dataclass(frozen=True)
class Picture:
    """A picture to be drawn; the first method that is called writes it.

    Attributes
    ----------
    path_stem : Path
        Without a suffix.
    caption : str
        Kept in the files; what is read stands as text beside the picture.
    sheet : Sheet
        The charts of the figure.
    tables : mapping of str to table
    """

    path_stem: Path
    caption: str
    sheet: Sheet
    tables: Mapping[str, Any]

    def charts(self) -> None:
        """Draw the charts."""
        draw_charts(self.path_stem, self.sheet, self.tables, caption=self.caption)

    def heat_map(self, matrix: HeatMap) -> None:
        """Draw a matrix, with the charts beside it."""
        draw_heat_map(self.path_stem, matrix, self.sheet, self.tables, caption=self.caption)

    def postures(self, groups: Sequence[tuple[str, Sequence[PostureRow]]], bones: Bones) -> None:
        """Draw rows of postures, as `draw_postures`."""
        draw_postures(self.path_stem, groups, bones, caption=self.caption)

    def skeletons(self, rows: Sequence[SkeletonRow], bones: Bones, *, legend: tuple[str, str]) -> None:
        """Draw rows of skeletons, as `draw_skeletons`."""
        draw_skeletons(self.path_stem, rows, bones, legend=legend, caption=self.caption)

    def motion(self, scene: MotionScene, bones: Bones) -> None:
        """Draw one motion with the charts below it, as `draw_motion`."""
        draw_motion(self.path_stem, scene, bones, self.sheet, self.tables, caption=self.caption)
