"""Error of approach II against sigma²: zhang2007 figure 3."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Reference, Sheet
from pipeline.core import errors
from pipeline.palette import Style
from pipeline.scenes import Columns, Matrix, Notes, Rows
from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.experiment import Experiment
from pipeline.studies.figure_inputs import FigureInputs, sd, tidy
from pipeline.studies.replicated import interval_over_people
from pipeline.studies.study import Figure
from pipeline.studies.walks.known_view import KnownView, KnownViewErrors
from pipeline.studies.walks.methods import Method, Null
from pipeline.validation import InvalidInput

if TYPE_CHECKING:
    from pipeline.recordings import Recorder

PUBLISHED = Reference(x="zhang2007_optimal_variance", label="published 70")


Inputs = FigureInputs[FourierSamples, Eigenwalkers, KnownViewErrors]


@dataclass(kw_only=True)
class NoiseVariance(Figure):
    """Error of approach II against sigma²."""

    model = EigenwalkersModel
    sweep = KnownView
    over_people = ("table", "table_nested")
    sequence = "sigma2_mm2"

    def validate(self, experiment: Experiment) -> None:
        """Validate the options against the sweep's.  Raises InvalidInput if approach II is not among its methods."""
        sweep = experiment.sweep
        if isinstance(sweep, KnownView) and Method.map not in sweep.methods:
            raise InvalidInput(
                "σ² is swept for approach II alone", where="sweep.methods", expected="map among the methods"
            )

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """``table``: mean over walkers and views; ``table_views``: per view; ``table_people``: per walker.

        ``table_nested``: σ² that others choose for each walker, on models without that walker, and the average walker.
        """
        sweep = inputs.sweep
        sigma2, path, views = sweep.sigma2_mm2, sweep.path_walker_mm2, sweep.view_angle_deg
        person, nested = inputs.dataset.person, sweep.nested
        chosen = np.arange(len(nested))  # nobody, where people are too few to choose for others
        average = errors.walker_error(
            sweep.null_error_mm2[sweep.nulls.tolist().index(Null.average_walker)]
        ).mean(axis=1)
        low, high = interval_over_people(person, path)
        return {
            "table": tidy(
                {
                    "sigma2_mm2": sigma2,
                    "absolute_error_mm2": path.mean(axis=0),
                    "absolute_error_mm2_low": low,
                    "absolute_error_mm2_high": high,
                    "absolute_error_se_mm2": sd(path, 0) / np.sqrt(len(path)),
                },
                by=["sigma2_mm2"],
            ),
            "table_people": tidy(
                {
                    "person": person[:, None],
                    "walker": np.array(inputs.samples)[:, None],
                    "sigma2_mm2": sigma2,
                    "absolute_error_mm2": path,
                },
                by=["walker", "sigma2_mm2"],
            ),
            "table_views": tidy(
                {
                    "view_angle_deg": views[:, None],
                    "sigma2_mm2": sigma2,
                    "absolute_error_mm2": sweep.path_view_mm2,
                },
                by=["view_angle_deg", "sigma2_mm2"],
            ),
            "table_nested": tidy(
                {
                    "person": np.tile(person[chosen].astype(str), 2),
                    "walker": np.tile(np.asarray(inputs.samples, dtype=str)[chosen], 2),
                    "method": np.repeat([Method.map, Null.average_walker], len(chosen)).astype(str),
                    "sigma2_mm2": np.concatenate([sigma2[nested], np.full(len(chosen), np.nan)]),
                    "absolute_error_mm2": np.concatenate([path[chosen, nested], average[chosen]]),
                },
                by=["walker", "method"],
            ),
        }

    def charts(self, inputs: Inputs, tables: dict[str, pd.DataFrame]) -> Sheet:
        """Mean error against σ², the optimum and the published one marked, and the error of single views."""
        table, views = tables["table"], inputs.sweep.view_angle_deg
        best = int(table["absolute_error_mm2"].to_numpy().argmin())
        here = float(table["sigma2_mm2"][best])
        inside = 0 < best < len(table) - 1
        sigma2 = partial(
            Chart,
            x="sigma2_mm2",
            x_label="noise variance σ²",
            y="absolute_error_mm2",
            x_limits=(0.0, float(table["sigma2_mm2"].max())),
        )
        mean = sigma2(
            label="mean square error",
            styles={"map": Style("all views", "map")},
            references=[*([Reference(x=here, label=f"here {here:g}")] if inside else []), PUBLISHED],
        )
        shown = views[np.unique(np.linspace(0, len(views) - 1, len(_COLOURS)).astype(int))]
        of_views = sigma2(
            label="mean square error of single views",
            name="absolute_error_of_views_mm2",
            table="table_views",
            by="view_angle_deg",
            styles={
                str(v): Style(f"{v:g}°".replace("-", "−"), of) for v, of in zip(shown, _COLOURS, strict=False)
            },
        )
        at_end = f" No optimum inside the range: the lowest error is at its end, {here:g} mm²."
        caption = "Band: 95 % interval of the mean over people." + ("" if inside else at_end)
        return Sheet(charts=[mean, of_views], columns=2, caption=caption)

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], begin: Recorder) -> None:
        """The curves over sigma², and the error of every view at every sigma² with its valley."""
        views = inputs.sweep.path_view_mm2
        valley = np.column_stack([np.arange(len(views)), views.argmin(axis=1)])
        with begin(timeline="sigma2_mm2") as rec:
            rec.matrix("matrices/error_by_view_and_sigma2", views, paths={"valley": (valley, "orange")})
            matrix = Matrix(name="error: view angle down, σ² across; line: best σ²")
            rec.blueprint(Columns(Rows(*rec.plots), Rows(matrix, Notes()), shares=(3, 2)))


_COLOURS = ("purple", "orange", "green", "grey", "yellow", "amber", "sky")
