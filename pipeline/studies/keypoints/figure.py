"""Errors of walks from keypoints by the direction of the walk, and coverage of their bars."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd

from pipeline import pictures, recordings
from pipeline.core.keypoint_walk.calibration import ANGLE_KINDS, LEVELS
from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.keypoints.dataset import FilmedWalkers
from pipeline.studies.keypoints.headings import HeadingErrors, KeypointHeadings
from pipeline.studies.keypoints.model import KeypointWalkers, KeypointWalkersModel
from pipeline.studies.replicated import interval_over_people
from pipeline.studies.study import Figure

Inputs = FigureInputs[FilmedWalkers, KeypointWalkers, HeadingErrors]

METHODS = {
    "keypoint_walk": pictures.Style("from keypoints", "map"),
    "image_kept": pictures.Style("image kept, average walker's depth", "null", line="dashed"),
    "average_walker": pictures.Style("average walker", "null", line="dotted"),
}
HEADING_AXIS = "Heading (degree; 0: towards the camera)"
LEVELS_PERCENT = tuple(round(100 * level) for level in LEVELS)
TURNED_DEG = 30.0
"""A view that is farther off has been mistaken for another."""
WRONG_CADENCE_PERCENT = 15.0
"""A frequency that is farther off is another harmonic's."""


@dataclass(kw_only=True)
class KeypointHeadingsFigure(Figure):
    """Error and coverage by heading."""

    model = KeypointWalkersModel
    sweep = KeypointHeadings

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """``table``: errors by heading and method; ``table_views``: view, cadence, coverage; ``table_clips``: clips.

        Headings to either side are pooled; an angle's error is the mean over clips of its root mean square.
        """
        sweep = inputs.sweep
        C, M = sweep.error_mm.shape
        clips = pd.DataFrame(
            {
                "person": sweep.person,
                "walk": sweep.clip,
                "heading_deg": sweep.heading_deg,
                "overground": sweep.overground.astype(int),
                "view_error_deg": sweep.view_error_deg,
                "view_distance_deg": np.abs(sweep.view_error_deg),
                "cadence_error_percent": sweep.cadence_error_percent,
                "residual_percent": sweep.residual_percent,
                **{f"covered_{p}_percent": 100 * sweep.covered[:, k] for k, p in enumerate(LEVELS_PERCENT)},
                **{
                    f"covered_{p}_raw_percent": 100 * sweep.covered_raw[:, k]
                    for k, p in enumerate(LEVELS_PERCENT)
                },
            }
        )
        people = pd.DataFrame(
            {
                "person": np.repeat(sweep.person, M),
                "heading_deg": np.repeat(np.abs(sweep.heading_deg), M),
                "method": np.tile(sweep.methods, C),
                "error_mm": sweep.error_mm.ravel(),
                **{
                    f"{kind}_error_deg": sweep.angle_error_deg[..., k].ravel()
                    for k, kind in enumerate(ANGLE_KINDS)
                },
            }
        )
        columns = ["error_mm", *(f"{kind}_error_deg" for kind in ANGLE_KINDS)]
        rows = []
        for (heading, method), part in people.groupby(["heading_deg", "method"], sort=True):
            low, high = interval_over_people(part["person"].to_numpy(), part[columns].to_numpy())
            row = {"heading_deg": heading, "method": method, "clips": len(part)}
            for k, name in enumerate(columns):
                row |= {name: part[name].mean(), f"{name}_low": low[k], f"{name}_high": high[k]}
            rows.append(row)
        views = []
        for heading, part in clips.groupby(clips["heading_deg"].abs(), sort=True):
            off, cadence = part["view_distance_deg"], part["cadence_error_percent"].abs()
            views.append(
                {
                    "heading_deg": heading,
                    "clips": len(part),
                    "view_error_median_deg": off.median(),
                    "view_error_90_deg": off.quantile(0.9),
                    "view_error_worst_deg": off.max(),
                    "turned_percent": 100.0 * (off > TURNED_DEG).mean(),
                    "cadence_error_median_percent": cadence.median(),
                    "wrong_cadence_percent": 100.0 * (cadence > WRONG_CADENCE_PERCENT).mean(),
                    **{name: part[name].mean() for name in clips if name.startswith("covered_")},
                }
            )
        by = ["person", "walk", "heading_deg", "overground"]
        return {
            "table": tidy(pd.DataFrame(rows).to_dict("list"), by=["heading_deg", "method"]),
            "table_views": tidy(pd.DataFrame(views).to_dict("list"), by=["heading_deg"]),
            "table_clips": tidy(clips.to_dict("list"), by=by),
            "table_people": tidy(people.to_dict("list"), by=["person", "heading_deg", "method"]),
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
        sweep = inputs.sweep
        T = len(sweep.shown_true_mm)
        times = np.arange(T) / sweep.shown_rate_hz
        index = {"time": times}
        words = (
            f"\nA clip of `{sweep.person[sweep.shown]}`, heading {sweep.heading_deg[sweep.shown]:g}°, of median error."
            " Image: keypoints (dots), reprojection (lines). 3D about the pelvis: light: truth, blue: reconstruction,"
            " grey: average walker with the heading and phase that were found.\n"
        )
        bodies = {
            "truth": (sweep.shown_true_mm, "original"),
            "keypoint_walk": (sweep.shown_estimate_mm, "map"),
            "average_walker": (sweep.shown_average_mm, "null"),
        }
        ground = float(sweep.shown_true_mm[..., 1].max())
        flip = np.array([1.0, -1.0])
        with inputs.recording(folder, words) as rec:
            rec.image_points(
                "image/keypoints", sweep.shown_image_px * flip, [(0, 0)], index=index, thickness_mm=4.0
            )
            rec.image_points(
                "image/reprojection", sweep.shown_reprojection_px * flip, WALKER15.bones, index=index, colour="map",
                thickness_mm=2.5,
            )  # fmt: skip
            for name, (level, colour) in bodies.items():
                upright = np.stack([level[..., 0], level[..., 2], ground - level[..., 1]], axis=-1)
                rec.skeleton(f"world/{name}", upright, WALKER15.bones, index=index, colour=colour)
                if name != "truth":
                    off = np.linalg.norm(level - sweep.shown_true_mm, axis=-1).mean(axis=1)
                    rec.curve(f"curves/error_mm/{name}", times, off, label=METHODS[name].label, colour=colour)
            half = sweep.shown_half_mm.mean(axis=1)
            for axis, (name, colour) in enumerate((("right", "sky"), ("down", "green"), ("away", "orange"))):
                rec.curve(
                    f"curves/half_width_95_mm/{name}",
                    times,
                    half[:, axis],
                    label=f"95 % bars, {name}",
                    colour=colour,
                )
            rec.blueprint(
                recordings.Columns(
                    recordings.Image2D(name="image: keypoints, reprojection"),
                    recordings.Space3D(
                        name="truth, reconstruction, average walker", eye_mm=(1800.0, -2200.0, 1400.0)
                    ),
                    recordings.Rows(
                        recordings.Plot(name="error (mm)", origin="curves/error_mm"),
                        recordings.Plot(
                            name="half width of 95 % bars (mm)", origin="curves/half_width_95_mm"
                        ),
                        recordings.Notes(),
                    ),
                    shares=(3, 3, 3),
                ),
                playing=True,
            )
