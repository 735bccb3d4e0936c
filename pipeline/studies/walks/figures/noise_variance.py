"""Error of approach II against the noise variance sigma²: zhang2007 figure 3."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from pipeline.charts import Axis, Chart, Reference, Sheet
from pipeline.palette import Style
from pipeline.scenes import Columns, Matrix, Notes, Rows
from pipeline.studies.eigenwalkers.model import EigenwalkersModel
from pipeline.studies.experiment import Experiment
from pipeline.studies.figure_inputs import sd, tidy
from pipeline.studies.replicated import OVER_PEOPLE
from pipeline.studies.study import Figure, Recorder, Tables, Traits
from pipeline.studies.walks.figures.view_errors import Inputs, over_walkers
from pipeline.studies.walks.known_view import KnownView
from pipeline.studies.walks.methods import AVERAGE_WALKER, MAP
from pipeline.validation import InvalidInput

PUBLISHED = Reference(x="zhang2007_optimal_variance", label="published 70")


class NoiseVariance(Figure):
    """Figure of the error of approach II against the noise variance sigma²."""

    model = EigenwalkersModel
    sweep = KnownView
    traits = Traits(
        over_people=("table", "table_nested"),
        abscissa="sigma2_mm2",
        sequence="sigma2_mm2",
        population_parts=2,
    )

    def validate(self, experiment: Experiment) -> None:
        """Raise InvalidInput if approach II is not among the methods of the sweep."""
        sweep = experiment.sweep
        if isinstance(sweep, KnownView) and MAP.name not in sweep.methods:
            raise InvalidInput(
                "the figure of the error against σ² needs approach II, the method map",
                "sweep.methods",
                "a list that contains map",
                code="needs_map",
            )

    def tables(self, inputs: Inputs) -> Tables:
        """Return mean errors in ``table``, errors by view in ``table_views`` and by walker in ``table_people``.

        ``table_paired``: error that each σ² adds to that of the best σ², walker by walker; ``table_nested``: error with
        the σ² that other people choose for each walker, and error of the average walker.
        """
        sweep, by = inputs.sweep, ["person", "walker", "method"]
        curve = {
            "absolute_error_mm2": ("absolute_error_mm2", "mean"),
            "absolute_error_se_mm2": ("absolute_error_mm2", lambda each: sd(each) / np.sqrt(len(each))),
        }
        walkers = sweep.rows.groupby(by, as_index=False)["absolute_error_mm2"].mean()
        sigma2, nested = sweep.sigma2(inputs.samples), sweep.chosen(inputs.samples)
        average = walkers[
            (walkers["method"] == AVERAGE_WALKER.name) & walkers["walker"].isin(nested["walker"])
        ]
        errors = sigma2.pivot(index=["person", "walker"], columns="sigma2_mm2", values="absolute_error_mm2")
        added = errors.sub(errors[errors.mean().idxmin()], axis=0).stack().rename("added_error_mm2")
        return {
            "table_paired": over_walkers(
                added.reset_index(), ["sigma2_mm2"], {added.name: (added.name, "mean")}
            ),
            "table": over_walkers(sigma2, ["sigma2_mm2"], curve),
            "table_people": tidy(sigma2.drop(columns="method"), by=["walker", "sigma2_mm2"]),
            "table_views": tidy(
                {
                    "view_angle_deg": sweep.view_angle_deg[:, None],
                    "sigma2_mm2": sweep.sigma2_mm2,
                    "absolute_error_mm2": sweep.map_errors.view_mm2,
                },
                by=["view_angle_deg", "sigma2_mm2"],
            ),
            "table_nested": tidy(pd.concat([nested, average]), by=["walker", "method"]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Charts of the error against σ²: the mean with our best and the published σ², and errors at single views."""
        table, views = tables["table"], inputs.sweep.view_angle_deg
        best = table["absolute_error_mm2"].to_numpy().argmin()
        best_sigma2 = table["sigma2_mm2"][best]
        inside = 0 < best < len(table) - 1
        sigma2 = partial(
            Chart,
            x="sigma2_mm2",
            abscissa=Axis(label="noise variance σ²", limits=(0.0, table["sigma2_mm2"].max())),
            y="absolute_error_mm2",
        )
        mean = sigma2(
            label="mean square error",
            styles={"map": Style("", "map")},
            references=[
                *([Reference(x=best_sigma2, label=f"here {best_sigma2:g}")] if inside else []),
                PUBLISHED,
            ],
        )
        added = sigma2(
            table="table_paired",
            y="added_error_mm2",
            label="error added to the least",
            styles={"map": Style("", "map")},
            references=[PUBLISHED],
        )
        half = views[views >= 0] if (views >= 0).any() else views
        some_views = half[np.unique(np.linspace(0, len(half) - 1, len(_COLOURS)).astype(int))]
        of_views = sigma2(
            label="error of single views",
            name="absolute_error_of_views_mm2",
            table="table_views",
            by="view_angle_deg",
            styles={
                str(v): Style(f"{v:g}°".replace("-", "−"), colour)
                for v, colour in zip(some_views, _COLOURS, strict=False)
            },
        )
        at_end = f" No optimum inside the range: the lowest error is at its end, {best_sigma2:g} mm²."
        caption = f"Bands: {inputs.banded}; in (b) {OVER_PEOPLE}." + ("" if inside else at_end)
        return Sheet(charts=[mean, added, of_views], columns=3, panel_size=(2.5, 2.2), caption=caption)

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record curves of the error against sigma², and a matrix of the error by view and sigma²."""
        views = inputs.sweep.map_errors.view_mm2
        valley = np.column_stack([np.arange(len(views)), views.argmin(axis=1)])
        with begin(timeline="sigma2_mm2") as rec:
            rec.matrix("matrices/error_by_view_and_sigma2", views, paths={"valley": (valley, "orange")})
            matrix = Matrix(name="error: view angle down, σ² across; line: best σ²")
            rec.blueprint(Columns(Rows(*rec.plots), Rows(matrix, Notes()), shares=(3, 2)))


_COLOURS = ("orange", "green", "purple", "sky")
