"""Figure on the reconstruction of hidden joints, which zhang2007 leaves to future work."""

from __future__ import annotations

from functools import partial
from typing import Any

import pandas as pd

from pipeline.charts import Axis, Chart, Reference, Sheet
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.replicated import OVER_PEOPLE
from pipeline.studies.study import Figure, Tables, Traits
from pipeline.studies.walks.methods import VIEW
from walk3d.anatomy.study.model import AnatomicalModel, AnatomicalWalkers
from walk3d.anatomy.study.people_intervals import PeopleResampled
from walk3d.anatomy.study.sweeps.held_out import BARS
from walk3d.anatomy.study.sweeps.ladder import STYLES
from walk3d.anatomy.study.sweeps.occlusion import METHODS, WITH_BARS, HiddenJoints, Occlusion

Inputs = FigureInputs[FourierSamples, AnatomicalWalkers, HiddenJoints]

WORDS = {
    "pelvis": "pelvis",
    "head": "head",
    "feet": "both feet",
    "far_arm": "far arm",
    "far_leg": "far leg",
    "far_side": "far arm and leg",
}
PLOTTED_SET = "far_side"


class HiddenJointErrors(Figure):
    """Errors and error bars of hidden joints."""

    model = AnatomicalModel
    sweep = Occlusion
    traits = Traits(timeline="view_angle_deg")

    def tables(self, inputs: Inputs) -> Tables:
        """Return tables of the errors of hidden joints and of the coverage of their error bars.

        ``table`` has the errors by hidden joints, method and view; ``table_hidden`` contains the means over all views.

        ``table_bars`` is over the three axes of the hidden joints; ``table_axes`` has each axis.
        """
        rows, bars = inputs.sweep.rows, inputs.sweep.bars
        people = PeopleResampled(len(inputs.model.people), inputs.experiment.seed)
        which = ["hidden", "method"]

        each = rows.groupby(["person", *which], sort=False).mean().reset_index()
        summary = []
        for (hidden, method), group in each.groupby(which):
            baseline = each[(each["hidden"] == hidden) & (each["method"] == "map_tuned")]
            errors, baseline_errors = (table["hidden_error_mm"].to_numpy() for table in (group, baseline))
            summary.append(
                {
                    "hidden": hidden,
                    "method": method,
                    **people.mean(group["hidden_error_mm"], "hidden_error_mm"),
                    **people.reduction_percent(errors, baseline_errors, "below_map_percent"),
                    **people.mean(group["seen_error_mm2"], "seen_error_mm2"),
                    "walkers_better": (errors < baseline_errors).sum(),
                }
            )
        kinds = [*which, "bars"]
        over_axes = (
            bars.groupby(["person", *kinds], sort=False)[["covered_percent", "half_width_mm"]]
            .mean()
            .reset_index()
        )
        who = ["person", "walker"]
        return {
            "table": people.means(rows, [*which, "view_angle_deg"], "hidden_error_mm"),
            "table_hidden": pd.DataFrame(summary),
            "table_bars": people.means(over_axes, kinds, "covered_percent", ["half_width_mm"]),
            "table_axes": people.means(bars, [*kinds, "axis"], "covered_percent", ["half_width_mm"]),
            "table_walkers": tidy(
                each.assign(walker=each["person"])[[*who, *which, "hidden_error_mm"]], by=["walker", *which]
            ),
            "table_walkers_bars": tidy(
                over_axes.assign(walker=over_axes["person"])[[*who, *kinds, "covered_percent"]],
                by=["walker", *kinds],
            ),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Return charts of the errors of hidden and visible joints, and of the coverage of the error bars."""
        styles = {name: STYLES[name] for name in METHODS}
        distance = partial(
            Chart,
            y="hidden_error_mm",
            label="error of hidden joints",
            by="method",
            styles=styles,
            zero=True,
        )
        by_hidden: dict[str, Any] = {
            "x": "hidden", "abscissa": Axis(label="what is hidden", words=WORDS)
        }  # fmt: skip
        of_views = [
            distance(**VIEW, where={"hidden": name}, title=f"{words} hidden", name=name,
                     picture=name == PLOTTED_SET, page=name == PLOTTED_SET)
            for name, words in WORDS.items()
        ]  # fmt: skip
        charts = [
            distance(**by_hidden, table="table_hidden"),
            *of_views,
            Chart(
                **by_hidden, table="table_bars", where={"bars": BARS[1]}, y="covered_percent", by="method",
                styles={name: STYLES[name] for name in WITH_BARS}, label="covered by 95 % bars",
                references=[Reference(y=95.0)],
            ),
            Chart(
                **by_hidden, table="table_hidden", y="seen_error_mm2", by="method", styles=styles, zero=True,
                label="mean square error of joints seen",
            ),
        ]  # fmt: skip
        return Sheet(
            charts=charts,
            columns=2,
            caption="Seen from the right; distance in space of the hidden joints, root mean square over the"
            f" cycle. Bars: {OVER_PEOPLE}.",
        )
