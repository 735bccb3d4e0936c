"""Errors of walks from keypoints of people whose laboratory no model has seen, and coverage of their bars."""

from __future__ import annotations

from functools import partial

import pandas as pd

from pipeline.charts import Axis, Chart, Reference, Sheet
from pipeline.palette import Style
from pipeline.studies.figure_inputs import tidy
from pipeline.studies.replicated import OVER_PEOPLE
from pipeline.studies.study import Tables
from walk3d.film.study.headings import KeypointLaboratories
from walk3d.film.study.measured import ERRORS, VERDICTS
from walk3d.film.study.shown import METHODS, Inputs, KeypointFigure
from walk3d.film.study.tables import errors_by, views_by

EVERYBODY = "everybody"


class KeypointLaboratoriesFigure(KeypointFigure):
    """Error and coverage by laboratory."""

    sweep = KeypointLaboratories

    def tables(self, inputs: Inputs) -> Tables:
        """``table``: errors by laboratory and method, and of everybody; ``table_views``: view, cadence, coverage."""
        people, dataset, by = inputs.sweep.people, inputs.dataset, ["laboratory", "method"]
        laboratory = dict(zip(dataset.people, dataset.sources.tolist(), strict=True))
        clips = inputs.sweep.clips.drop(columns=["condition", *VERDICTS])
        of = clips["person"].map(laboratory).rename("laboratory")
        errors = [
            errors_by(people.assign(laboratory=names), by)
            for names in (people["person"].map(laboratory), EVERYBODY)
        ]
        views = [*views_by(clips, of), *views_by(clips, of.where(of.isna(), EVERYBODY))]
        return {
            "table": tidy(pd.concat(errors), by=by),
            "table_views": tidy(views, by=["laboratory"]),
            "table_clips": tidy(
                clips.assign(laboratory=of), by=["person", "walk", "heading_deg", "overground"]
            ),
            "table_people": tidy(people[["person", "method", *ERRORS]], by=["person", "method"]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Errors of joints and knees by laboratory; coverage of 95 % bars as computed and calibrated."""
        words = {name: name.replace("_", " ") for name in tables["table"]["laboratory"]}
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
