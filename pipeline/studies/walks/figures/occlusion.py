"""Hidden joints recovered: our figure of what zhang2007 leaves to future work."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Reference, Sheet
from pipeline.seeding import derive_generator
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.study import Figure
from pipeline.studies.walks.anatomical_model import AnatomicalModel, AnatomicalWalkers
from pipeline.studies.walks.figures.ladder import STYLES, one_row
from pipeline.studies.walks.figures.presentation import BARS, VIEW
from pipeline.studies.walks.people_intervals import PeopleResampled
from pipeline.studies.walks.sweeps.occlusion import AXES, WITH_BARS, HiddenJoints, Occlusion

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
    timeline = "view_angle_deg"

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """``table``: by hidden joints, method and view; ``table_hidden``: over views; bars and walkers beside them.

        ``table_bars`` is over the three axes of the hidden joints, ``table_axes`` has each of them.
        """
        sweep = inputs.sweep
        methods, views = sweep.methods.tolist(), sweep.view_angle_deg
        people = PeopleResampled(len(inputs.model.people), derive_generator(inputs.experiment.seed, "people"))
        away = np.sqrt(sweep.hidden_error_mm2)  # (M, S, P, A)
        seen = sweep.seen_error_mm2
        of_map = methods.index("map_tuned")

        def row(share: np.ndarray, half: np.ndarray) -> dict[str, float]:
            """Per cent covered, with its interval, and mean half width, of numbers (P, …)."""
            each = people.mean(share.reshape(len(share), -1).mean(axis=1))
            return {**one_row(each, "covered_percent"), "half_width_mm": float(half.mean())}

        by_view, whole, bars, of_axes, walkers, covered = [], [], [], [], [], []
        for s, hidden in enumerate(sweep.conditions.tolist()):
            for m, method in enumerate(methods):
                keys = {"hidden": hidden, "method": method}
                by_view += [
                    {
                        **keys,
                        "view_angle_deg": view,
                        **one_row(people.mean(away[m, s, :, a]), "hidden_error_mm"),
                    }
                    for a, view in enumerate(views.tolist())
                ]
                mine, than = away[m, s].mean(axis=1), away[of_map, s].mean(axis=1)
                whole.append(
                    {
                        **keys,
                        **one_row(people.mean(mine), "hidden_error_mm"),
                        **one_row(people.reduction_percent(mine, than), "below_map_percent"),
                        **one_row(people.mean(seen[m, s].mean(axis=1)), "seen_error_mm2"),
                        "walkers_better": int((mine < than).sum()),
                    }
                )
                walkers += [
                    {"person": who, "walker": who, **keys, "hidden_error_mm": float(error)}
                    for who, error in zip(inputs.model.people, mine, strict=True)
                ]
            for m, method in enumerate(WITH_BARS):
                for k, kind in enumerate(BARS):
                    keys = {"hidden": hidden, "method": method, "bars": kind}
                    share, half = 100.0 * sweep.covered[k, m, s], sweep.half_width_mm[k, m, s]  # (P, A, 3)
                    bars.append({**keys, **row(share, half)})
                    of_axes += [
                        {**keys, "axis": axis, **row(share[..., x], half[..., x])}
                        for x, axis in enumerate(AXES)
                    ]
                covered += [
                    {
                        "person": who,
                        "walker": who,
                        "hidden": hidden,
                        "method": method,
                        "bars": kind,
                        "covered_percent": float(share),
                    }
                    for k, kind in enumerate(BARS)
                    for who, share in zip(
                        inputs.model.people, 100.0 * sweep.covered[k, m, s].mean(axis=(1, 2)), strict=True
                    )
                ]
        return {
            "table": _sorted(by_view, ["hidden", "method", "view_angle_deg"]),
            "table_hidden": _sorted(whole, ["hidden", "method"]),
            "table_bars": _sorted(bars, ["hidden", "method", "bars"]),
            "table_axes": _sorted(of_axes, ["hidden", "method", "bars", "axis"]),
            "table_walkers": _sorted(walkers, ["walker", "hidden", "method"]),
            "table_walkers_bars": _sorted(covered, ["walker", "hidden", "method", "bars"]),
        }

    def charts(self, inputs: Inputs, tables: dict[str, pd.DataFrame]) -> Sheet:
        """Distance by hidden joints, and by view; what the bars cover; the error of what is seen."""
        conditions = inputs.sweep.conditions.tolist()
        styles = {name: STYLES[name] for name in inputs.sweep.methods.tolist()}
        distance = partial(
            Chart,
            y="hidden_error_mm",
            label="error of hidden joints",
            by="method",
            styles=styles,
            zero=True,
        )
        by_hidden: dict[str, Any] = {
            "x": "hidden", "x_label": "what is hidden", "words": {name: WORDS[name] for name in conditions}
        }  # fmt: skip
        of_views = [
            distance(**VIEW, where={"hidden": name}, title=f"{WORDS[name]} hidden", name=name,
            picture=name == conditions[-1],
                     page=name == conditions[-1])
            for name in conditions
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
            " cycle. Bars:"
            " 95 % intervals over people.",
        )


def _sorted(rows: list[dict], by: list[str]) -> pd.DataFrame:
    return tidy(pd.DataFrame(rows).to_dict("list"), by=by)
