"""Error of a whole skeleton against the share of missing points: park2011 figure 3d."""

from __future__ import annotations

from functools import partial
from typing import Any, cast

import numpy as np

from pipeline.charts import Axis, Chart, Lines, Reference, Sheet
from pipeline.palette import Style, name_on_dark
from pipeline.scenes import Bars, Columns, Image2D, Notes, Plot, Rows, Space3D, Tabs
from pipeline.studies.figure_inputs import FigureInputs, lift, sd, tidy
from pipeline.studies.limbs.baselines import STYLES as BASELINE_STYLES
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.missing_data import MissingDataErrors, MissingDataSweep, Pattern
from pipeline.studies.limbs.model import BasisFit, TrajectoryBasisModel
from pipeline.studies.limbs.trials import ROOT
from pipeline.studies.replicated import aggregate, interval_words
from pipeline.studies.study import Figure, Recorder, Tables

PATTERN_NAMES = {Pattern.random: "one by one at random", Pattern.block: "runs of frames"}
PATTERN_LABELS = {Pattern.random: "random", Pattern.block: "runs"}
PATTERN_COLOURS = {Pattern.random: "blue", Pattern.block: "orange"}

ESTIMATE_COLOUR, IMPUTED_COLOUR = "blue", "orange"
"""Colours of the reconstructed skeleton and of its points without image in the recording."""

PUBLISHED = Reference(x=0.05, y="park2011_error_with_missing_data", label="published")

BANDED = (
    "relative_error_mean", "relative_error_up_to_mirror_mean", "hanging_relative_error_mean",
    "mean_pose_relative_error_mean", "imputed_error_mm_median", "seen_error_mm_median",
)  # fmt: skip
"""Table columns with means and medians over skeletons, and with confidence intervals over clips."""

Inputs = FigureInputs[LimbStretches, BasisFit, MissingDataErrors]


class MissingDataFigure(Figure):
    """Figure of the error of a whole skeleton against the share of missing points."""

    model = TrajectoryBasisModel
    sweep = MissingDataSweep

    def tables(self, inputs: Inputs) -> Tables:
        """Return ``table`` with every skeleton, and ``table_points`` with statistics over skeletons.

        ``table_hinges``: with knees and elbows that flex one way, at the paper's fraction.
        """
        rows = inputs.sweep.rows
        medians = ("limb_error", "joint_error_mm", "imputed_error_mm", "seen_error_mm")
        means = ("relative_error_up_to_mirror", "hanging_relative_error", "mean_pose_relative_error")
        points = aggregate(
            rows,
            ["missing_fraction", "pattern"],
            {
                "relative_error_mean": ("relative_error", "mean"),
                "relative_error_sd": ("relative_error", sd),
                **{f"{name}_median": (name, "median") for name in medians},
                **{f"{name}_mean": (name, "mean") for name in means},
                "limb_error_up_to_mirror_median": ("limb_error_up_to_mirror", "median"),
            },
            BANDED,
        )
        return {
            "table_hinges": inputs.sweep.hinged,
            "table": tidy(rows, by=["pattern", "missing_fraction", "trial"]),
            "table_points": tidy(points, by=["pattern", "missing_fraction"]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Charts of the relative skeleton error as in the paper, and of errors of observed and missing points."""
        options = cast(MissingDataSweep, inputs.experiment.sweep)
        table, first = tables["table_points"], options.patterns[0]
        points: dict[str, Any] = {"table": "table_points", "by": "pattern"}

        def styles(label: str = "", line: str = "solid") -> dict[str, Style]:
            """Return a chart style for each pattern of missing points; `label` is shown for the first one only."""
            return {
                str(p): Style((label if p is first else "") if label else PATTERN_LABELS[p], PATTERN_COLOURS[p],
                line=line,
                              banded=p is first)
                for p in options.patterns
            }  # fmt: skip

        percent = partial(Lines, table="table_points", times=100.0)
        relative = [
            percent(
                y="relative_error_up_to_mirror_mean",
                by="pattern",
                styles=styles("best of each limb and mirror", "dashed"),
            ),
            *(
                percent(
                    y=f"{name}_relative_error_mean",
                    where={"pattern": first},
                    styles={name: style},
                )
                for name, style in zip(("hanging", "mean_pose"), BASELINE_STYLES, strict=True)
            ),
        ]
        missing = partial(
            Chart,
            x="missing_fraction",
            abscissa=Axis(label="share of missing points", limits=(0.0, table["missing_fraction"].max())),
        )
        charts = [
            missing(
                **points, y="relative_error_mean", band="relative_error_sd", times=100.0, styles=styles(),
                also=relative,
                label="relative error", unit="%", zero=True, references=[PUBLISHED],
            ),
            missing(
                **points, y="seen_error_mm_median", styles=styles("seen", "dotted"), label="3D error of a joint",
                unit="mm",
                also=[Lines(**points, y="imputed_error_mm_median", styles=styles("imputed"))], zero=True,
            ),
        ]  # fmt: skip
        return Sheet(
            charts=charts,
            columns=2,
            caption=f"{table['trials'][0]} skeletons, {', '.join(camera.words for camera in options.cameras)}; noise of"
            f" {options.noise_px:g} px, errors of {100 * options.length_error:g} % of every length and of"
            f" {options.root_error_mm:g} mm of the root's trajectory. (a) Mean over skeletons with points missing at"
            " random or in runs of frames, in coordinates of the recording, on whose origin it depends; light band: ±"
            " standard deviation over skeletons. (b) Median over skeletons, of points that were missing and of those"
            " that were seen. "
            + interval_words(
                tables["table"]["clip"].nunique(),
                of="mean or median",
                over="clips",
                bands="Bands along the lines",
            ),
        )

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record one skeleton with its missing points, and charts of errors over time and over the missing fraction."""
        sweep, table = inputs.sweep, tables["table_points"]
        options = cast(MissingDataSweep, inputs.experiment.sweep)
        true, estimate, imputed = sweep.shown_true, sweep.shown_found, sweep.shown_imputed
        times = np.arange(len(true)) / inputs.dataset.frame_rate_hz
        # Moves the skeleton from its recorded position to the middle of the view, on the ground.
        ground = lift(true) - true[:, ROOT].mean(axis=0) * [1.0, 1.0, 0.0]
        error = np.linalg.norm(estimate - true, axis=-1)
        observed = ~imputed & (np.arange(true.shape[1]) != ROOT)
        with begin(
            f"\n`{sweep.shown_clip}` with {100 * sweep.shown_fraction:g} % of its points missing "
            f"({PATTERN_NAMES[Pattern(sweep.shown_pattern)]}), the one of median error. "
            f"{name_on_dark('original').capitalize()}: recorded; {ESTIMATE_COLOUR}: reconstructed; {IMPUTED_COLOUR}: "
            "points that were imputed. In the image missing points are not there. Bars: mean "
            "relative error in percent over percent of missing points.\n",
            at=times,
        ) as rec:
            rec.skeleton("world/original", true + ground)
            rec.skeleton("world/reconstructed", estimate + ground, colour=ESTIMATE_COLOUR)
            if imputed.any():
                # Points alone: a bone needs both its ends, so none is drawn between a joint and itself.
                rec.skeleton(
                    "world/imputed",
                    np.where(imputed[..., None], estimate + ground, np.nan),
                    [(j, j) for j in range(true.shape[1])],
                    colour=IMPUTED_COLOUR,
                    thickness_mm=16.0,
                )
            rec.image_points("image/observed", options.upright_mm(sweep.shown_image))
            for part, mask, colour in (("imputed", imputed, "orange"), ("seen", observed, "blue")):
                has = mask.any(axis=1)
                if has.any():
                    mean = np.where(mask, error, 0.0).sum(axis=1)[has] / mask.sum(axis=1)[has]
                    rec.curve(
                        f"curves/error_mm/{part}", times[has], mean, label=f"{part} points", colour=colour
                    )
            for pattern in options.patterns:
                rows = table[table["pattern"] == pattern]
                rec.bars(
                    f"bars/{pattern}",
                    100.0 * rows["relative_error_mean"].to_numpy(),
                    100.0 * rows["missing_fraction"].to_numpy(),
                    colour=PATTERN_COLOURS[pattern],
                )
            bars = [
                Bars(name=f"relative error (%), {PATTERN_NAMES[p]}", origin=f"bars/{p}")
                for p in options.patterns
            ]
            space = Space3D(name="recorded and reconstructed")
            rec.blueprint(
                Rows(
                    Columns(
                        space,
                        Image2D(name="observed", next_to=space),
                        shares=(3, 2),
                    ),
                    Columns(
                        Plot(name="error (mm) against time (s)", origin="curves/error_mm"),
                        Tabs(*bars),
                        Notes(),
                        shares=(2, 1, 1),
                    ),
                    shares=(3, 2),
                ),
                playing=True,
            )
