"""Figure on the ablation of the anatomical reconstruction, comparable with zhang2007's figure 5."""

from __future__ import annotations

from functools import partial
from typing import Any

import pandas as pd

from pipeline.charts import Axis, Chart, Reference, Sheet
from pipeline.palette import Style
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.replicated import OVER_PEOPLE
from pipeline.studies.study import Figure, Tables, Traits
from pipeline.studies.walks.methods import VIEW
from walk3d.anatomy.study.model import AnatomicalModel, AnatomicalWalkers
from walk3d.anatomy.study.people_intervals import PeopleResampled
from walk3d.anatomy.study.sweeps.ladder import METHODS, STYLES, of_part
from walk3d.anatomy.study.sweeps.setting import Setting
from walk3d.anatomy.study.sweeps.structure import Structure, StructureErrors

Inputs = FigureInputs[FourierSamples, AnatomicalWalkers, StructureErrors]

BASELINE = "map_tuned"
"""Method with which all other methods of the comparisons are compared."""

SHOWN = {name: style for name, style in STYLES.items() if METHODS[name].part}


class StructureLadder(Figure):
    """Error of each step of the ablation, by view and over all views."""

    model = AnatomicalModel
    sweep = Structure
    traits = Traits(sequence="seen_from_deg", timeline="view_angle_deg")

    def tables(self, inputs: Inputs) -> Tables:
        """Return tables of the reconstruction error by method and view, by method, and by walker.

        They are ``table``, ``table_ladder`` and ``table_walkers``.
        """
        model = inputs.model
        people = PeopleResampled(len(model.people), inputs.experiment.seed)
        by_view = {  # errors of each method, people by views
            method: rows.pivot(index="person", columns="view_angle_deg", values="absolute_error_mm2").loc[model.people]
            for method, rows in inputs.sweep.rows.groupby("method", sort=False)
        }  # fmt: skip
        of_view, ladder, walkers = [], [], []
        for method, errors in by_view.items():
            method_errors = errors.mean(axis=1)
            tuned, best, specified = (
                by_view[other][errors.columns].mean(axis=1)
                for other in (BASELINE, "anatomical", "as_specified")
            )
            of_view += [
                {"method": method, "view_angle_deg": view, **people.mean(of_people, "absolute_error_mm2")}
                for view, of_people in errors.items()
            ]
            ladder.append(
                {
                    "method": method,
                    "part": METHODS[method].part,
                    "views": errors.shape[1],
                    "walkers": len(method_errors),
                    **people.mean(method_errors, "absolute_error_mm2"),
                    "absolute_error_median_mm2": method_errors.median(),
                    "absolute_error_worst_mm2": method_errors.max(),
                    **people.reduction_percent(method_errors, tuned, "below_map_percent"),
                    **people.reduction_percent(method_errors, best, "below_whole_percent"),
                    **people.reduction_percent(method_errors, specified, "below_specified_percent"),
                    "walkers_better": (method_errors < tuned).sum(),
                }
            )
            walkers += [
                {"person": who, "walker": who, "method": method, "absolute_error_mm2": error}
                for who, error in method_errors.items()
            ]
        return {
            "table": tidy(of_view, by=["method", "view_angle_deg"]),
            "table_ladder": pd.DataFrame(ladder),
            "table_walkers": tidy(walkers, by=["walker", "method"]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Return charts of the error by view, of the error of each ablation step, and of each person's error.

        The chart of each person's error compares it with the error of MAP.

        The errors of the ablation steps have intervals.
        """
        error = partial(Chart, y="absolute_error_mm2", by="method", label="mean square error")
        step = partial(error, table="table_ladder", x="method")
        walkers = tables["table_walkers"].pivot(index="walker", columns="method", values="absolute_error_mm2")
        pairs = {name: walkers[name].tolist() for name in (BASELINE, "anatomical")}
        top = 1.05 * max(max(values) for values in pairs.values())

        below = tables["table_ladder"].set_index("method")["below_whole_percent"].to_dict()

        def steps(*parts: str, ordered: bool = False) -> dict[str, Any]:
            names = sorted(of_part(*parts), key=lambda name: -below[name]) if ordered else of_part(*parts)
            words = {name: METHODS[name].words for name in names}
            return {
                "abscissa": Axis(words=words),
                "styles": {name: STYLES.get(name, Style("", "black")) for name in words},
            }

        charts = [
            error(**VIEW, styles=SHOWN, zero=True),
            Chart(
                table=pairs, x=BASELINE, y="anatomical",
                abscissa=Axis(label="MAP, σ² chosen by others", unit="mm²", limits=(0.0, top)),
                label="anatomical", unit="mm²", styles=Style("", "green", line="points"),
                limits=(0.0, top), title="a point to each person", references=[Reference(slope=1.0)],
            ),
            step(**steps("added"), zero=True),
            step(**{**steps("settings", "taken away", "varied", ordered=True), "y": "below_whole_percent",
                    "label": "below the whole"}, references=[Reference(y=0.0)]),
            error(**VIEW, styles={n: Style(m.words) for n, m in METHODS.items() if m.part and not m.style},
                  picture=False, name="absolute_error_of_parts_mm2", title="with one part less or more", page=False),
        ]  # fmt: skip
        return Sheet(
            charts=charts,
            columns=2,
            caption=f"The whole has {Setting.harmonics} harmonics. Bands and bars: {OVER_PEOPLE}; settings of each"
            " person chosen by others.",
        )
