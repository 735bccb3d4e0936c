"""Errors of walks from keypoints and coverage of their error bars, by heading and by left-out laboratory."""

from __future__ import annotations

from functools import partial
from typing import Any, cast

import pandas as pd

from pipeline.charts import Axis, Chart, Lines, Reference, Sheet
from pipeline.palette import Style
from pipeline.studies.figure_inputs import tidy
from pipeline.studies.replicated import OVER_PEOPLE
from pipeline.studies.study import Picture, Tables
from walk3d.film.study.headings import KeypointHeadings, KeypointLaboratories
from walk3d.film.study.measured import ERRORS, LEVELS_PERCENT, VERDICTS
from walk3d.film.study.shown import METHODS, Inputs, KeypointFigure
from walk3d.film.study.tables import errors_by, views_by

EVERYBODY = "everybody"

MIN_ROWS = 3
"""Minimum number of table rows, including the row of all people, for charts by laboratory."""


class KeypointLaboratoriesFigure(KeypointFigure):
    """Errors and coverage of error bars by left-out laboratory."""

    sweep = KeypointLaboratories

    def tables(self, inputs: Inputs) -> Tables:
        """Return tables of errors, views and coverage of error bars, by laboratory and for all people.

        ``table``: errors by laboratory and method, and for all people.  ``table_views``: view, cadence,
        coverage.
        """
        people, dataset, by = inputs.sweep.people, inputs.dataset, ["laboratory", "method"]
        laboratory = dict(zip(dataset.people, dataset.sources.tolist(), strict=True))
        clips = inputs.sweep.clips.drop(columns=["condition", *VERDICTS])
        laboratory_of_clip = clips["person"].map(laboratory).rename("laboratory")
        errors = [
            errors_by(people.assign(laboratory=names), by)
            for names in (people["person"].map(laboratory), EVERYBODY)
        ]
        views = [
            *views_by(clips, laboratory_of_clip),
            *views_by(clips, laboratory_of_clip.where(laboratory_of_clip.isna(), EVERYBODY)),
        ]
        return {
            "table": tidy(pd.concat(errors), by=by),
            "table_views": tidy(views, by=["laboratory"]),
            "table_clips": tidy(
                clips.assign(laboratory=laboratory_of_clip),
                by=["person", "walk", "heading_deg", "overground"],
            ),
            "table_people": tidy(people[["person", "method", *ERRORS]], by=["person", "method"]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Draw the errors of joints and knees by laboratory, and the coverage of 95 % error bars.

        The coverage is drawn for error bars as computed and as calibrated.
        """
        words = {name: name.replace("_", " ") for name in tables["table"]["laboratory"]}
        if len(words) < MIN_ROWS:
            return Sheet(
                caption="One laboratory: keypoints_headings shows its errors, and no picture is drawn."
            )
        chart = partial(Chart, x="laboratory", abscissa=Axis(words=words))
        covered = partial(
            chart,
            table="table_views",
            limits=(80.0, 100.0),
            references=[Reference(y=95.0)],
            label="within 95 % bars",
        )
        charts = [
            chart(y="error_mm", by="method", styles=METHODS, label="error of joints", zero=True),
            chart(y="knee_error_deg", by="method", styles=METHODS, label="error of knees", zero=True),
            covered(y="covered_95_raw_percent", styles={"raw": Style("", "baseline")}, title="as computed"),
            covered(
                y="covered_95_percent",
                styles={"all": Style("", "map")},
                title="calibrated on other laboratories",
            ),
        ]
        return Sheet(
            charts=charts,
            columns=2,
            caption=f"{len(tables['table_clips'])} simulated clips, as in keypoints_headings, of people whose"
            " laboratory is left out of the model and of the bars; of one laboratory, the person."
            f" Bands: {OVER_PEOPLE}.",
        )

    def draw(self, inputs: Inputs, tables: Tables, picture: Picture) -> None:
        """Draw the charts if the data come from several laboratories."""
        if picture.drawn:
            picture.charts()

    def draws_more_than(self, sheet: Sheet) -> bool:
        """Return False, because the figure draws no more than the charts on the page."""
        return False


class KeypointHeadingsFigure(KeypointFigure):
    """Errors and coverage of error bars by heading."""

    sweep = KeypointHeadings

    def tables(self, inputs: Inputs) -> Tables:
        """Return tables of errors, views and coverage of error bars, by heading.

        ``table``: errors by heading and method.  ``table_views``: view, cadence, coverage.  ``table_clips``:
        clips.

        Headings to either side are pooled.  An angle's error is the mean over clips of its root mean square error.
        """
        clips = inputs.sweep.clips.drop(columns=["condition", *VERDICTS])
        by = ["heading_deg", "method"]
        people = inputs.sweep.people[["person", *by, *ERRORS]]
        people = people.assign(heading_deg=people["heading_deg"].abs())
        return {
            "table": tidy(errors_by(people, by), by=by),
            "table_views": tidy(views_by(clips, clips["heading_deg"].abs()), by=["heading_deg"]),
            "table_clips": tidy(clips, by=["person", "walk", "heading_deg", "overground"]),
            "table_people": tidy(people, by=["person", *by]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Draw the errors of joints and knees by heading, the error of the view, and the coverage of error bars."""
        options = cast(KeypointHeadings, inputs.experiment.sweep)
        heading = partial(
            Chart, x="heading_deg",
            abscissa=Axis(label="heading, 0 towards the camera", ticks=sorted(set(tables["table"]["heading_deg"]))),
            zero=True,

        )  # fmt: skip
        of_view = Lines(
            table="table_views",
            y="view_error_90_deg",
            styles={"90": Style("90 % of clips", "map", line="dashed")},
        )
        covered: list[dict[str, Any]] = [
            {
                "table": "table_views",
                "y": f"covered_{p}{kind}_percent",
                "styles": {f"{p}{kind}": Style(label if p == LEVELS_PERCENT[0] else "", colour, line=line)},
            }
            for p in LEVELS_PERCENT
            for kind, label, colour, line in (
                ("", "calibrated on others", "map", "solid"),
                ("_raw", "as computed", "baseline", "dotted"),
            )
        ]
        charts = [
            heading(y="error_mm", by="method", styles=METHODS, label="error of joints"),
            heading(y="knee_error_deg", by="method", styles=METHODS, label="error of knees"),
            heading(
                table="table_views", y="view_error_median_deg", styles={"median": Style("median", "map")},
                also=[of_view], label="error of the view",
            ),
            heading(
                **covered[0], also=[Lines(**kwargs) for kwargs in covered[1:]], label="covered by bars",
                limits=(0.0, 100.0), references=[Reference(y=float(p), label=f"{p} %") for p in LEVELS_PERCENT],
            ),
        ]  # fmt: skip
        return Sheet(
            charts=charts,
            columns=2,
            caption=f"{len(tables['table_clips'])} simulated clips of people left out of the model: perspective,"
            f" white and slow error, a bias of {options.bias_mm:g} mm of each joint, missing and exchanged keypoints;"
            " distance, path, view, phase and cadence unknown; overground and on a treadmill, either side."
            f" Bands: {OVER_PEOPLE}. Bars: of {', '.join(map(str, LEVELS_PERCENT))} %.",
        )
