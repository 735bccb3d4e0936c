"""Error of the trials against what is swept, with bands: park2011 figures 3b, 3c and 3d.

Root error and radius scale, of one limb, are here; a whole skeleton with missing points is in `missing_data`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd

from pipeline import pictures
from pipeline.studies.experiment import Experiment
from pipeline.studies.figure_inputs import FigureInputs, sd, tidy
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.figures.limb_on_sphere import record_on_sphere
from pipeline.studies.limbs.figures.missing_data import MissingDataFigure
from pipeline.studies.limbs.figures.presentation import (
    ADJUST_COLOURS,
    ADJUST_NAMES,
    LEAST,
    quartile_columns,
)
from pipeline.studies.limbs.model import BasisFit, TrajectoryBasisModel
from pipeline.studies.limbs.radius_scale import RadiusScaleSweep
from pipeline.studies.limbs.root_error import RootErrorSweep
from pipeline.studies.limbs.swept_errors import ErrorSweep, SweptErrors
from pipeline.studies.presentation import interval_words
from pipeline.studies.replicated import aggregate
from pipeline.studies.study import Figure

Inputs = FigureInputs[LimbStretches, BasisFit, SweptErrors]

NULLS = ("hanging_error", "mean_pose_error")
"""Errors of limbs that do nothing, as `nulls.limb_errors`."""

ADJUSTED_NULL = "adjusted_hanging_error"
"""The first of them with the length that rays ask for, as the figure of the radius gives it to the method."""

NULL_MEDIANS = {f"{name}_median": (name, "median") for name in NULLS}

NULL_LABELS = ("hangs straight down", "mean pose")

NULL_WORDS = (
    "Grey, medians of what does nothing: a limb of the {length} length that hangs straight down (dotted), and one that "
    "keeps its true mean direction (dashed)."
)


@dataclass(kw_only=True)
class LimbErrors(Figure):
    """Error of the trials against what is swept, whatever that is."""

    model = TrajectoryBasisModel
    sweep = ErrorSweep

    def validate(self, experiment: Experiment) -> None:
        """Validate the options against the rest of the experiment.  Raises InvalidInput if they do not fit."""
        sweep, model = cast(ErrorSweep, experiment.sweep), cast(TrajectoryBasisModel, experiment.model)
        if sweep.in_the_basis:
            model.fixed_basis()

    def tables(self, inputs: FigureInputs) -> dict[str, pd.DataFrame]:
        """Return ``table``: trials before the first camera; ``table_points``: over them; and others of each sweep."""
        return self._of(inputs).tables(inputs)

    def draw(self, inputs: FigureInputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Draw the error against what is swept."""
        self._of(inputs).draw(inputs, tables, stem)

    def record(self, inputs: FigureInputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Log the error, and a limb on its sphere or a skeleton with missing points."""
        self._of(inputs).record(inputs, tables, folder)

    def _of(self, inputs: FigureInputs) -> Figure:
        kinds = (RootErrorFigure, RadiusScaleFigure, MissingDataFigure)
        return next(kind() for kind in kinds if isinstance(inputs.experiment.sweep, kind.sweep))


@dataclass(kw_only=True)
class RootErrorFigure(Figure):
    """Error of a limb against that of its parent, and its spread."""

    model = TrajectoryBasisModel
    sweep = RootErrorSweep

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """Return ``table``, ``table_points``: before the first camera; ``table_cameras``: before all."""
        rows = inputs.sweep.rows
        above = rows.assign(above_parent=rows["child_error_ratio"] > rows["parent_error_ratio"])
        cameras = aggregate(
            above,
            ["camera", "root_error_ratio"],
            {
                **quartile_columns("child_error", "child_error_ratio"),
                "child_error_sd": ("child_error_ratio", lambda ratios: sd(ratios.to_numpy(), 0)),
                "share_above_parent_error": ("above_parent", "mean"),
                "limb_error_median": ("limb_error", "median"),
                "error_up_to_mirror_median": ("error_up_to_mirror", "median"),
                **NULL_MEDIANS,
            },
            ["child_error_median", *NULL_MEDIANS],
        )
        errors = ["child_error_ratio", "parent_error_ratio", "limb_error", "error_up_to_mirror"]
        return _tables(rows, cameras, ["root_error_ratio"], errors)

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Draw the error against that of the parent, and its standard deviation over trials."""
        options = cast(RootErrorSweep, inputs.experiment.sweep)
        ratios = np.array(options.ratios)
        first, *others = options.cameras
        styles = {
            str(camera): pictures.Style(
                camera, camera.colour, line="solid" if camera is first else "dashed", banded=camera is first
            )
            for camera in options.cameras
        }
        parent = pictures.Series(x=ratios, y=ratios, label="parent", colour="null", line="dotted")
        panel = partial(pictures.Panel, from_zero=True)
        pictures.draw_lines(
            stem,
            [
                panel(
                    y="child_error_median",
                    band=("child_error_low", "child_error_high"),
                    ylabel="3D error / limb length",
                    series=[
                        *pictures.intervals(
                            tables["table_cameras"],
                            x="root_error_ratio",
                            y="child_error_median",
                            by="camera",
                            styles=styles,
                        ),
                        parent,
                        *_null_lines(tables["table_points"], "root_error_ratio"),
                    ],
                ),
                panel(y="child_error_sd", ylabel="Its standard deviation"),
            ],
            tables["table_cameras"],
            x="root_error_ratio",
            by="camera",
            styles=styles,
            xlabel=r"Error of the parent $r_e$ / limb length $r_a$",
            legend="figure",
            columns=2,
            caption=f"{inputs.caption} {_trials(options)} (a) Median from a {first} camera"
            + (f", and from a {' or '.join(others)} one (dashed)" if others else "")
            + f"; light band: quartiles of the trials from the {first} one; dotted: the error of the parent itself. "
            f"{_interval_words(tables)} {NULL_WORDS.format(length='assumed')} (b) Over trials.",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Log the median error from every camera and the error of the parent, and the limb that is shown."""
        table, cameras = tables["table_cameras"], cast(RootErrorSweep, inputs.experiment.sweep).cameras
        parent = tables["table_points"].assign(camera="parent")
        parent["child_error_median"] = parent["root_error_ratio"]
        curves = pd.concat([table, parent], ignore_index=True)
        record_on_sphere(
            inputs,
            folder,
            {
                "root_error_per_mille": np.rint(1000 * curves["root_error_ratio"]),
                "child_error": curves["child_error_median"],
                **{
                    f"child_error_{end}": curves[f"child_error_median_{end}"].where(
                        curves["camera"] != "parent"
                    )
                    for end in ("low", "high")
                },
                "camera": curves["camera"],
            },
            by="camera",
            styles={
                **{camera: pictures.Style(camera.words, camera.colour) for camera in cameras},
                "parent": pictures.Style("error of the parent", "null"),
            },
            plot="median error / limb length over 1000 x root error / limb length",
        )


@dataclass(kw_only=True)
class RadiusScaleFigure(Figure):
    """Error of a limb against the scale of its radius."""

    model = TrajectoryBasisModel
    sweep = RadiusScaleSweep

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """Return ``table``, ``table_points``: before the first camera; ``table_cameras``: before all."""
        rows, swept = inputs.sweep.rows, ["radius_scale", "adjust"]
        medians = {**NULL_MEDIANS, f"{ADJUSTED_NULL}_median": (ADJUSTED_NULL, "median")}
        cameras = aggregate(
            rows,
            ["camera", *swept],
            {
                **quartile_columns("limb_error", "limb_error"),
                "adjusted_share": ("adjusted_share", "mean"),
                "error_up_to_mirror_median": ("error_up_to_mirror", "median"),
                **medians,
            },
            ["limb_error_median", *medians],
        )
        errors = ["limb_error", "error_up_to_mirror", "radius_ratio", ADJUSTED_NULL]
        return _tables(rows, cameras, swept, errors)

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Draw the error against the scale of the radius, a panel to a camera."""
        options, table = cast(RadiusScaleSweep, inputs.experiment.sweep), tables["table_cameras"]
        ends = [f"limb_error_{end}" for end in ("median", "low", "high", "median_low", "median_high")]
        table = table.assign(**{end: table[end].clip(lower=LEAST) for end in ends})
        first = options.ways[0]
        styles: dict[str, pictures.Style] = {
            adjust: pictures.Style(
                adjust.replace("_", " "),
                ADJUST_COLOURS[adjust],
                line="solid" if adjust is first else "dashed",
                banded=adjust is first,
            )
            for adjust in options.ways
        }
        panels = [
            pictures.Panel(
                y=ends[0],
                band=(ends[1], ends[2]),
                where={"camera": camera},
                ylabel=f"3D error / limb length, {camera.words}",
                xscale="log",
                yscale="log",
                references=[("x", 1.0, ""), ("x", 10.0, "")],
                series=[
                    *pictures.intervals(
                        table,
                        x="radius_scale",
                        y=ends[0],
                        by="adjust",
                        styles=styles,
                        where={"camera": camera},
                    ),
                    *_null_lines(
                        table[(table["camera"] == camera) & (table["adjust"] == first)],
                        "radius_scale",
                        (ADJUSTED_NULL, "mean_pose_error"),
                    ),
                ],
            )
            for camera in options.cameras
        ]
        pictures.draw_lines(
            stem,
            panels,
            table,
            x="radius_scale",
            by="adjust",
            styles=styles,
            xlabel="Assumed radius / true radius",
            legend="figure",
            columns=2,
            caption=f"{inputs.caption} {_trials(options)} Lines: median for each way of adjusting the radius to rays "
            "that miss the sphere (global: as long as the farthest ray asks for; robust: as 95 % of the rays ask for; "
            "per frame: longer in a frame alone), and refined: from the first of these, with the trajectory, as in "
            "the paper; light band: quartiles of the trials of the first. Upright dotted lines: the true radius, and "
            f"ten times that. {_interval_words(tables)} {NULL_WORDS.format(length='adjusted')}",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Log the median error before the first camera over the scale, and the limb that is shown."""
        table = tables["table_points"]
        record_on_sphere(
            inputs,
            folder,
            {
                "log10_scale_per_mille": np.rint(1000 * np.log10(table["radius_scale"])),
                **{
                    f"log10_limb_error{end}": np.log10(table[f"limb_error_median{end}"].clip(lower=LEAST))
                    for end in ("", "_low", "_high")
                },
                "adjust": table["adjust"],
            },
            by="adjust",
            styles={
                adjust: pictures.Style(ADJUST_NAMES[adjust], ADJUST_COLOURS[adjust])
                for adjust in cast(RadiusScaleSweep, inputs.experiment.sweep).ways
            },
            plot="log10 of median error / limb length over 1000 log10 of the scale",
        )


def _tables(
    rows: pd.DataFrame, cameras: pd.DataFrame, swept: Sequence[str], errors: Sequence[str]
) -> dict[str, pd.DataFrame]:
    """Every trial before the first camera, errors before all; over trials before the first, and before all."""
    every, first = tidy(rows, by=["trial", *swept]), rows["camera"][0]
    return {
        "table": every[every["camera"] == first],
        "table_trials": every[["trial", "clip", "limb", "camera", *swept, *errors, *NULLS]],
        "table_points": cameras[cameras["camera"] == first].reset_index(drop=True),
        "table_cameras": cameras,
    }


def _null_lines(table: pd.DataFrame, x: str, names: Sequence[str] = NULLS) -> list[pictures.Series]:
    """Medians of limbs that do nothing, over what is swept: one that hangs, and one in its mean pose."""
    return [
        pictures.Series(
            x=table[x].to_numpy(), y=table[f"{name}_median"].to_numpy(), label=label, colour="null", line=line
        )
        for name, label, line in zip(names, NULL_LABELS, ("dotted", "dashed"), strict=True)
    ]


def _interval_words(tables: Mapping[str, pd.DataFrame]) -> str:
    """What the bands are that lie close to the medians, for captions."""
    clips = tables["table_trials"]["clip"].nunique()
    return interval_words(clips, of="median", over="clips", bands="Bands along the lines")


def _trials(sweep: RootErrorSweep | RadiusScaleSweep) -> str:
    """How many trials, before which camera, without noise or with it, for captions."""
    noise = f"noise of {sweep.noise_px:g} px" if sweep.noise_px else "no noise"
    return (
        f"{sweep.trials} limbs at every point, {sweep.distance_mm / 1000:g} m from the camera, {noise}. Error: mean "
        "distance over the limb's length."
    )
