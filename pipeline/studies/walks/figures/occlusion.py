"""Hidden joints recovered: our figure of what zhang2007 leaves to future work."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from pipeline import pictures, recordings
from pipeline.seeding import derive_generator
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.study import Figure
from pipeline.studies.walks.anatomical_model import AnatomicalModel, AnatomicalWalkers
from pipeline.studies.walks.figures.ladder import one_row, points_of
from pipeline.studies.walks.figures.presentation import VIEW_AXIS
from pipeline.studies.walks.people_intervals import PeopleResampled
from pipeline.studies.walks.sweeps.ladder import STYLES
from pipeline.studies.walks.sweeps.occlusion import METHODS, WITH_BARS, HiddenJoints, Occlusion

Inputs = FigureInputs[FourierSamples, AnatomicalWalkers, HiddenJoints]

WORDS = {
    "head": "head",
    "feet": "both feet",
    "far_arm": "far arm",
    "far_leg": "far leg",
    "far_side": "far arm and leg",
    "own": "own choice",
}


@dataclass(kw_only=True)
class HiddenJointErrors(Figure):
    """Errors and bars of hidden joints."""

    model = AnatomicalModel
    sweep = Occlusion

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """``table``: by hidden joints, method and view; ``table_hidden``: over views; bars and walkers beside them.

        ``table_bars`` is over the three axes of the hidden joints, ``table_axes`` has each of them.
        """
        rows, bars = inputs.sweep.rows, inputs.sweep.bars
        people = PeopleResampled(len(inputs.model.people), derive_generator(inputs.experiment.seed, "people"))
        which = ["hidden", "method"]

        def groups(table: pd.DataFrame, by: list[str]) -> Iterator[tuple[dict[str, Any], pd.DataFrame]]:
            for keys, of in table.groupby(by, sort=False):
                yield dict(zip(by, keys, strict=True)), of

        def mean(of: pd.DataFrame, column: str) -> dict[str, float]:
            return one_row(people.mean(of[column].to_numpy()), column)

        def covering(table: pd.DataFrame, by: list[str]) -> pd.DataFrame:
            """Per cent covered, with its interval, and mean half width."""
            found = [
                {**keys, **mean(of, "covered_percent"), "half_width_mm": of["half_width_mm"].mean()}
                for keys, of in groups(table, by)
            ]
            return tidy(found, by=by)

        by_view = [
            {**keys, **mean(of, "hidden_error_mm")} for keys, of in groups(rows, [*which, "view_angle_deg"])
        ]
        each = rows.groupby(["person", *which], sort=False).mean().reset_index()
        whole = []
        for keys, of in groups(each, which):
            baseline = each[(each["hidden"] == keys["hidden"]) & (each["method"] == "map_tuned")]
            mine, than = (table["hidden_error_mm"].to_numpy() for table in (of, baseline))
            whole.append(
                {
                    **keys,
                    **mean(of, "hidden_error_mm"),
                    **one_row(people.reduction_percent(mine, than), "below_map_percent"),
                    **mean(of, "seen_error_mm2"),
                    "walkers_better": int((mine < than).sum()),
                }
            )
        kinds = [*which, "bars"]
        numbers = ["covered_percent", "half_width_mm"]
        over_axes = bars.groupby(["person", *kinds], sort=False)[numbers].mean().reset_index()
        who = ["person", "walker"]
        return {
            "table": tidy(by_view, by=[*which, "view_angle_deg"]),
            "table_hidden": tidy(whole, by=which),
            "table_bars": covering(over_axes, kinds),
            "table_axes": covering(bars, [*kinds, "axis"]),
            "table_walkers": tidy(
                each.assign(walker=each["person"])[[*who, *which, "hidden_error_mm"]], by=["walker", *which]
            ),
            "table_walkers_bars": tidy(
                over_axes.assign(walker=over_axes["person"])[[*who, *kinds, "covered_percent"]],
                by=["walker", *kinds],
            ),
        }

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Distance by hidden joints, and by view where most is hidden; what the bars cover and how wide they are."""
        conditions = inputs.sweep.rows["hidden"].unique().tolist()
        styles = {name: STYLES[name] for name in METHODS}
        places = [float(place) for place in range(len(conditions))]
        most = conditions[-1]
        panel = partial(pictures.Panel, xticks=places, xwords=[WORDS[name] for name in conditions], xlabel="")
        calibrated = tables["table_bars"][tables["table_bars"]["bars"] == "calibrated"]
        panels = [
            panel(
                series=points_of(tables["table_hidden"], conditions, "hidden", "hidden_error_mm", styles),
                ylabel="Error of hidden joints (mm)",
                from_zero=True,
            ),
            pictures.Panel(
                y="hidden_error_mm",
                band=("hidden_error_mm_low", "hidden_error_mm_high"),
                x="view_angle_deg",
                where={"hidden": most},
                title=f"{WORDS[most]} hidden",
                xlabel=VIEW_AXIS,
                ylabel="Error of hidden joints (mm)",
                xticks=30,
                from_zero=True,
            ),
            panel(
                series=points_of(
                    calibrated, conditions, "hidden", "covered_percent", {m: styles[m] for m in WITH_BARS}
                ),
                ylabel="Covered by 95 % bars (%)",
                references=[("y", 95.0, "")],
            ),
            panel(
                series=points_of(tables["table_hidden"], conditions, "hidden", "seen_error_mm2", styles),
                ylabel="Error of joints seen (mm$^2$)",
                from_zero=True,
            ),
        ]
        pictures.draw_lines(
            stem,
            panels,
            tables["table"],
            by="method",
            styles=styles,
            columns=2,
            legend="figure",
            caption=f"{inputs.caption} Seen from the right; distance in space of the hidden joints, root mean square"
            " over the cycle. Bars: 95 % intervals over people.",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Error over view angle for each set of hidden joints."""
        table = tables["table"]
        half = (table["hidden_error_mm_high"] - table["hidden_error_mm_low"]) / (2 * 1.96)
        conditions = inputs.sweep.rows["hidden"].unique().tolist()
        with inputs.recording(folder, timeline="view_angle_deg") as rec:
            for hidden in conditions:
                rec.curves(
                    table.assign(half=half),
                    x="view_angle_deg",
                    y="hidden_error_mm",
                    by="method",
                    sd="half",
                    where={"hidden": hidden},
                    styles={name: STYLES[name] for name in METHODS},
                    entity=f"curves/{hidden}/{{series}}",
                )
            plots = [
                recordings.Plot(name=f"{WORDS[hidden]} hidden: error (mm)", origin=f"curves/{hidden}")
                for hidden in conditions
            ]
            rec.blueprint(recordings.Columns(recordings.Rows(*plots), recordings.Notes(), shares=(2, 1)))
