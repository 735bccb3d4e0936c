"""Error of limbs against the error of the parent or of the radius: park2011 figures 3b, 3c and 3d.

This module has the figures of one limb; whole skeletons with missing points are in `missing_data`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, cast

import pandas as pd

from pipeline.charts import Axis, Chart, Lines, Reference, Sheet
from pipeline.core.articulation.hits import ROBUST_QUANTILE
from pipeline.palette import Style, colour_name
from pipeline.studies.figure_inputs import sd, tidy
from pipeline.studies.limbs.baselines import STYLES as BASELINE_STYLES
from pipeline.studies.limbs.figures.limb_on_sphere import Inputs, record_on_sphere
from pipeline.studies.limbs.model import TrajectoryBasisModel
from pipeline.studies.limbs.one_limb import STYLES, RadiusScaleSweep, RootErrorSweep
from pipeline.studies.limbs.scores import MIN_DRAWN
from pipeline.studies.replicated import aggregate, interval_words
from pipeline.studies.study import Figure, Recorder, Tables

BASELINES = ("hanging_error", "mean_pose_error")
"""Names of the table columns with the errors of the baselines."""

ADJUSTED_BASELINE = "adjusted_hanging_error"
"""Table column with the error of a hanging limb whose length is adjusted to the rays of its image points."""

BASELINE_MEDIANS = {f"{name}_median": (name, "median") for name in BASELINES}

ROOT = "root_error_ratio"

PUBLISHED_ROOT = [
    Reference(x="park2011_small_root_error_reliable", label="reliable"),
    Reference(x="park2011_large_root_error_unreliable", label="unreliable"),
]
PUBLISHED_RADIUS = [
    Reference(x="park2011_small_radius_reliable", label="reliable"),
    Reference(x=1.0),
    Reference(x="park2011_large_radius_unreliable", label="unreliable"),
]

BASELINE_WORDS = (
    f"{colour_name('baseline').capitalize()}, medians of baselines: a limb of the {{length}} length that hangs straight"
    " down (dotted), and one that keeps its true mean direction (dashed)."
)


class RootErrorFigure(Figure):
    """Figure of the error of a limb, and of its standard deviation, against the error of its parent."""

    model = TrajectoryBasisModel
    sweep = RootErrorSweep

    def tables(self, inputs: Inputs) -> Tables:
        """Return tables of single trials and of statistics over trials, for the first camera and for all cameras."""
        rows = inputs.sweep.rows
        above = rows.assign(above_parent=rows["child_error_ratio"] > rows["parent_error_ratio"])
        cameras = aggregate(
            above,
            ["camera", "root_error_ratio"],
            {
                **_quartile_columns("child_error", "child_error_ratio"),
                "child_error_sd": ("child_error_ratio", sd),
                "share_above_parent_error": ("above_parent", "mean"),
                "limb_error_median": ("limb_error", "median"),
                "error_up_to_mirror_median": ("error_up_to_mirror", "median"),
                **BASELINE_MEDIANS,
            },
            ["child_error_median", *BASELINE_MEDIANS],
        )
        errors = ["child_error_ratio", "parent_error_ratio", "limb_error", "error_up_to_mirror"]
        return _tables(rows, cameras, ["root_error_ratio"], errors)

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Charts of a limb's error, and of its standard deviation over trials, against the parent's error."""
        options = cast(RootErrorSweep, inputs.experiment.sweep)
        first, *others = options.cameras
        styles = {
            str(c): Style(c.words, c.colour, line="solid" if c is first else "dashed", banded=c is first)
            for c in options.cameras
        }
        parent = Lines(
            table="table_points",
            y=ROOT,
            styles={"parent": Style("error of the parent", "purple", line="dotted")},
        )
        against = partial(
            Chart, table="table_cameras", x=ROOT, abscissa=Axis(label="error of the parent / limb length"), by="camera",
            styles=styles, zero=True, references=PUBLISHED_ROOT,
        )  # fmt: skip
        charts = [
            against(
                y="child_error_median",
                band=("child_error_low", "child_error_high"),
                name="child_error",
                label="3D error / limb length",
                timeline="root_error_per_mille",
                also=[parent, *_baseline_lines()],
            ),
            against(y="child_error_sd", label="standard deviation of the 3D error"),
        ]
        return Sheet(
            charts=charts,
            columns=2,
            caption=f"{_trials(options)} (a) Median from a {first} camera"
            + (f", and from a {' or '.join(others)} one (dashed)" if others else "")
            + f"; light band: quartiles of the trials from the {first} one. {_interval_words(tables)}"
            f" {BASELINE_WORDS.format(length='assumed')} (b) Over trials.",
        )

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record the median error of each camera, the error of the parent, and one limb on its sphere."""
        record_on_sphere(inputs, begin, "root_error_per_mille", ROOT)


class RadiusScaleFigure(Figure):
    """Figure of the error of a limb against its assumed radius, relative to the true radius."""

    model = TrajectoryBasisModel
    sweep = RadiusScaleSweep

    def tables(self, inputs: Inputs) -> Tables:
        """Return tables of single trials and of statistics over trials, for the first camera and for all cameras."""
        rows, swept = inputs.sweep.rows, ["radius_scale", "adjust"]
        medians = {**BASELINE_MEDIANS, f"{ADJUSTED_BASELINE}_median": (ADJUSTED_BASELINE, "median")}
        cameras = aggregate(
            rows,
            ["camera", *swept],
            {
                **_quartile_columns("limb_error", "limb_error"),
                "adjusted_share": ("adjusted_share", "mean"),
                "error_up_to_mirror_median": ("error_up_to_mirror", "median"),
                **medians,
            },
            ["limb_error_median", *medians],
        )
        errors = ["limb_error", "error_up_to_mirror", "radius_ratio", ADJUSTED_BASELINE]
        return _tables(rows, cameras, swept, errors)

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Charts of the error of a limb against its assumed radius, with one panel for each camera."""
        options = cast(RadiusScaleSweep, inputs.experiment.sweep)
        first = options.ways[0]
        styles = {way: STYLES[way] for way in options.ways}
        charts = [
            Chart(
                table="table_cameras", x="radius_scale", abscissa=Axis(label="assumed radius / true radius", log=True),
                y="limb_error_median", band=("limb_error_low", "limb_error_high"), by="adjust", styles=styles,
                where={"camera": str(camera)}, label=f"3D error / limb length, {camera.words}",
                log_y=True, least=MIN_DRAWN,
                name="limb_error", timeline="log10_scale_per_mille" if camera is options.cameras[0] else "",
                references=PUBLISHED_RADIUS,
                also=_baseline_lines(
                    (ADJUSTED_BASELINE, "mean_pose_error"), table="table_cameras",
                    where={"camera": str(camera), "adjust": str(first)},
                ),
            )
            for camera in options.cameras
        ]  # fmt: skip
        return Sheet(
            charts=charts,
            columns=2,
            caption=f"{_trials(options)} Lines: median for each way of adjusting the radius to rays that miss"
            f" the sphere"
            f" (as long as the farthest ray asks for; as {100.0 * ROBUST_QUANTILE:g} % of the rays ask for;"
            " longer in a frame alone), and"
            " refined:"
            " from the first of these, with the trajectory, as in the paper; light band: quartiles of the trials of the"
            f" first. {_interval_words(tables)} {BASELINE_WORDS.format(length='adjusted')}",
        )

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record the first camera's median error against the assumed radius, and the path of one limb on its sphere."""
        record_on_sphere(inputs, begin, "log10_scale_per_mille", "radius_scale")


def _quartile_columns(name: str, column: str) -> dict[str, Any]:
    """Return the aggregations that give the median, lower quartile and upper quartile of a column.

    Parameters
    ----------
    name : str
        Name of the new columns, before ``_median``, ``_low`` and ``_high``.
    column : str
        Column that is aggregated.
    """
    quartiles = {"low": 0.25, "high": 0.75}
    return {
        f"{name}_median": (column, "median"),
        **{f"{name}_{end}": (column, partial(pd.Series.quantile, q=q)) for end, q in quartiles.items()},
    }


def _tables(rows: pd.DataFrame, cameras: pd.DataFrame, swept: Sequence[str], errors: Sequence[str]) -> Tables:
    """Tables of single trials and of statistics over trials, for the first camera and for all cameras."""
    every, first = tidy(rows, by=["trial", *swept]), rows["camera"][0]
    return {
        "table": every[every["camera"] == first],
        "table_trials": every[["trial", "clip", "limb", "camera", *swept, *errors, *BASELINES]],
        "table_points": cameras[cameras["camera"] == first].reset_index(drop=True),
        "table_cameras": cameras,
    }


def _baseline_lines(names: Sequence[str] = BASELINES, **rows: Any) -> list[Lines]:
    """Chart lines with the median error of each baseline against the varied quantity."""
    return [
        Lines(
            **{"table": "table_points", **rows},
            y=f"{name}_median",
            styles={name: style},
        )
        for name, style in zip(names, BASELINE_STYLES, strict=True)
    ]


def _interval_words(tables: Mapping[str, pd.DataFrame]) -> str:
    """Caption sentence that explains the bands around the median curves."""
    clips = tables["table_trials"]["clip"].nunique()
    return interval_words(clips, of="median", over="clips", bands="Bands along the lines")


def _trials(sweep: RootErrorSweep | RadiusScaleSweep) -> str:
    """Caption sentences on the number of trials, the camera's distance, the image noise and the error."""
    noise = f"noise of {sweep.noise_px:g} px" if sweep.noise_px else "no noise"
    return (
        f"{sweep.trials} limbs at every point, {sweep.distance_mm / 1000:g} m from the camera, {noise}. Error: mean "
        "distance over the limb's length."
    )
