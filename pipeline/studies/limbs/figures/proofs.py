"""Share of programmes that are proved to be solved, and what it costs; after park2011, ours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from pipeline.charts import Chart, Lines, Reference, Sheet
from pipeline.palette import Style
from pipeline.studies.experiment import Experiment
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.limbs.dataset import LimbDataset, LimbStretches
from pipeline.studies.limbs.model import BasisFit, TrajectoryBasisModel
from pipeline.studies.limbs.proofs import Proofs, ProofSweep
from pipeline.studies.study import Figure, Tables

COLOURS = ("blue", "orange", "green", "purple", "sky", "amber")
"""Of the numbers of components, in turn."""

LEAST_S = 1e-6
"""Shorter times are drawn there."""

SAME = 1e-6
"""Relative difference of two costs that are one."""

KEYS = ["frames", "components", "noise_px"]

Inputs = FigureInputs[LimbStretches, BasisFit, Proofs]


class ProofsFigure(Figure):
    """Share of programmes proved, and what it costs."""

    model = TrajectoryBasisModel
    sweep = ProofSweep
    timeline = "frames"

    def validate(self, experiment: Experiment) -> None:
        """Validate the options against the rest of the experiment.  Raises InvalidInput if they do not fit."""
        cast(ProofSweep, experiment.sweep).require_frames(cast(LimbDataset, experiment.dataset).frames)

    def tables(self, inputs: Inputs) -> Tables:
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

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Share proved and seconds against frames, for every number of cosines and noise."""
        options = cast(ProofSweep, inputs.experiment.sweep)
        table = tables["table"]
        colours = dict(zip(options.components, COLOURS * len(options.components), strict=False))
        conditions = {
            f"k{k}_noise_{noise:g}_px".replace(".", "_"): (k, noise)
            for k, noise in table.groupby(KEYS[1:]).groups
        }
        lines: list[dict[str, Any]] = [
            {
                "where": {"components": k, "noise_px": noise},
                "styles": {name: Style(f"{k} cosines, {noise:g} px" if noise else f"{k} cosines, no noise", colours[k],
                                       line="dashed" if noise else "solid", width=0.6 if noise else 1.0)},
            }
            for name, (k, noise) in conditions.items()
        ]  # fmt: skip

        def chart(further: Sequence[Lines] = (), **of: Any) -> Chart:
            of_lines = {name: of[name] for name in ("table", "y", "times") if name in of}
            also = [*(Lines(**of_lines, **line) for line in lines[1:]), *further]
            return Chart(x="frames", **of, **lines[0], also=also)

        limit = options.time_limit_s
        fewest, most = table["trials"].min(), table["trials"].max()
        best = 100 * np.average(table["first_best_share"], weights=table["trials"])
        timing: dict[str, Any] = {
            "table": "table_timing",
            "label": "seconds, median",
            "unit": "s",
            "log_y": True,
            "least": LEAST_S,
        }
        charts = [
            chart(y="proved_share", times=100.0, label="programmes proved", unit="%", limits=(0.0, 105.0)),
            chart(**timing, y="seconds_median", references=[Reference(y=limit, label="nominal limit")]),
            chart(
                **timing, y="first_seconds_median", title="until the first signs", picture=False, page=False
            ),
        ]
        return Sheet(
            charts=charts,
            columns=2,
            caption=f"{most} limbs at every point"
            + (f", {fewest} where they are longest" if fewest < most else "")
            + f", before {', '.join(options.cameras)} cameras in turn;"
            f" limit {limit:g} nominal s each. (b) Until proof or"
            f" the limit; the first signs are the best in {best:.0f} % of all programmes. Components as named.",
        )
