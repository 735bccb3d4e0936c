"""Share of programmes that are proved to be solved, and what it costs; after park2011, ours."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd

from pipeline import pictures, recordings
from pipeline.studies.experiment import Experiment
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.limbs.dataset import LimbDataset, LimbStretches
from pipeline.studies.limbs.model import BasisFit, TrajectoryBasisModel
from pipeline.studies.limbs.proofs import Proofs, ProofSweep
from pipeline.studies.study import Figure

COLOURS = ("blue", "orange", "green", "purple", "sky", "amber")
"""Of the numbers of components, in turn."""

RECORDED_COLOURS = ("blue", "orange", "green", "purple", "yellow", "amber")
"""Of the lines of the recording, which has no dashes."""

SAME = 1e-6
"""Relative difference of two costs that are one."""

KEYS = ["frames", "components", "noise_px"]

Inputs = FigureInputs[LimbStretches, BasisFit, Proofs]


@dataclass(kw_only=True)
class ProofsFigure(Figure):
    """Share of programmes proved, and what it costs."""

    model = TrajectoryBasisModel
    sweep = ProofSweep

    def validate(self, experiment: Experiment) -> None:
        """Validate the options against the rest of the experiment.  Raises InvalidInput if they do not fit."""
        cast(ProofSweep, experiment.sweep).require_frames(cast(LimbDataset, experiment.dataset).frames)

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """Return ``table``: share proved; ``table_trials``: all; ``table_timing``: seconds of this machine."""
        each = tidy(inputs.sweep.rows, by=[*KEYS, "trial"])
        trials = each.drop(columns=["seconds", "first_seconds"])
        each["first_best"] = each["first_objective"] <= each["objective"] * (1 + SAME)
        each["seconds_to_proof"] = each["seconds"].where(each["proved"])
        groups = each.groupby(KEYS)
        shares = groups.agg(
            trials=("trial", "size"),
            proved_share=("proved", "mean"),
            gap_median=("gap", "median"),
            first_best_share=("first_best", "mean"),
            limb_error_median=("limb_error", "median"),
        )
        timing = groups.agg(
            trials=("trial", "size"),
            seconds_median=("seconds", "median"),
            seconds_to_proof_median=("seconds_to_proof", "median"),
            seconds_most=("seconds", "max"),
            first_seconds_median=("first_seconds", "median"),
        )
        return {
            "table": shares.reset_index(),
            "table_timing": timing.reset_index(),
            "table_trials": trials,
        }

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Draw share proved and seconds against frames, for every K and noise."""
        options = cast(ProofSweep, inputs.experiment.sweep)
        table = _joined(tables)
        colours = dict(zip(options.components, COLOURS * len(options.components), strict=False))
        styles = {
            line: pictures.Style(
                f"$K$ = {k}" if noise == options.noises_px[0] else "",
                colours[k],
                line="dashed" if noise else "solid",
            )
            for line, (k, noise) in _lines(table).items()
        }
        first = table.groupby("frames")["first_seconds_median"].median()
        signs = pictures.Series(x=first.index, y=first, label="first signs", colour="black", line="dotted")
        fewest, most = table["trials"].min(), table["trials"].max()
        limit = options.time_limit_s
        best = 100 * np.average(table["first_best_share"], weights=table["trials"])
        pictures.draw_lines(
            stem,
            [
                pictures.Panel(y="proved_percent", ylabel="Programmes proved (%)", ylim=(0.0, 105.0)),
                pictures.Panel(
                    y="seconds_median",
                    legend=(),
                    series=[signs],
                    ylabel="Seconds, median",
                    yscale="log",
                    references=[("y", limit, "nominal limit")],
                ),
            ],
            table,
            x="frames",
            by="line",
            styles=styles,
            xlabel="Frames",
            columns=2,
            caption=f"{inputs.caption.replace(inputs.model.words, 'components as named')} {most} limbs at every point"
            + (f", {fewest} where they are longest" if fewest < most else "")
            + f", before {', '.join(options.cameras)} cameras in turn; limit {limit:g} nominal s each. "
            f"Solid: no noise; dashed: noise of "
            f"{', '.join(f'{noise:g}' for noise in options.noises_px if noise)} px. (b) Until proof or the limit; "
            f"dotted: until the first signs, which are the best in {best:.0f} % of all programmes.",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Log share proved and seconds over frames."""
        options = cast(ProofSweep, inputs.experiment.sweep)
        with inputs.recording(
            folder,
            f"\nProgrammes of limbs cut to so many frames; limit {options.time_limit_s:g} nominal s each. Seconds "
            "are those of the machine that made this recording, as log10.\n",
            timeline="frames",
        ) as rec:
            table = _joined(tables)
            table["log10_seconds"] = np.log10(table["seconds_median"].clip(lower=1e-6))
            colours = itertools.cycle(RECORDED_COLOURS)
            styles = {
                line: recordings.Style(f"K = {k}, {noise:g} px", next(colours))
                for line, (k, noise) in _lines(table).items()
            }
            for column in ("proved_share", "log10_seconds"):
                rec.curves(table, x="frames", y=column, by="line", styles=styles)
            share, log_seconds = (
                recordings.Plot(name=name, origin=f"curves/{curve}", y_range=limits)
                for name, curve, limits in (
                    ("share proved over frames", "proved_share", (0.0, 1.3)),
                    ("log10 of seconds over frames", "log10_seconds", (-3.0, 1.0)),
                )
            )
            beside = recordings.Rows(log_seconds, recordings.Notes(), shares=(2, 1))
            rec.blueprint(recordings.Columns(share, beside, shares=(1, 1)))


def _joined(tables: dict[str, pd.DataFrame]) -> pd.DataFrame:
    """Share proved and seconds side by side, rows by increasing frames, with the name of the line of each row."""
    table = tables["table"].merge(tables["table_timing"], on=[*KEYS, "trials"], validate="one_to_one")
    lines = [
        f"k{k}_noise_{noise:g}_px" for k, noise in zip(table["components"], table["noise_px"], strict=True)
    ]
    table["line"] = pd.Series(lines).str.replace(".", "_")
    return table.assign(proved_percent=100.0 * table["proved_share"])


def _lines(table: pd.DataFrame) -> dict[str, tuple[int, float]]:
    """Components and noise of each line, in order."""
    return {rows["line"].iloc[0]: key for key, rows in table.groupby(["components", "noise_px"])}
