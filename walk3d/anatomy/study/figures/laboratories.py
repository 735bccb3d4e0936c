"""Figure on people whose laboratory is not in the training data, with learning curves."""

from __future__ import annotations

from functools import partial

from pipeline.charts import Axis, Chart, Reference, Sheet
from pipeline.palette import Style
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.replicated import OVER_PEOPLE, aggregate
from pipeline.studies.study import Figure, Tables, Traits
from walk3d.anatomy.study.model import AnatomicalModel, AnatomicalWalkers
from walk3d.anatomy.study.sweeps.laboratories import LABORATORY, PERSON, Laboratories, LaboratoryErrors
from walk3d.anatomy.study.sweeps.ladder import STYLES

Inputs = FigureInputs[FourierSamples, AnatomicalWalkers, LaboratoryErrors]

CURVES = {
    **{name: STYLES[name] for name in ("average_walker", "map_tuned", "anatomical")},
    "anybody": Style("anatomical, for anybody", "sky"),
}
BARS = {"anatomical": Style("as if measured as ours", "green"), "anybody": Style("for anybody", "sky")}
SPANNED = {
    "person": Style("everybody else", "green"),
    "laboratory": Style("other laboratories", "sky", line="dashed"),
    "all but one other laboratory": Style("one other laboratory", "amber", line="dotted"),
}
LEFT_OUT = {PERSON: "person", LABORATORY: "laboratory"}


class LearningCurves(Figure):
    """Errors and error bars when training and test laboratory differ, and learning curves.

    The learning curves show the errors against the number of people and laboratories in training.
    """

    model = AnatomicalModel
    sweep = Laboratories
    traits = Traits(timeline="people")

    def tables(self, inputs: Inputs) -> Tables:
        """Return tables of the learning curves, and of the errors by laboratory, training data and method.

        ``table`` has the learning curves, and ``table_sources`` has the errors.

        ``table_walkers`` has each walker of ``table_sources``.  ``table_summary`` is over all people, with the person
        or the laboratory left out.
        """
        rows, curve = inputs.sweep.rows, inputs.sweep.curve
        error = {"absolute_error_mm2": ("absolute_error_mm2", "mean")}
        columns = error | {name: (name, "mean") for name in ("covered_95", "covered_95_calibrated")}
        over = partial(aggregate, cluster="person", count="people")
        banded = error | {"spanned_percent": ("spanned_percent", "mean")}
        of_curve = banded | {"laboratories": ("laboratories", "mean")}
        both = rows.assign(left_out=rows["learnt_from"].map(LEFT_OUT))  # NaN for one other laboratory alone
        return {
            "table": over(curve, ["left_out", "method", "people"], of_curve, banded, count="walkers"),
            "table_sources": over(rows, ["learnt_from", "tested", "method"], columns, columns),
            "table_summary": over(both, ["left_out", "method"], columns, columns),
            "table_walkers": tidy(rows, by=["learnt_from", "tested", "method", "person"]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Return charts of the learning curves, and of errors and coverage of error bars by laboratory."""
        curve = partial(
            Chart, x="people", y="absolute_error_mm2", by="method", styles=CURVES, zero=True,
            abscissa=Axis(label="people learnt from"), label="mean square error",
        )  # fmt: skip
        words = {name: name.replace("_", " ") for name in tables["table_sources"]["tested"]}
        bars = partial(
            Chart, table="table_sources", x="tested", by="method", styles=BARS, abscissa=Axis(words=words),
            where={"learnt_from": LABORATORY},
        )  # fmt: skip
        covered = partial(bars, limits=(0.4, 1.0), references=[Reference(y=0.95)])
        charts = [
            curve(where={"left_out": "person"}, title="the person is left out", name="error_of_people_mm2"),
            curve(where={"left_out": "laboratory"}, title="the laboratory is left out", name="error_of_others_mm2"),
            Chart(
                x="people", y="spanned_percent", by="left_out", where={"method": "map_tuned"}, styles=SPANNED,
                abscissa=Axis(label="people learnt from"), label="variance of a person spanned", limits=(0.0, 100.0),
            ),
            Chart(
                x="people", y="absolute_error_mm2", by="left_out", where={"method": "anybody"}, zero=True,
                abscissa=Axis(label="people learnt from"),
                label="mean square error", styles=SPANNED, title="for anybody",
                name="error_of_further_mm2", page=False, picture=False,
            ),
            bars(y="absolute_error_mm2", label="mean square error, laboratory left out", zero=True),
            covered(y="covered_95", label="share within 95 % bars, as computed"),
            covered(y="covered_95_calibrated", label="share within 95 % bars, calibrated"),
        ]  # fmt: skip
        return Sheet(
            charts=charts,
            columns=3,
            caption="Across laboratories MAP may be worse than the average walker, which does not look at the image."
            f" Bands and bars: {OVER_PEOPLE}.",
        )
