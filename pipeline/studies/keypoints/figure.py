"""Errors of walks from keypoints by the direction of the walk, and coverage of their bars."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast

import pandas as pd

from pipeline import pictures
from pipeline.studies.figure_inputs import tidy
from pipeline.studies.keypoints.headings import KeypointHeadings
from pipeline.studies.keypoints.measured import ERRORS, LEVELS_PERCENT, VERDICTS
from pipeline.studies.keypoints.model import KeypointWalkersModel
from pipeline.studies.keypoints.shown import METHODS, Inputs, record_shown
from pipeline.studies.keypoints.tables import errors_by, views_by
from pipeline.studies.study import Figure

HEADING_AXIS = "Heading (degree; 0: towards the camera)"


@dataclass(kw_only=True)
class KeypointHeadingsFigure(Figure):
    """Error and coverage by heading."""

    model = KeypointWalkersModel
    sweep = KeypointHeadings

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """``table``: errors by heading and method; ``table_views``: view, cadence, coverage; ``table_clips``: clips.

        Headings to either side are pooled; an angle's error is the mean over clips of its root mean square.
        """
        clips = inputs.sweep.clips.drop(columns=["condition", *VERDICTS])
        by = ["heading_deg", "method"]
        people = inputs.sweep.people[["person", *by, *ERRORS]]
        people = people.assign(heading_deg=people["heading_deg"].abs())
        return {
            "table": tidy(errors_by(people, by), by=by),
            "table_views": tidy(views_by(clips, clips["heading_deg"].abs()), by=["heading_deg"]),
            "table_clips": tidy(clips, by=["person", "walk", "heading_deg", "overground"]),
            "table_people": tidy(people, by=["person", *by]),
        }

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Errors of joints and knees by heading; view error of every clip; coverage of bars."""
        options = cast(KeypointHeadings, inputs.experiment.sweep)
        views = tables["table_views"]
        clips = tables["table_clips"]
        headings = views["heading_deg"].to_numpy()
        ticks = headings.tolist()
        coverage = [
            pictures.Series(
                x=headings,
                y=views[f"covered_{p}{kind}_percent"].to_numpy(),
                label=label,
                colour=colour,
                line=line,
            )
            for p in LEVELS_PERCENT
            for kind, label, colour, line in (
                ("", "calibrated on others" if p == LEVELS_PERCENT[0] else "", "map", "solid"),
                ("_raw", "as computed" if p == LEVELS_PERCENT[0] else "", "null", "dotted"),
            )
        ]
        panels = [
            pictures.Panel(
                y=column, band=(f"{column}_low", f"{column}_high"), ylabel=label, from_zero=True, xticks=ticks,
                legend=named,
            )
            for column, label, named in (
                ("error_mm", "Error of joints (mm)", ("keypoint_walk", "average_walker")),
                ("knee_error_deg", "Error of knees (degree)", ("image_kept",)),
            )
        ]  # fmt: skip
        panels += [
            pictures.Panel(
                series=[
                    pictures.Series(
                        x=headings, y=views["view_error_median_deg"].to_numpy(), label="median", colour="map",
                    ),
                    pictures.Series(
                        x=headings, y=views["view_error_90_deg"].to_numpy(), label="90 % of clips", colour="map",
                        line="dashed",
                    ),
                ],
                ylabel="Error of the view (degree)",
                xticks=ticks,
                from_zero=True,
            ),
            pictures.Panel(
                series=coverage,
                ylabel="Covered by bars (%)",
                xticks=ticks,
                ylim=(0.0, 100.0),
                references=[("y", float(p), f"{p} %") for p in LEVELS_PERCENT],
            ),
        ]  # fmt: skip
        table = tables["table"].copy()
        for name in ("error_mm", "knee_error_deg"):  # a single person has no interval
            for end in ("low", "high"):
                table[f"{name}_{end}"] = table[f"{name}_{end}"].fillna(table[name])
        pictures.draw_lines(
            stem, panels, table, x="heading_deg", by="method", styles=METHODS, columns=2,
            xlabel=HEADING_AXIS,
            caption=f"{inputs.caption} {len(clips)} simulated clips of people whom the model does not know:"
            f" perspective, white and slow error, a bias of {options.bias_mm:g} mm of each joint, missing and"
            " exchanged keypoints; distance, path, view, phase and cadence unknown; overground and on a treadmill,"
            " either side. Bands: 95 % over people. Bars: of 50, 80 and 95 %.",
        )  # fmt: skip

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Log the clip of median error: image and reprojection, truth, reconstruction and average walker."""
        record_shown(inputs, folder)
