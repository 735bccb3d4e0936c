"""Error of a whole skeleton against the share of missing points: park2011 figure 3d."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd

from pipeline import pictures, recordings
from pipeline.skeleton import WALKER15
from pipeline.studies.figure_inputs import FigureInputs, sd, tidy
from pipeline.studies.limbs.dataset import LimbStretches
from pipeline.studies.limbs.missing_data import MissingDataErrors, MissingDataSweep, Pattern
from pipeline.studies.limbs.model import BasisFit, TrajectoryBasisModel
from pipeline.studies.limbs.trials import ROOT
from pipeline.studies.presentation import interval_words, lift
from pipeline.studies.replicated import aggregate
from pipeline.studies.study import Figure

PATTERN_NAMES = {Pattern.random: "one by one at random", Pattern.block: "runs of frames"}
PATTERN_LABELS = {Pattern.random: "random", Pattern.block: "runs"}
PATTERN_COLOURS = {Pattern.random: "blue", Pattern.block: "orange"}

PUBLISHED_FRACTION, PUBLISHED_ERROR = 0.05, 0.13
"""[park2011 section 5.1]: an average error of 13 % for 5 % missing data."""

BANDED = (
    "relative_error_mean", "relative_error_up_to_mirror_mean", "hanging_relative_error_mean",
    "mean_pose_relative_error_mean", "imputed_error_mm_median", "seen_error_mm_median",
)  # fmt: skip
"""Means and medians over skeletons that have an interval over clips."""

Inputs = FigureInputs[LimbStretches, BasisFit, MissingDataErrors]


@dataclass(kw_only=True)
class MissingDataFigure(Figure):
    """Error of a whole skeleton against the share of missing points."""

    model = TrajectoryBasisModel
    sweep = MissingDataSweep

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """Return ``table``: every skeleton at every fraction and pattern; ``table_points``: over skeletons.

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
                "relative_error_sd": ("relative_error", lambda errors: sd(errors.to_numpy(), 0)),
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

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Draw the relative error as in the paper, and the error of points that were seen and that were not."""
        options = cast(MissingDataSweep, inputs.experiment.sweep)
        table = tables["table_points"].assign(percent=lambda rows: 100.0 * rows["missing_fraction"])
        first = options.patterns[0]
        styles: dict[str, pictures.Style] = {
            p: pictures.Style(PATTERN_LABELS[p], PATTERN_COLOURS[p], banded=p is first)
            for p in options.patterns
        }
        # Patterns are told apart by colour everywhere; in (b) the legend names what the lines are of.
        imputed = {p: replace(style, label="imputed" if p is first else "") for p, style in styles.items()}
        seen = {
            p: replace(style, label="seen" if p is first else "", line="dotted")
            for p, style in styles.items()
        }
        dashed = {p: replace(style, label="", line="dashed") for p, style in styles.items()}
        lines = partial(pictures.series, x="percent", by="pattern")
        intervals = partial(pictures.intervals, x="percent", by="pattern")
        published = pictures.Series(
            x=np.array([100.0 * PUBLISHED_FRACTION]),
            y=np.array([PUBLISHED_ERROR]),
            line="points",
            label="published",
            colour="black",
        )
        panel = partial(
            pictures.Panel, xlabel="Missing points (%)", xlim=(0.0, float(table["percent"].max()))
        )
        nothing = table[table["pattern"] == first]
        still = [
            pictures.Series(
                x=nothing["percent"].to_numpy(),
                y=nothing[f"{name}_relative_error_mean"].to_numpy(),
                colour="null",
                line=line,
            )
            for name, line in (("hanging", "dotted"), ("mean_pose", "dashed"))
        ]
        missing = table[np.isfinite(table["imputed_error_mm_median"])]
        high = table["relative_error_mean"] + table["relative_error_sd"]
        errors_mm = table[
            [f"{name}_mm_median{end}" for name in ("imputed_error", "seen_error") for end in ("", "_high")]
        ]
        pictures.draw_lines(
            stem,
            [
                panel(
                    series=[
                        *lines(table, y="relative_error_mean", band="relative_error_sd", styles=styles),
                        *intervals(table, y="relative_error_mean", styles=styles),
                        *intervals(table, y="relative_error_up_to_mirror_mean", styles=dashed),
                        *still,
                        published,
                    ],
                    ylabel=r"$\Vert X - \hat X\Vert\,/\,\Vert X\Vert$",
                    ylim=(0.0, 1.05 * float(max(high.max(), *(line.y.max() for line in still)))),
                ),
                panel(
                    series=[
                        *(
                            [
                                *lines(missing, y="imputed_error_mm_median", styles=imputed),
                                *intervals(missing, y="imputed_error_mm_median", styles=imputed),
                            ]
                            if len(missing)
                            else []
                        ),
                        *lines(table, y="seen_error_mm_median", styles=seen),
                        *intervals(table, y="seen_error_mm_median", styles=seen),
                    ],
                    ylabel="3D error of a joint (mm)",
                    ylim=(0.0, 1.08 * float(np.nanmax(errors_mm))),
                ),
            ],
            columns=2,
            caption=f"{inputs.caption} {table['trials'][0]} skeletons, "
            f"{', '.join(camera.words for camera in options.cameras)}; noise of {options.noise_px:g} px, errors of "
            f"{100 * options.length_error:g} % of every length and of {options.root_error_mm:g} mm of the root's "
            "trajectory. (a) Mean over skeletons with points missing at random or in runs of frames, in coordinates of "
            "the recording, on whose origin it depends; light band: ±1 standard deviation over skeletons; dashed: when "
            "of every limb and its mirror the better one is taken; grey: skeletons that do nothing, on the same root, "
            "hanging straight down (dotted) or in their true mean pose (dashed); dot: the paper's 13 % at 5 %. "
            "(b) Median over skeletons, of points that were missing and of those that were seen. "
            + interval_words(
                tables["table"]["clip"].nunique(),
                of="mean or median",
                over="clips",
                bands="Bands along the lines",
            ),
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Log one skeleton with its missing points imputed, and errors over time and fractions."""
        sweep, table = inputs.sweep, tables["table_points"]
        patterns = cast(MissingDataSweep, inputs.experiment.sweep).patterns
        true, found, imputed = sweep.shown_true, sweep.shown_found, sweep.shown_imputed
        times = np.arange(len(true)) / inputs.dataset.frame_rate_hz
        index = {"time": times}
        # Its place in the world is where it was recorded: brought to the middle of the view, on the ground.
        ground = lift(true) - true[:, ROOT].mean(axis=0) * [1.0, 1.0, 0.0]
        error = np.linalg.norm(found - true, axis=-1)
        seen = ~imputed & (np.arange(true.shape[1]) != ROOT)
        with inputs.recording(
            folder,
            f"\n`{sweep.shown_clip}` with {100 * sweep.shown_fraction:g} % of its points missing "
            f"({PATTERN_NAMES[Pattern(sweep.shown_pattern)]}), the one of median error. Grey: recorded; blue: "
            "reconstructed; orange: points that were imputed. In the image missing points are not there. Bars: mean "
            "relative error in percent over percent of missing points.\n",
        ) as rec:
            rec.skeleton("world/original", true + ground, WALKER15.bones, index=index)
            rec.skeleton("world/reconstructed", found + ground, WALKER15.bones, index=index, colour="blue")
            if imputed.any():
                # Points alone: a bone needs both its ends, so none is drawn between a joint and itself.
                rec.skeleton(
                    "world/imputed",
                    np.where(imputed[..., None], found + ground, np.nan),
                    [(j, j) for j in range(true.shape[1])],
                    index=index,
                    colour="orange",
                    thickness_mm=16.0,
                )
            image = cast(MissingDataSweep, inputs.experiment.sweep).upright_mm(sweep.shown_image)
            rec.image_points("image/observed", image, WALKER15.bones, index=index)
            for part, here, colour in (("imputed", imputed, "orange"), ("seen", seen, "blue")):
                has = here.any(axis=1)
                if has.any():
                    mean = np.where(here, error, 0.0).sum(axis=1)[has] / here.sum(axis=1)[has]
                    rec.curve(
                        f"curves/error_mm/{part}", times[has], mean, label=f"{part} points", colour=colour
                    )
            for pattern in patterns:
                rows = table[table["pattern"] == pattern]
                rec.bars(
                    f"bars/{pattern}",
                    100.0 * rows["relative_error_mean"].to_numpy(),
                    100.0 * rows["missing_fraction"].to_numpy(),
                    colour=PATTERN_COLOURS[pattern],
                )
            bars = [
                recordings.Bars(name=f"relative error (%), {PATTERN_NAMES[p]}", origin=f"bars/{p}")
                for p in patterns
            ]
            space = recordings.Space3D(name="recorded and reconstructed")
            rec.blueprint(
                recordings.Rows(
                    recordings.Columns(
                        space,
                        recordings.Image2D(name="observed", beside=space),
                        shares=(3, 2),
                    ),
                    recordings.Columns(
                        recordings.Plot(name="error (mm) against time (s)", origin="curves/error_mm"),
                        recordings.Tabs(*bars),
                        recordings.Notes(),
                        shares=(2, 1, 1),
                    ),
                    shares=(3, 2),
                ),
                playing=True,
            )
