"""Error of approach II against sigma²: zhang2007 figure 3."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline import pictures, recordings
from pipeline.studies.eigenwalkers.model import Eigenwalkers, EigenwalkersModel
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.experiment import Experiment
from pipeline.studies.figure_inputs import FigureInputs, sd, tidy
from pipeline.studies.replicated import interval_over_people
from pipeline.studies.study import Figure
from pipeline.studies.walks.known_view import KnownView, KnownViewErrors
from pipeline.studies.walks.methods import Method
from pipeline.validation import InvalidInput

PUBLISHED_OPTIMUM_MM2 = 70.0


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

        ``table_nested``: σ² that others choose for each walker, on models without that walker.
        """
        sweep = inputs.sweep
        sigma2, path, views = sweep.sigma2_mm2, sweep.path_walker_mm2, sweep.view_angle_deg
        person, nested = inputs.dataset.person, sweep.nested
        chosen = np.arange(len(nested))  # nobody, where people are too few to choose for others
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
                    "person": person[chosen].astype(str),
                    "walker": np.asarray(inputs.samples, dtype=str)[chosen],
                    "sigma2_mm2": sigma2[nested],
                    "absolute_error_mm2": path[chosen, nested],
                },
                by=["walker"],
            ),
        }

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Mean error against sigma² with its standard error, the optimum and the published one marked."""
        table = tables["table"]
        sigma2, error = table["sigma2_mm2"].to_numpy(), table["absolute_error_mm2"].to_numpy()
        best = int(error.argmin())
        here = float(sigma2[best])
        inside = 0 < best < len(sigma2) - 1
        first, last = sorted([(here, f"here {here:g}"), (PUBLISHED_OPTIMUM_MM2, "published 70")])
        if not inside:
            references = [("x", PUBLISHED_OPTIMUM_MM2, "published 70")]
        elif last[0] - first[0] < 0.15 * float(sigma2[-1]):  # one label for two neighbouring lines
            references = [("x", first[0], ""), ("x", last[0], f"left {first[1]}, right {last[1]}")]
        else:
            references = [("x", first[0], first[1]), ("x", last[0], last[1])]
        remark = (
            "" if inside else f" No optimum inside the range: the lowest error is at its end, {here:g} mm²."
        )
        panel = pictures.Panel(
            y="absolute_error_mm2",
            band=("absolute_error_mm2_low", "absolute_error_mm2_high"),
            xlabel="Variance $\\sigma^2$ (mm$^2$)",
            ylabel="Average absolute error (mm$^2$)",
            xlim=(0, float(sigma2[-1])),
            references=references,
        )
        pictures.draw_lines(
            stem,
            [panel],
            table,
            x="sigma2_mm2",
            caption=f"{inputs.caption} Band: 95 % interval of the mean over people.{remark}",
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """The curve over sigma², and the error of every view at every sigma² with its valley."""
        sweep = inputs.sweep
        views = sweep.path_view_mm2
        shown = np.unique(np.linspace(0, len(sweep.view_angle_deg) - 1, 7).astype(int))
        valley = np.column_stack([np.arange(len(views)), views.argmin(axis=1)])
        with inputs.recording(folder, timeline="sigma2_mm2") as rec:
            rec.curves(
                tables["table"],
                x="sigma2_mm2",
                y="absolute_error_mm2",
                sd="absolute_error_se_mm2",
                styles=recordings.Style("all views, ±1 standard error", "map"),
                entity="curves/absolute_error_mm2/map",
            )
            for view in shown:
                angle = sweep.view_angle_deg[view]
                name = f"view_{'minus_' if angle < 0 else ''}{abs(angle):.0f}"
                rec.curve(
                    f"views/absolute_error_mm2/{name}",
                    sweep.sigma2_mm2,
                    views[view],
                    label=f"{angle:g}°",
                    colour=_COLOURS[int(np.flatnonzero(shown == view)[0])],
                )
            rec.matrix("matrices/error_by_view_and_sigma2", views, paths={"valley": (valley, "orange")})
            rec.blueprint(
                recordings.Columns(
                    recordings.Rows(
                        recordings.Plot(name="mean error (mm²) against σ² (mm²)", origin="curves"),
                        recordings.Plot(name="error (mm²) of single views against σ²", origin="views"),
                    ),
                    recordings.Rows(
                        recordings.Matrix(name="error: view angle down, σ² across; line: best σ²"),
                        recordings.Notes(),
                    ),
                    shares=(3, 2),
                )
            )


_COLOURS = ("purple", "orange", "green", "grey", "yellow", "amber", "sky")
