"""Errors of walks from keypoints of a worse film, or with less to reconstruct them with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd

from pipeline import pictures
from pipeline.studies.figure_inputs import tidy
from pipeline.studies.keypoints.changes import KeypointChanges
from pipeline.studies.keypoints.measured import ERRORS, VERDICTS
from pipeline.studies.keypoints.model import KeypointWalkersModel
from pipeline.studies.keypoints.shown import METHODS, Inputs, record_shown
from pipeline.studies.keypoints.tables import errors_by, views_by
from pipeline.studies.study import Figure

PANEL_SIZE = (11.0, 2.4)
"""Inches: the conditions stand below the panels in words."""
MOST_SHOWN = {"error_mm": 80.0, "knee_error_deg": 20.0, "view": 10.0}
"""Ends of the axes: a view taken for another would press all else together."""
COLOURS = {"keypoint_walk": "map", "image_kept": "orange", "average_walker": "null"}


@dataclass(kw_only=True)
class KeypointChangesFigure(Figure):
    """Error, view, coverage and verdicts by condition."""

    model = KeypointWalkersModel
    sweep = KeypointChanges

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """``table``: errors by condition and method; ``table_views``: view, cadence, coverage, verdicts, labels;
        ``table_clips``: clips.
        """
        options = cast(KeypointChanges, inputs.experiment.sweep)
        changes = {"change": "kind", "level": "level"}

        def with_words(rows: pd.DataFrame) -> pd.DataFrame:
            of_row = [options.conditions[number] for number in rows["condition"]]
            return rows.assign(**{n: [getattr(c, of) for c in of_row] for n, of in changes.items()})

        clips, people = with_words(inputs.sweep.clips), with_words(inputs.sweep.people)
        by = ["condition", *changes, "method"]
        views = with_words(pd.DataFrame(views_by(clips, clips["condition"])))
        views = views[["condition", *changes, *views.columns[1:-2]]]
        moved = [*clips.columns[1:-2].difference(VERDICTS, sort=False), "condition", *changes, *VERDICTS]
        columns = ["person", *by, *ERRORS]
        return {
            "table": tidy(errors_by(people, by), by=["condition", "method"]),
            "table_views": tidy(views, by=["condition"]),
            "table_clips": tidy(
                clips[moved], by=["condition", "person", "walk", "heading_deg", "overground"]
            ),
            "table_people": tidy(people[columns], by=["person", "condition", "method"]),
        }

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Errors of joints, knees and view, and coverage of 95 % bars, by condition."""
        options = cast(KeypointChanges, inputs.experiment.sweep)
        views, table = tables["table_views"], tables["table"]
        at = np.arange(len(views), dtype=float)
        ends = (-0.5, len(at) - 0.5)
        below = [" "] * len(at)

        def of_views(columns: Mapping[str, tuple[str, str]]) -> list[pictures.Series]:
            return [
                pictures.Series(x=at, y=views[column].to_numpy(), label=label, colour=colour, line="points")
                for column, (label, colour) in columns.items()
            ]

        panels = [
            pictures.Panel(
                series=[line for method in METHODS for line in _with_intervals(table, column, method, at)],
                ylabel=label, ylim=(0.0, MOST_SHOWN[column]), xticks=at.tolist(), xlim=ends, xwords=below,
            )
            for column, label in (("error_mm", "Joints (mm)"), ("knee_error_deg", "Knees (degree)"))
        ]  # fmt: skip
        panels += [
            pictures.Panel(
                series=of_views(
                    {"view_error_median_deg": ("median", "map"), "view_error_90_deg": ("90 % of clips", "orange")}
                ),
                ylabel="View (degree)", ylim=(0.0, MOST_SHOWN["view"]), xticks=at.tolist(), xlim=ends, xwords=below,
            ),
            pictures.Panel(
                series=of_views(
                    {
                        "covered_95_percent": ("joints within bars of 95 %", "map"),
                        "walk_percent": ("clips judged a walk", "green"),
                        "not_a_walk_percent": ("clips refused", "orange"),
                    }
                ),
                ylabel="Share (%)", ylim=(-4.0, 104.0), xticks=at.tolist(), xlim=ends,
                xwords=[options.conditions[number].name for number in views["condition"].tolist()],
                references=[("y", 95.0, "")],
            ),
        ]  # fmt: skip
        pictures.draw_lines(
            stem, panels, columns=1, panel_size=PANEL_SIZE,
            caption=f"{inputs.caption} {options.takes} simulated clips, the same for every condition, of people whom"
            " the model does not know, from all sides, overground and on a treadmill. Means with 95 % intervals over"
            " people; what lies beyond the axes is in the tables.",
        )  # fmt: skip

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Log the clip of median error under the usual condition."""
        record_shown(inputs, folder)


def _with_intervals(table: pd.DataFrame, column: str, method: str, at: np.ndarray) -> list[pictures.Series]:
    """Means of one method as points, and their intervals; of a single person there is none."""
    rows = table[table["method"] == method]
    ends = rows[[f"{column}_low", f"{column}_high"]].to_numpy()
    known = np.isfinite(ends).all(axis=1)
    points = pictures.Series(
        x=at, y=rows[column].to_numpy(), label=METHODS[method].label, colour=COLOURS[method], line="points"
    )
    if not known.any():
        return [points]
    return [
        points,
        replace(
            points, x=np.repeat(at[known], 2), y=ends[known].ravel(), label="", line="solid",
            units=np.repeat(np.flatnonzero(known), 2),
        ),
    ]  # fmt: skip
