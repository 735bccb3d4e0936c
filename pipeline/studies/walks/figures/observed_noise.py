"""Errors of a detector: our figure of how the anatomical reconstruction bears them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pandas as pd

from pipeline import pictures, recordings
from pipeline.palette import Style
from pipeline.seeding import derive_generator
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.study import Figure
from pipeline.studies.walks.anatomical_model import AnatomicalModel, AnatomicalWalkers
from pipeline.studies.walks.figures.ladder import one_row, points_of
from pipeline.studies.walks.people_intervals import PeopleResampled
from pipeline.studies.walks.sweeps.ladder import STYLES
from pipeline.studies.walks.sweeps.noise import CONDITIONS, NoiseErrors, ObservedNoise

Inputs = FigureInputs[FourierSamples, AnatomicalWalkers, NoiseErrors]

METHODS = {
    "map_tuned": STYLES["map_tuned"],
    "linear_told": Style("no lengths, told of the error", "amber"),
    "anatomical_told": Style("anatomical, told of the error", "green"),
    "anatomical_untold": Style("anatomical, not told", "orange"),
}
WORDS = {
    "none": "none",
    "white_10": "white 10 mm",
    "bias_10": "bias 10 mm",
    "bias_20": "bias 20 mm",
    "slow_3": "slow 3 mm",
    "bias_10_slow_3": "bias 10, slow 3 mm",
}


@dataclass(kw_only=True)
class NoiseTolerance(Figure):
    """Errors and coverage under errors of the observed dimensions."""

    model = AnatomicalModel
    sweep = ObservedNoise

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """``table``: by condition and method; ``table_walkers``: by walker."""
        sweep = inputs.sweep.rows
        people = PeopleResampled(len(inputs.model.people), derive_generator(inputs.experiment.seed, "people"))
        rows = []
        for keys, of in sweep.groupby(["condition", "method", "white_mm", "bias_mm", "slow_mm"], sort=False):
            baseline = sweep[(sweep["condition"] == keys[0]) & (sweep["method"] == "map_tuned")]
            mine, than = (each["absolute_error_mm2"].to_numpy() for each in (of, baseline))
            rows.append(
                {
                    **dict(zip(("condition", "method", "white_mm", "bias_mm", "slow_mm"), keys, strict=True)),
                    **one_row(people.mean(mine), "absolute_error_mm2"),
                    **one_row(people.reduction_percent(mine, than), "below_map_percent"),
                    **one_row(people.mean(of["covered_percent"].to_numpy()), "covered_percent"),
                    "half_width_mm": of["half_width_mm"].mean(),
                    "walkers_better": int((mine < than).sum()),
                }
            )
        columns = ["person", "walker", "condition", "method", "absolute_error_mm2", "covered_percent"]
        walkers = sweep.assign(walker=sweep["person"])[columns]
        return {
            "table": tidy(rows, by=["condition", "method"]),
            "table_walkers": tidy(walkers, by=["walker", "condition", "method"]),
        }

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Error and coverage under each condition."""
        conditions = list(CONDITIONS)
        places = [float(place) for place in range(len(conditions))]
        panel = partial(pictures.Panel, xticks=places, xwords=[WORDS[name] for name in conditions], xlabel="")
        table = tables["table"]
        top = 1.3 * float(table.loc[table["method"] == "map_tuned", "absolute_error_mm2_high"].max())
        panels = [
            panel(
                series=points_of(table, conditions, "condition", "absolute_error_mm2", METHODS),
                ylabel="Absolute error (mm$^2$)",
                ylim=(0.0, top),
            ),
            panel(
                series=points_of(table, conditions, "condition", "covered_percent", METHODS),
                ylabel="Covered by 95 % bars (%)",
                references=[("y", 95.0, "")],
            ),
        ]
        pictures.draw_lines(
            stem,
            panels,
            columns=2,
            legend="figure",
            caption=f"{inputs.caption} Errors of the observed dimensions, root mean square; bars as computed. Vertical"
            " bars: 95 % intervals over people; what lies above the axes is in the table.",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Error of every walker under every condition, walkers down and conditions across."""
        walkers = tables["table_walkers"]
        conditions = list(CONDITIONS)
        with inputs.recording(
            folder,
            f"\nMatrices: a row to each of {len(inputs.model.people)} people, a column to each condition: "
            f"{', '.join(WORDS[name] for name in conditions)}.\n",
            timeline="condition",
        ) as rec:
            for method in METHODS:
                of = walkers[walkers["method"] == method]
                wide = of.pivot(index="walker", columns="condition", values="absolute_error_mm2")[conditions]
                rec.matrix(f"matrices/{method}", wide.to_numpy())
            rows = tables["table"].set_index("condition")
            for method, style in METHODS.items():
                mine = rows[rows["method"] == method].loc[conditions]
                rec.curve(
                    f"curves/covered_percent/{method}",
                    pd.RangeIndex(len(conditions)).to_numpy(),
                    mine["covered_percent"].to_numpy(),
                    label=style.label,
                    colour=style.colour,
                )
            rec.blueprint(
                recordings.Columns(
                    recordings.Rows(
                        *(
                            recordings.Matrix(name=f"error, {METHODS[m].label}", origin=f"matrices/{m}")
                            for m in ("map_tuned", "anatomical_told")
                        )
                    ),
                    recordings.Rows(
                        recordings.Plot(name="covered by 95 % bars (%), by condition"), recordings.Notes()
                    ),
                    shares=(1, 1),
                )
            )
