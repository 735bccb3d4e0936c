"""Errors of walks from keypoints under degraded conditions, or without parts of the reconstruction."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import partial
from typing import cast

import numpy as np
import pandas as pd

from pipeline.charts import Axis, Chart, Lines, Reference, Sheet
from pipeline.palette import Style
from pipeline.studies.figure_inputs import tidy
from pipeline.studies.replicated import OVER_PEOPLE
from pipeline.studies.study import Tables
from walk3d.film.study.changes import ChangedErrors, KeypointChanges
from walk3d.film.study.conditions import Condition
from walk3d.film.study.kinds import FILM_KINDS
from walk3d.film.study.measured import ERRORS, VERDICTS
from walk3d.film.study.shown import Inputs, KeypointFigure
from walk3d.film.study.tables import errors_by, views_by

ROW_HEIGHT = 0.17
"""Height of one condition's row in the figure, inches."""
OURS, AVERAGE = "keypoint_walk", "average_walker"
AXIS_ENDS = (("error_mm", "joints", 40.0), ("knee_error_deg", "knees", 10.0))
MAX_VIEW_DEG = 10.0
"""Upper limits of the axes, so that a few clips with a mistaken view do not compress all others."""


class KeypointChangesFigure(KeypointFigure):
    """Errors, view, coverage of error bars and verdicts by condition."""

    sweep = KeypointChanges

    def tables(self, inputs: Inputs) -> Tables:
        """Return tables of errors, views and verdicts by condition, and tables of amateur films.

        ``table``: errors by condition and method.  ``table_changes``: errors minus those of the same clips
        under the usual condition.

        ``table_views``: view, cadence, coverage, verdicts, labels.  ``table_clips``: clips.  ``table_kinds`` and
        ``table_films``: amateur films, by kind and one by one.
        """
        options = cast(KeypointChanges, inputs.experiment.sweep)
        changes = {"change": "kind", "level": "level"}

        def with_words(rows: pd.DataFrame) -> pd.DataFrame:
            of_row = [options.conditions[number] for number in rows["condition"]]
            return rows.assign(
                **{n: [getattr(c, attribute) for c in of_row] for n, attribute in changes.items()}
            )

        clips, people = with_words(inputs.sweep.clips), with_words(inputs.sweep.people)
        by = ["condition", *changes, "method"]
        views = with_words(pd.DataFrame(views_by(clips, clips["condition"])))
        keys = ["condition", *changes]
        views = views[[*keys, *views.columns.difference(keys, sort=False)]]
        last = [*keys, *VERDICTS]
        moved = [*clips.columns.difference(last, sort=False), *last]
        columns = ["person", *by, *ERRORS]
        usual = people.loc[people["condition"] == 0, ERRORS].to_numpy()
        # Every condition has the same clips in the same order.
        more = people.copy()
        more[ERRORS] -= np.tile(usual, (len(people) // len(usual), 1))
        return _of_kinds(cast(ChangedErrors, inputs.sweep).kinds) | {
            "table_changes": tidy(errors_by(more, by), by=["condition", "method"]),
            "table": tidy(errors_by(people, by), by=["condition", "method"]),
            "table_views": tidy(views, by=["condition"]),
            "table_clips": tidy(
                clips[moved], by=["condition", "person", "walk", "heading_deg", "overground"]
            ),
            "table_people": tidy(people[columns], by=["person", "condition", "method"]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Draw the increase of errors under each condition, the errors of the view, and the shares of clips by verdict.

        Added errors are relative to the usual condition.
        """
        options = cast(KeypointChanges, inputs.experiment.sweep)
        words = _words([options.conditions[n] for n in tables["table_views"]["condition"].tolist()])
        condition = partial(Chart, x="condition", abscissa=Axis(words=words))
        of_views = partial(Lines, table="table_views")
        usual = tables["table"].query("condition == 0").set_index("method")
        charts = [
            *(
                condition(
                    table="table_changes", y=column, where={"method": OURS}, styles={OURS: Style("", "map")},
                    label=f"{label}, added", limits=(-0.25 * most, most),
                    references=[
                        Reference(y=0.0, label=f"{usual[column][OURS]:.1f}"),
                        Reference(y=usual[column][AVERAGE] - usual[column][OURS], label="average walker"),
                    ],
                )
                for column, label, most in AXIS_ENDS
            ),
            condition(
                table="table_views", y="view_error_median_deg", styles={"median": Style("median of clips", "sky")},
                also=[of_views(y="view_error_90_deg", styles={"90": Style("90 % of clips", "purple")})],
                label="view", limits=(0.0, MAX_VIEW_DEG),
            ),
            condition(
                table="table_views", y="covered_95_percent",
                styles={"covered": Style("joints within bars of 95 %", "map")},
                also=[
                    of_views(y="walk_percent", styles={"walk": Style("clips judged a walk", "green")}),
                    of_views(y="not_a_walk_percent", styles={"refused": Style("clips refused", "orange")}),
                ],
                label="share", limits=(-4.0, 104.0), references=[Reference(y=95.0)],
            ),
        ]  # fmt: skip
        return Sheet(
            charts=charts,
            columns=4,
            panel_size=(1.85, 0.8 + ROW_HEIGHT * len(words)),
            caption=f"{options.takes} simulated clips, the same for every condition, of people left out of the model,"
            " from all sides, overground and on a treadmill. (a), (b) Mean difference from the same clips under the"
            " usual condition, whose own error is written at the line, with "
            f"{OVER_PEOPLE}. Values beyond the axes are in the tables.",
        )


def _of_kinds(films: pd.DataFrame) -> Tables:
    """Return the tables of amateur films, by kind and by film; empty if there are no such films."""
    if films.empty:
        return {}
    kinds = [FILM_KINDS[number] for number in films["number"]]
    films = films.assign(kind=[kind.kind for kind in kinds], level=[kind.level for kind in kinds])
    by, keys = ["number", "kind", "level", "walks"], ["take", "person", "heading_deg", "overground"]
    measured = [name for name in films if name not in (*by, *keys)]
    grouped = films.groupby(by)
    means = grouped[measured].mean().assign(clips=grouped.size()).reset_index()
    return {
        "table_kinds": tidy(means[[*by, "clips", *measured]], by=["number"]),
        "table_films": tidy(films[[*by, *keys, *measured]], by=["number", "take"]),
    }


def _words(conditions: Sequence[Condition]) -> dict[str, str]:
    """Return the axis labels of the conditions, by the index of the condition.

    Conditions of one kind follow a heading, which has no index.
    """
    kinds = Counter(condition.kind for condition in conditions)
    words: dict[str, str] = {}
    for number, condition in enumerate(conditions):
        if kinds[condition.kind] > 1:
            words.setdefault(condition.kind, condition.kind)
        words[str(number)] = condition.level if kinds[condition.kind] > 1 else condition.name
    return words
