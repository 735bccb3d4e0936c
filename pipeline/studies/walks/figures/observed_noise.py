"""Errors of a detector: our figure of how the anatomical reconstruction bears them."""

from __future__ import annotations

from functools import partial

from pipeline.charts import Chart, Reference, Sheet
from pipeline.palette import Style
from pipeline.scenes import Columns, Matrix, Notes, Rows
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.replicated import OVER_PEOPLE
from pipeline.studies.study import Figure, Recorder, Tables
from pipeline.studies.walks.anatomical_model import AnatomicalModel, AnatomicalWalkers
from pipeline.studies.walks.people_intervals import PeopleResampled
from pipeline.studies.walks.sweeps.ladder import STYLES
from pipeline.studies.walks.sweeps.noise import NoiseErrors, ObservedNoise

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


class NoiseTolerance(Figure):
    """Errors and coverage under errors of the observed dimensions."""

    model = AnatomicalModel
    sweep = ObservedNoise

    def tables(self, inputs: Inputs) -> Tables:
        """``table``: by condition and method; ``table_walkers``: by walker."""
        sweep = inputs.sweep.rows
        people = PeopleResampled(len(inputs.model.people), inputs.experiment.seed)
        rows = []
        for keys, of in sweep.groupby(["condition", "method", "white_mm", "bias_mm", "slow_mm"], sort=False):
            baseline = sweep[(sweep["condition"] == keys[0]) & (sweep["method"] == "map_tuned")]
            mine, than = (each["absolute_error_mm2"].to_numpy() for each in (of, baseline))
            rows.append(
                {
                    **dict(zip(("condition", "method", "white_mm", "bias_mm", "slow_mm"), keys, strict=True)),
                    **people.mean(mine, "absolute_error_mm2"),
                    **people.reduction_percent(mine, than, "below_map_percent"),
                    **people.mean(of["covered_percent"].to_numpy(), "covered_percent"),
                    "half_width_mm": of["half_width_mm"].mean(),
                    "walkers_better": (mine < than).sum(),
                }
            )
        columns = ["person", "walker", "condition", "method", "absolute_error_mm2", "covered_percent"]
        walkers = sweep.assign(walker=sweep["person"])[columns]
        return {
            "table": tidy(rows, by=["condition", "method"]),
            "table_walkers": tidy(walkers, by=["walker", "condition", "method"]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Error and coverage under each condition."""
        by_condition = partial(
            Chart, x="condition", x_label="error of the image", words=WORDS, by="method", styles=METHODS
        )
        charts = [
            by_condition(
                y="absolute_error_mm2", label="mean square error", log_y=True, ticks=(200, 500, 1000, 2000)
            ),
            by_condition(y="covered_percent", label="covered by 95 % bars", references=[Reference(y=95.0)]),
        ]
        return Sheet(
            charts=charts,
            columns=2,
            caption="Errors of the observed dimensions, root mean square; bars as computed. "
            f"Lines: {OVER_PEOPLE}.",
        )

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Error of every walker under every condition, walkers down and conditions across."""
        walkers = tables["table_walkers"]
        with begin(
            f"\nMatrices: a row to each of {len(inputs.model.people)} people, a column to each condition: "
            f"{', '.join(WORDS.values())}.\n",
            timeline="condition",
        ) as rec:
            for method in METHODS:
                of = walkers[walkers["method"] == method]
                wide = of.pivot(index="walker", columns="condition", values="absolute_error_mm2")[list(WORDS)]
                rec.matrix(f"matrices/{method}", wide.to_numpy())
            matrices = [
                Matrix(name=f"error, {METHODS[m].label}", origin=f"matrices/{m}")
                for m in ("map_tuned", "anatomical_told")
            ]
            rec.blueprint(Columns(Rows(*matrices), Rows(*rec.plots, Notes())))
