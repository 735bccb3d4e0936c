"""Figure on the average walker from another laboratory: missing variance, errors and postures."""

from __future__ import annotations

from functools import partial
from string import ascii_lowercase

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Sheet
from pipeline.core import bootstrap, camera, fourier
from pipeline.palette import Style
from pipeline.scenes import PostureRow
from pipeline.skeleton import WALKER15
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.replicated import DRAW, interval_over_people
from pipeline.studies.study import Figure, Picture, Tables, Traits
from pipeline.studies.walks.methods import VIEW
from pipeline.validation import Count
from walk3d.anatomy.study.model import AnatomicalModel, AnatomicalWalkers
from walk3d.author.errors import (
    METHODS,
    NOISE_VARIANCES_MM2,
    POSTURE_VIEWS_DEG,
    AverageWalkerErrors,
    OutsideErrors,
)

Inputs = FigureInputs[FourierSamples, AnatomicalWalkers, OutsideErrors]

STYLES = {
    "average_walker": Style("average walker", "baseline", line="dotted"),
    "least_squares": Style("least squares", "least_squares"),
    "map_70": Style("MAP, σ² as printed", "map", line="dotted"),
    "map_best": Style("MAP, best σ² for this walker", "map", line="dashed"),
    "anybody": Style("anatomical, for anybody", "sky"),
}
WHO = {"people": Style("people learnt from", "grey"), "walker": Style("this walker", "black")}
METHOD_VIEW = ["method", "view_angle_deg"]


class AverageWalkerFigure(Figure):
    """Errors, missing variance and postures of one walker who is outside all data sets."""

    model = AnatomicalModel
    sweep = AverageWalkerErrors
    traits = Traits(timeline="view_angle_deg", in_light_archives=False)

    instants: Count = 5  # instants of the cycle that are drawn

    def tables(self, inputs: Inputs) -> Tables:
        """Return tables of the errors by method and view, and of the missing variance by view.

        ``table`` has the errors at four views, with intervals over the training people.

        ``table_draws`` has the resampled errors.  ``table_curve`` has the errors at all views, without intervals.
        ``table_variance`` has the missing variance of the walker and of the people, by view.
        """
        sweep = inputs.sweep
        rows, draws = sweep.rows.assign(draw=0), sweep.draws
        both = [_with_percent(table) for table in (rows, draws)]
        ends = {
            key: bootstrap.percentile_interval(values.to_numpy())
            for key, values in draws.groupby(METHOD_VIEW)["rms_error_mm"]
        }
        keys = rows[METHOD_VIEW].itertuples(index=False, name=None)
        low, high = np.array([ends[key] for key in keys]).T
        table = both[0].drop(columns=DRAW).assign(rms_error_mm_low=low, rms_error_mm_high=high)
        return {
            "table": tidy(table, by=METHOD_VIEW),
            "table_draws": tidy(both[1], by=[DRAW, *METHOD_VIEW]),
            "table_curve": tidy(sweep.curve, by=METHOD_VIEW),
            "table_variance": tidy(_variance_rows(sweep.variances), by=["who", "view_angle_deg"]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Return charts of the missing variance and of the errors by view.

        The errors at four views have intervals.
        """
        error = partial(
            Chart, **VIEW, y="rms_error_mm", by="method", styles=STYLES, zero=True, label="error in depth, RMS",
            picture=False,
        )  # fmt: skip
        charts = [
            Chart(
                **VIEW, table="table_variance", y="missing_variance_mm2", by="who", styles=WHO, zero=True,
                label="variance of the missing dimension", picture=False,
            ),
            error(table="table_curve", name="rms_error_of_views_mm"),
            error(title="with intervals"),
        ]  # fmt: skip
        return Sheet(charts=charts, columns=3, caption=self.words(inputs, tables))

    def words(self, inputs: Inputs, tables: Tables) -> str:
        """Return the caption: errors of the methods, and the source of the walker with its terms of use."""
        table = tables["table"].set_index(METHOD_VIEW)["rms_error_mm"]
        views = table.index.get_level_values(1).unique()

        def at(method: str) -> str:
            return ", ".join(f"{table[method, view]:.0f}" for view in views)

        printed, average = table["map_70"], table["average_walker"]
        farther = [f"{view:g}°" for view in views if printed[view] > average[view]]
        verdict = f"farther off than it at {', '.join(farther)}" if farther else "nearer than it at each"
        best = inputs.sweep.best_noise_mm2
        largest = ", the largest tried" if best == max(NOISE_VARIANCES_MM2) else ""
        sigma = f"{inputs.sweep.printed_noise_mm2:g}"
        return (
            f"The walker: {inputs.sweep.source}. Error in depth, RMS in mm at {', '.join(f'{v:g}' for v in views)}°:"
            f" average walker, which does not look at the image, {at('average_walker')}; MAP with σ² = {sigma} mm²"
            f" {at('map_70')}, {verdict}; MAP with the σ² that is best for this walker"
            f" ({best:g} mm²{largest}) {at('map_best')}; least squares {at('least_squares')};"
            f" anatomical, for anybody, {at('anybody')}. Intervals are over the people who are learnt from."
        )

    def draw(self, inputs: Inputs, tables: Tables, picture: Picture) -> None:
        """Draw postures from each view as in figure 4 of zhang2007, with the missing dimension along the horizontal."""
        truth, times = inputs.sweep.posture_truth, np.arange(self.instants) / self.instants
        groups = []
        for number, method in enumerate(METHODS[1:], 1):
            rows = []
            for v, view in enumerate(POSTURE_VIEWS_DEG):
                angle = np.radians(view)
                image = camera.project(truth, angle)
                reconstruction = camera.combine(image, inputs.sweep.posture_missing[number, v], angle)
                pair = []
                for coefficients in (truth, reconstruction):
                    space = fourier.synthesise(coefficients, 1.0, times)
                    pair.append(np.stack([camera.missing_dimension(space, angle), space[..., 2]], axis=-1))
                rows.append(PostureRow(label=f"{view:g}°", original=pair[0], reconstructed=pair[1]))
            groups.append((f"({ascii_lowercase[number - 1]}) {STYLES[method].label}", rows))
        picture.postures(groups, WALKER15.bones)


def _with_percent(rows: pd.DataFrame) -> pd.DataFrame:
    """Add a column with the error as a percentage of the average walker's error.

    The average walker's error is that of the same resample and view.
    """
    average = rows[rows["method"] == "average_walker"].set_index([DRAW, "view_angle_deg"])["rms_error_mm"]
    key = pd.MultiIndex.from_frame(rows[[DRAW, "view_angle_deg"]])
    return rows.assign(percent_of_average_walker=100.0 * rows["rms_error_mm"] / average.loc[key].to_numpy())


def _variance_rows(variances: pd.DataFrame) -> pd.DataFrame:
    """Return the mean missing variance of the training people with its interval, and that of the walker, by view."""
    value = "missing_variance_mm2"
    rows = []
    for (is_walker, view), group in variances.groupby([variances["who"] == "walker", "view_angle_deg"]):
        low, high = interval_over_people(group["who"].to_numpy(), group[value].to_numpy())
        rows.append(
            {
                "who": "walker" if is_walker else "people",
                "view_angle_deg": view,
                value: group[value].mean(),
                f"{value}_low": float(low),
                f"{value}_high": float(high),
            }
        )
    return pd.DataFrame(rows)
