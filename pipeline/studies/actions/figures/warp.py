"""Performances in one dimension of the posture space (aSpace) in four alignments: mozerov2006 figure 1."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from pipeline.charts import Axis, Chart, Sheet
from pipeline.core import synchronization
from pipeline.palette import Style, name_on_dark
from pipeline.scenes import Columns, Notes, Rows, Space3D
from pipeline.studies.actions.figures.alignments import (
    STYLES,
    Inputs,
    options_of,
    sequence_rows,
    skeleton,
)
from pipeline.studies.actions.figures.pairs import pairs_table
from pipeline.studies.actions.model import ALIGNMENTS, ActionSpaceModel
from pipeline.studies.actions.without_mistiming import WithoutMistiming, without_mistiming
from pipeline.studies.figure_inputs import tidy
from pipeline.studies.study import Figure, Recorder, Tables
from pipeline.validation import Count, InvalidInput

PERFORMANCE_COLOURS = ("orange", "blue", "green", "purple", "amber", "sky", "grey")
"""Colours of the performances that are drawn in addition to the median sequence."""

SIDE_BY_SIDE_MM = 650.0
"""Distance, mm, of each displayed person from the middle of the scene; one stands to the left, one to the right."""

COMPARED = {"linear": "before: linearly synchronized", "synchronized": "after: synchronized automatically"}
"""Titles of the two alignments that the recording shows."""


class Warp(Figure):
    """Figure of the performances in one dimension of the posture space (aSpace), in four alignments."""

    model = ActionSpaceModel

    dimension: Count = 1  # dimension of the aSpace that is drawn
    performances: Count = 6  # number of performances that are drawn; the table has all

    def tables(self, inputs: Inputs) -> Tables:
        """Return tables of the performances in one dimension, of their rates, and of distances between performances.

        ``table`` has all performances, ``table_rates`` the deviations from a constant rate, and ``table_pairs`` the
        squared distance of each pair of performances.

        Times in ``table`` are those of the performance if raw, otherwise relative to the mean duration.
        """
        if self.dimension > (dimensions := inputs.model.space.dimensions):
            raise InvalidInput(
                f"must be at most {dimensions}, the number of dimensions of the aSpace",
                "figure.dimension",
                received=self.dimension,
                code="out_of_range",
                value=self.dimension,
            )
        rows = sequence_rows(inputs, [self.dimension])
        duration = dict(zip(inputs.samples, inputs.dataset.duration_s, strict=True))
        durations = rows["performance"].map(duration)
        rows["time_s"] = durations.where(rows["stage"] == "raw", inputs.dataset.duration_s.mean())
        last = rows.groupby(["stage", "performance"])["sample"].transform("max")
        rows["time_s"] *= rows["sample"] / last
        columns = ["performance", "stage", "component", "sample", "time_s", "value"]
        baseline = without_mistiming(inputs.dataset, inputs.model, options_of(inputs))
        return {
            "table": tidy(rows[columns], by=["performance"]),
            "table_rates": _rates(inputs, baseline),
            "table_pairs": pairs_table(inputs, baseline, slice(self.dimension - 1, self.dimension)),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Charts of the median sequence and of other performances over time, with one chart for each alignment."""
        median, *others = self._drawn(inputs)
        styles = {median: Style("median sequence", "original", width=1.2)} | {
            name: Style("", colour, width=0.75)
            for name, colour in zip(others, PERFORMANCE_COLOURS * len(others), strict=False)
        }
        dimension = partial(
            Chart,
            abscissa=Axis(label="time"),
            y="value",
            by="performance",
            label=f"dimension {self.dimension} of the aSpace",
        )
        action, names = inputs.model, inputs.samples
        farthest = names[action.farthest]
        disparity = action.disparity[action.farthest]
        pattern = {names[action.median]: Style("median sequence", "original")}
        of_pair = [
            dimension(
                x="sample", where={"stage": alignment}, title=words, name=f"dimension_{self.dimension}/{alignment}",
                styles=pattern | {farthest: Style(farthest, STYLES[alignment].colour)}, picture=False, page=False,
            )
            for alignment, words in COMPARED.items()
        ]  # fmt: skip
        charts = [
            *(
                dimension(x="time_s", where={"stage": name}, styles=styles, title=STYLES[name].label, page=False)
                for name in ALIGNMENTS
            ),
            *of_pair,
            Chart(
                table={"sample": np.arange(len(disparity)), "disparity": disparity}, x="sample", y="disparity",
                unit="samples", picture=False, page=False,
                styles={farthest: Style(farthest, STYLES["synchronized"].colour)},
            ),
            Chart(
                table="table_rates", x="performance", y="rate_sd", label="deviation of its rate",
                zero=True, abscissa=Axis(words={name: name for name in names}), picture=False,
            ),
        ]  # fmt: skip
        return Sheet(
            charts=charts,
            columns=2,
            share_y=True,
            caption=f"Drawn: {len(others) + 1} performances, from the shortest to the longest, and the median"
            f" sequence; in"
            " (b) to (d) all have the mean duration.",
        )

    def _drawn(self, inputs: Inputs) -> list[str]:
        """Names of the median sequence and of other performances, selected at equal steps in the order of durations."""
        names, median = inputs.samples, inputs.model.median
        others = [names[m] for m in np.argsort(inputs.dataset.duration_s, kind="stable") if m != median]
        count = min(self.performances - 1, len(others))
        return [
            names[median],
            *(others[i] for i in np.linspace(0, len(others) - 1, count).round().astype(int)),
        ]

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record the median sequence and the performance that differs most from it in timing.

        The upper view shows both after linear synchronization, the lower view after automatic synchronization.
        """
        action, names = inputs.model, inputs.samples
        people = {"pattern": action.median, "performance": action.farthest}
        with begin(
            f"\n{name_on_dark('original').capitalize()}: {names[action.median]}, the median sequence, whose rate is "
            f"the pattern. Coloured: {names[action.farthest]}, the performance farthest from it in time, "
            f"{name_on_dark(STYLES['linear'].colour)} linearly synchronized, "
            f"{name_on_dark(STYLES['synchronized'].colour)} synchronized automatically. Below, both do the same at the "
            "same sample; above, not yet. Postures are "
            "those of the aSpace.\n",
            timeline="sample",
            at=np.arange(action.linear.shape[1]),
        ) as rec:
            for alignment in COMPARED:
                for who, m in people.items():
                    pattern = who == "pattern"
                    style = Style("median sequence", "original") if pattern else STYLES[alignment]
                    aside_mm = -SIDE_BY_SIDE_MM if pattern else SIDE_BY_SIDE_MM
                    coordinates = action.sequences(alignment)[m]
                    rec.skeleton(
                        f"world/{alignment}/{who}",
                        skeleton(inputs, coordinates, m, aside_mm=aside_mm),
                        colour=style.colour,
                    )
            bodies = [
                Space3D(
                    name=words,
                    contents=(f"world/{alignment}",),
                    eye_mm=(2500.0, 0.0, 1100.0),
                    target_mm=(0.0, 0.0, 800.0),
                    aspect=1.7,
                )
                for alignment, words in COMPARED.items()
            ]
            rec.blueprint(Columns(Rows(*bodies), Rows(*rec.plots, Notes())), playing=True)


def _rates(inputs: Inputs, baseline: WithoutMistiming) -> pd.DataFrame:
    """Table of the speed of each performance relative to the median sequence; 1 is a constant speed.

    A sample is at the rate limit if time runs as fast as the steps of the trellis allow, twice as fast as at a constant
    rate [mozerov2006 13].  Standstill is not counted: it limits any monotone function.  Columns that end in
    ``_baseline`` are for performances without mistiming.
    """
    action = inputs.model
    disparity = np.asarray(action.disparity, int)
    rates = np.diff(synchronization.rate_to_rate(disparity), axis=1)
    limit = rates == 1 - min(options_of(inputs).steps)
    columns = {
        "performance": inputs.samples,
        "person": inputs.dataset.person,
        "duration_s": inputs.dataset.duration_s,
        "disparity_max_abs": np.abs(disparity).max(axis=1),
        "rate_min": rates.min(axis=1),
        "rate_max": rates.max(axis=1),
        "rate_sd": rates.std(axis=1, ddof=1),
        "at_rate_limit_fraction": limit.mean(axis=1),
        "at_rate_limit_longest": [_longest_run(row) for row in limit],
        "distance": action.distances[action.median],
        "distance_linear": ((action.linear - action.linear[action.median]) ** 2).sum(axis=(1, 2)),
        "rate_sd_baseline": np.diff(synchronization.rate_to_rate(baseline.disparity), axis=1).std(
            axis=1, ddof=1
        ),
        "distance_baseline": baseline.distances,
        "distance_linear_baseline": baseline.distances_linear,
    }
    return tidy(columns, by=["performance"])


def _longest_run(true: np.ndarray) -> int:
    """Length of the longest run of True in a mask (n,)."""
    changes = np.flatnonzero(np.diff(np.concatenate([[0], true.astype(int), [0]])))
    return (changes[1::2] - changes[::2]).max() if len(changes) else 0
