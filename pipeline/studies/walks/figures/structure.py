"""The ladder of the anatomical reconstruction: our figure beside zhang2007's figure 5."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Reference, Sheet
from pipeline.palette import Style
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.study import Figure
from pipeline.studies.walks.anatomical_model import AnatomicalModel, AnatomicalWalkers
from pipeline.studies.walks.figures.presentation import VIEW
from pipeline.studies.walks.people_intervals import PeopleResampled
from pipeline.studies.walks.sweeps.ladder import METHODS, STYLES, of_part
from pipeline.studies.walks.sweeps.structure import Structure, StructureErrors

Inputs = FigureInputs[FourierSamples, AnatomicalWalkers, StructureErrors]

BASELINE = "map_tuned"
"""What every method is compared with."""

SHOWN = {name: style for name, style in STYLES.items() if METHODS[name].part}


@dataclass(kw_only=True)
class StructureLadder(Figure):
    """Error of each step of the ladder, by view and in all."""

    model = AnatomicalModel
    sweep = Structure
    sequence = "seen_from_deg"
    timeline = "view_angle_deg"

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """``table``: by method and view; ``table_ladder``: by method; walkers, settings, other sources beside them."""
        sweep, model = inputs.sweep, inputs.model
        people = PeopleResampled(len(model.people), inputs.experiment.seed)
        by_view = {  # method → views, errors (P, A)
            str(name): (sweep.view_angle_deg, error.mean(axis=-1))
            for name, error in zip(sweep.methods, sweep.absolute_error_mm2, strict=True)
        } | {
            str(name): (sweep.view_angle_deg[sweep.part_view], error.mean(axis=-1))
            for name, error in zip(sweep.part_methods, sweep.part_error_mm2, strict=True)
        }
        of_view, ladder, walkers = [], [], []
        for method, (views, errors) in by_view.items():
            few = len(errors[0]) < len(sweep.view_angle_deg)
            at = sweep.part_view if few else slice(None)
            mine = errors.mean(axis=1)
            tuned, best, specified = (
                by_view[other][1][:, at].mean(axis=1) for other in (BASELINE, "anatomical", "as_specified")
            )
            of_view += [
                {
                    "method": method,
                    "view_angle_deg": view,
                    **people.mean(errors[:, a], "absolute_error_mm2"),
                }
                for a, view in enumerate(views.tolist())
            ]
            ladder.append(
                {
                    "method": method,
                    "part": METHODS[method].part,
                    "views": len(views),
                    "walkers": len(mine),
                    **people.mean(mine, "absolute_error_mm2"),
                    "absolute_error_median_mm2": float(np.median(mine)),
                    "absolute_error_worst_mm2": float(mine.max()),
                    **people.reduction_percent(mine, tuned, "below_map_percent"),
                    **people.reduction_percent(mine, best, "below_whole_percent"),
                    **people.reduction_percent(mine, specified, "below_specified_percent"),
                    "walkers_better": int((mine < tuned).sum()),
                }
            )
            walkers += [
                {"person": who, "walker": who, "method": method, "absolute_error_mm2": float(error)}
                for who, error in zip(model.people, mine, strict=True)
            ]
        chosen = sweep.methods.tolist()[2:]  # the first two have no setting
        return {
            "table": tidy(of_view, by=["method", "view_angle_deg"]),
            "table_ladder": pd.DataFrame(ladder),
            "table_walkers": tidy(walkers, by=["walker", "method"]),
            "table_settings": tidy(
                {
                    "walker": list(model.people),
                    "method": np.array(chosen)[:, None],
                    "noise_variance_mm2": sweep.noise_variance_mm2[2:],
                    **{
                        name: np.where(np.isfinite(of), of, 0.0)  # 0: lengths say nothing
                        for name, of in (
                            ("length_factor", sweep.length_factor[2:]),
                            ("pair_factor", sweep.pair_factor[2:]),
                            ("shrinkage", sweep.shrinkage[2:]),
                            ("harmonics", sweep.harmonics[2:]),
                        )
                    },
                },
                by=["walker", "method"],
            ),
            "table_sources": self._sources(inputs, by_view),
        }

    @staticmethod
    def _sources(inputs: Inputs, by_view: dict[str, tuple[np.ndarray, np.ndarray]]) -> pd.DataFrame:
        """Errors by source, learnt from everybody else and from the other sources alone, at the same views."""
        sweep, sources = inputs.sweep, inputs.model.sources
        rows = []
        for source in sorted(set(sources.tolist())):
            of = sources == source
            resampled = PeopleResampled(int(of.sum()), inputs.experiment.seed)
            for number, method in enumerate(sweep.source_methods.tolist()):
                by = {"person": by_view[method][1][:, sweep.part_view]}
                if sweep.source_error_mm2.shape[1]:
                    by["source"] = sweep.source_error_mm2[number]
                for left_out, errors in by.items():
                    values = errors[of].mean(axis=1)
                    rows.append(
                        {
                            "source": source,
                            "left_out": left_out,
                            "method": method,
                            "walkers": int(of.sum()),
                            **resampled.mean(values, "absolute_error_mm2"),
                            "absolute_error_median_mm2": float(np.median(values)),
                            "absolute_error_worst_mm2": float(values.max()),
                        }
                    )
        return tidy(rows, by=["source", "left_out", "method"])

    def charts(self, inputs: Inputs, tables: dict[str, pd.DataFrame]) -> Sheet:
        """Error against view; every step with its interval; the whole against MAP, person by person."""
        error = partial(Chart, y="absolute_error_mm2", by="method", label="mean square error")
        step = partial(error, table="table_ladder", x="method")
        walkers = tables["table_walkers"].pivot(index="walker", columns="method", values="absolute_error_mm2")
        pairs = {name: walkers[name].tolist() for name in (BASELINE, "anatomical")}
        top = 1.05 * max(max(values) for values in pairs.values())

        below = tables["table_ladder"].set_index("method")["below_whole_percent"].to_dict()

        def steps(*parts: str, ordered: bool = False) -> dict[str, Any]:
            names = sorted(of_part(*parts), key=lambda name: -below[name]) if ordered else of_part(*parts)
            words = {name: METHODS[name].words for name in names}
            return {"words": words, "styles": {name: STYLES.get(name, Style("", "black")) for name in words}}

        charts = [
            error(**VIEW, styles=SHOWN, zero=True),
            Chart(
                table=pairs, x=BASELINE, x_label="MAP, σ² chosen by others", x_unit="mm²", y="anatomical",
                label="anatomical", unit="mm²", styles=Style("", "green", line="points"), x_limits=(0.0, top),
                limits=(0.0, top), note="a point to each person", references=[Reference(slope=1.0)],
            ),
            step(**steps("added"), zero=True),
            step(**{**steps("settings", "taken away", "varied", ordered=True), "y": "below_whole_percent",
                    "label": "below the whole", "unit": "%"}, references=[Reference(y=0.0)]),
            error(**VIEW, styles={n: Style(m.words) for n, m in METHODS.items() if m.part and not m.style},
                  picture=False, name="absolute_error_of_parts_mm2", title="with one part less or more", page=False),
        ]  # fmt: skip
        return Sheet(
            charts=charts,
            columns=2,
            caption="The whole has four. Bands and bars: 95 % intervals over people; settings of each person chosen by"
            " others.",
        )
