"""Share of programmes that are proved to be solved, and what it costs; after park2011, ours."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd

from pipeline import pictures, recordings
from pipeline.core.limb_chain import WALKER14
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
        sweep = inputs.sweep
        groups = np.stack([sweep.frames, sweep.components, sweep.noise_px], axis=1)
        proved_rows: list[dict[str, Any]] = []
        timing_rows: list[dict[str, Any]] = []
        for group in np.unique(groups, axis=0):
            here = (groups == group).all(axis=1)
            proved, seconds = sweep.proved[here], sweep.timing.seconds[here]
            first, last = sweep.first_objective[here], sweep.objective[here]
            keys = {"frames": int(group[0]), "components": int(group[1]), "noise_px": float(group[2])}
            keys |= {"trials": int(here.sum())}
            proved_rows.append(
                keys
                | {
                    "proved_share": proved.mean(),
                    "gap_median": np.median(sweep.gap[here]),
                    "first_best_share": (first <= last * (1 + SAME)).mean(),
                    "limb_error_median": np.median(sweep.limb_error[here]),
                }
            )
            timing_rows.append(
                keys
                | {
                    "seconds_median": np.median(seconds),
                    "seconds_to_proof_median": np.median(seconds[proved]) if proved.any() else np.nan,
                    "seconds_most": seconds.max(),
                    "first_seconds_median": np.median(sweep.timing.first_seconds[here]),
                }
            )
        measured = (
            "camera", "proved", "objective", "lower_bound", "gap", "first_objective", "limb_error", "boxes", "steps",
        )  # fmt: skip
        return {
            "table": pd.DataFrame(proved_rows),
            "table_timing": pd.DataFrame(timing_rows),
            "table_trials": tidy(
                {
                    **{name: getattr(sweep, name) for name in [*KEYS, "trial"]},
                    "clip": np.array(inputs.samples)[sweep.stretch],
                    "limb": np.array(WALKER14.limbs)[sweep.limb],
                    **{name: getattr(sweep, name) for name in measured},
                },
                by=[*KEYS, "trial"],
            ),
        }

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Draw share proved and seconds against frames, for every K and noise."""
        options = cast(ProofSweep, inputs.experiment.sweep)
        table = _joined(tables)
        panels: list[list[pictures.Series]] = [[], []]
        colours = dict(zip(options.components, COLOURS * len(options.components), strict=False))
        for (components, noise), rows in table.groupby(["components", "noise_px"]):
            look: dict[str, Any] = {"colour": colours[components], "line": "dashed" if noise else "solid"}
            label = "" if noise != options.noises_px[0] else f"$K$ = {components}"
            share = 100.0 * rows["proved_share"]
            panels[0].append(pictures.Series(x=rows["frames"], y=share, label=label, **look))
            panels[1].append(pictures.Series(x=rows["frames"], y=rows["seconds_median"], **look))
        first = table.groupby("frames")["first_seconds_median"].median()
        panels[1].append(
            pictures.Series(x=first.index, y=first, label="first signs", colour="black", line="dotted")
        )
        fewest, most = table["trials"].min(), table["trials"].max()
        limit = options.time_limit_s
        best = 100 * np.average(table["first_best_share"], weights=table["trials"])
        pictures.draw_lines(
            stem,
            [
                pictures.Panel(
                    series=panels[0],
                    xlabel="Frames",
                    ylabel="Programmes proved (%)",
                    ylim=(0.0, 105.0),
                ),
                pictures.Panel(
                    series=panels[1],
                    xlabel="Frames",
                    ylabel="Seconds, median",
                    yscale="log",
                    references=[("y", limit, "nominal limit")],
                ),
            ],
            columns=2,
            caption=f"{inputs.caption.replace(inputs.model.words, 'components as named')} {most} limbs at every point"
            + (f", {fewest} where they are longest" if fewest < most else "")
            + f", before {', '.join(options.cameras)} cameras in turn; limit {limit:g} nominal s each, "
            f"{inputs.sweep.timing.threads} at a time. Solid: no noise; dashed: noise of "
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
            groups = _joined(tables).groupby(["components", "noise_px"])
            for number, ((components, noise), rows) in enumerate(groups):
                entity = f"k{components}_noise_{noise:g}_px".replace(".", "_")
                seconds = np.log10(np.maximum(rows["seconds_median"].to_numpy(), 1e-6))
                for curve, values in (
                    ("proved_share", rows["proved_share"].to_numpy()),
                    ("log10_seconds", seconds),
                ):
                    rec.curve(
                        f"curves/{curve}/{entity}",
                        rows["frames"].to_numpy(),
                        values,
                        label=f"K = {components}, {noise:g} px",
                        colour=RECORDED_COLOURS[number % len(RECORDED_COLOURS)],
                    )
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
    """Share proved and seconds side by side, rows by increasing frames."""
    return tables["table"].merge(tables["table_timing"], on=[*KEYS, "trials"], validate="one_to_one")
