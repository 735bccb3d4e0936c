"""Training performances in three alignments and the learnt action model: mozerov2006 figure 3.

The columns of the paper: (a) not synchronized, (b) synchronized automatically, (c) by key-frames, (d) mean performance
and three standard deviations on either side of it.  `key_frame_agreement` says how (b) is compared with (c).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from pipeline.charts import Axis, Chart, Lines, Reference, Sheet
from pipeline.core import action_model
from pipeline.palette import Style, name_on_dark
from pipeline.scenes import Columns, Matrix, Notes, Rows, Space3D
from pipeline.studies.actions.dataset import Postures
from pipeline.studies.actions.figures.alignments import (
    STYLES,
    options_of,
    sequence_rows,
    skeleton,
)
from pipeline.studies.actions.figures.key_frame_agreement import alignments_compared
from pipeline.studies.actions.figures.new_people import space_tables
from pipeline.studies.actions.figures.pairs import pairs_table
from pipeline.studies.actions.figures.performances import paths_table, performances_table, posture_table
from pipeline.studies.actions.model import Action, ActionSpaceModel
from pipeline.studies.actions.timing import Timing, Timings
from pipeline.studies.actions.without_mistiming import without_mistiming
from pipeline.studies.figure_inputs import FigureInputs, entity_name, tidy
from pipeline.studies.replicated import interval_over_people, interval_words
from pipeline.studies.study import Figure, Recorder, Tables
from pipeline.validation import Count

ALIGNED = {
    "raw": ("(a) not synchronized", "frame"),
    "synchronized": ("(b) automatically", "sample"),
    "keyframe": ("(c) by key-frames", "sample"),
}
"""Titles and x-axis labels of the three columns of panels that show performances in different alignments."""

PUBLISHED = Reference(x=16.0, y="mozerov2006_variance_captured", label="published: 16, 95 %")

MEAN_COLOUR, LINEAR_COLOUR = "orange", "grey"
"""Colour of the mean performance, and colour of the bounds that are learnt without nonlinear synchronization."""

THIN = Style("a performance", "blue", width=1 / 3, opacity=0.7)
THIN_DASHED = Style("", "blue", line="dashed", width=1 / 3, opacity=0.7)

Inputs = FigureInputs[Postures, Action, Timings]


class ActionModelFigure(Figure):
    """Figure of the performances and the action model in the first dimensions of the posture space (aSpace)."""

    model = ActionSpaceModel
    sweep = Timing

    dimensions: Count = 4  # of the aSpace that are drawn

    def tables(self, inputs: Inputs) -> Tables:
        """Return the drawn curves in ``table``, and further tables of the model, its spectrum and the performances.

        ``table_paths`` has the cost of the paths in use, recomputed.  ``table_pairs``, ``table_space`` and
        ``table_space_draws`` are what the claims and their intervals rest on; ``table_timing`` depends on the machine.
        """
        action = inputs.model
        n, m = np.indices(action.distances.shape)
        distances = {"n": n.ravel(), "m": m.ravel(), "distance": action.distances.ravel()}
        sample, component = np.indices(action.model.mean.shape)
        without = action_model.learn(action.linear)
        low, high = interval_over_people(inputs.dataset.person, action.synchronized)
        model = {
            "sample": sample.ravel(),
            "component": component.ravel() + 1,
            "mean": action.model.mean.ravel(),
            "standard_deviation": action.model.standard_deviation.ravel(),
            "floored": action.model.floored.ravel(),
            "mean_linear": without.mean.ravel(),
            "standard_deviation_linear": without.standard_deviation.ravel(),
            "mean_low": low.ravel(),
            "mean_high": high.ravel(),
        }
        rows = sequence_rows(inputs, range(1, self._shown(inputs) + 1))
        baseline = without_mistiming(inputs.dataset, action, options_of(inputs))
        postures = inputs.dataset.split(inputs.dataset.postures)
        space, space_draws = space_tables(postures, inputs.dataset.person)
        columns = ["performance", "stage", "sample", "component", "value"]
        return {
            "table": tidy(rows[columns], by=["performance"]),
            "distances": tidy(distances, by=["n", "m"]),
            "table_spectrum": _spectrum(action),
            "table_performances": performances_table(inputs),
            "table_paths": paths_table(inputs),
            "table_stages": alignments_compared(action, options_of(inputs)),
            "table_pairs": pairs_table(inputs, baseline),
            "table_space": space,
            "table_space_draws": space_draws,
            "table_model": tidy(model, by=["sample", "component"]),
            "table_timing": inputs.sweep.table,
            "table_posture": posture_table(inputs),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Return charts of each dimension in the paper's four columns, and for the page a chart of the spectrum."""
        bound = options_of(inputs).bound
        charts = [
            chart
            for k in range(1, self._shown(inputs) + 1)
            for chart in _row(k, tables["table_model"], bound)
        ]
        spectrum = Chart(
            table="table_spectrum", x="component",
            abscissa=Axis(label="number of dimensions"),
            y="cumulative_fraction", times=100.0,
            label="cumulative variance", unit="%", picture=False, styles=Style("", "black"), references=[PUBLISHED],
        )  # fmt: skip
        means = Chart(
            table="table_model", x="sample", y="mean", by="component", label="mean performance",
            picture=False, name="mean_performance",
            styles={str(k): Style(f"dimension {k}") for k in range(1, self._shown(inputs) + 1)},
        )  # fmt: skip
        return Sheet(
            charts=[spectrum, means, *charts],
            columns=len(ALIGNED) + 1,
            share_y=True,
            letters=False,
            panel_size=(1.83, 1.56),
            caption=f"Of (d): mean performance, {bound:g} standard deviations on either side of it, and the"
            f" performances of"
            f" (b). {LINEAR_COLOUR.capitalize()}, the bounds learnt without synchronization, by linear normalisation. "
            + interval_words(np.unique(inputs.dataset.person).size, bands=f"{MEAN_COLOUR.capitalize()} band"),
        )

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record all performances as skeletons, the curves of the action model, and distances between performances."""
        action, bound, names = inputs.model, options_of(inputs).bound, inputs.samples
        median = action.median
        with begin(
            f"\n{MEAN_COLOUR.capitalize()}: the mean performance, with the limbs of {names[median]}, the median "
            f"sequence, which is {name_on_dark('original')}. Next to them: all performances, synchronized. Curves: "
            f"mean ± standard deviation, bounds at ±{bound:g}. Matrix: synchronization distances of all ordered pairs, "
            "the pattern n downwards, the performance m to the right.\n",
            timeline="sample",
            at=np.arange(len(action.model.mean)),
        ) as rec:
            rec.skeleton(
                "world/mean_performance",
                skeleton(inputs, action.model.mean, median),
                colour=MEAN_COLOUR,
                thickness_mm=12.0,
            )
            for m, name in enumerate(names):
                rec.skeleton(
                    f"world/performances/{entity_name(name)}",
                    skeleton(inputs, action.synchronized[m], m),
                    colour="original" if m == median else STYLES["synchronized"].colour,
                    thickness_mm=5.0,
                )
            rec.matrix("matrices/distances", action.distances)
            bodies = Space3D(
                name="mean performance and median sequence",
                contents=("world/mean_performance", "world/performances"),
                focus=("world/mean_performance", f"world/performances/{entity_name(names[median])}"),
            )
            everybody = Space3D(name="all performances, synchronized", contents=bodies.contents)
            below = Columns(Matrix(name="distances C(n, m)"), Notes())
            left = Rows(Columns(bodies, everybody), below, shares=(3, 2))
            rec.blueprint(Columns(left, Rows(*rec.plots)), playing=True)

    def _shown(self, inputs: Inputs) -> int:
        """Return the number of dimensions of the posture space (aSpace) that are drawn and tabulated."""
        return min(self.dimensions, inputs.model.space.dimensions)


def _row(k: int, model: pd.DataFrame, bound: float) -> list[Chart]:
    """Return the charts of one dimension: performances in three alignments, and the learnt model."""
    model = model[model["component"] == k]
    columns = {name: model[name].to_numpy() for name in ("sample", "mean", "mean_low", "mean_high")}
    for end, sign in (("lower", -bound), ("upper", bound)):
        columns[f"{end}_bound"] = columns["mean"] + sign * model["standard_deviation"].to_numpy()
        columns[f"{end}_linear"] = (
            model["mean_linear"] + sign * model["standard_deviation_linear"]
        ).to_numpy()
    bounds = (
        ("bound", f"±{bound:g} standard deviations", Style(colour="black", width=0.75)),
        (
            "linear",
            f"±{bound:g} standard deviations, unsynchronized",
            Style(colour=LINEAR_COLOUR, line="dashed", width=0.75),
        ),
    )
    learnt = [
        Lines(table=columns, y=y, styles={y: replace(style, label=label)})
        for name, label, style in bounds
        for end in ("lower", "upper")
        for y in [f"{end}_{name}"]
    ]
    of_performances: dict[str, Any] = {"x": "sample", "y": "value", "strands": "performance"}
    rows = {name: {"component": k, "stage": name} for name in ALIGNED}
    last = Lines(**of_performances, where=rows["synchronized"], styles=THIN_DASHED)
    return [
        *(
            Chart(**of_performances, where=rows[name], styles=THIN, page=False, abscissa=Axis(label=abscissa),
                  title=title if k == 1 else "", label=f"dimension {k}")
            for name, (title, abscissa) in ALIGNED.items()
        ),
        Chart(
            table=columns, x="sample",
            abscissa=Axis(label="sample"),
            y="mean", label=f"dimension {k}", name=f"dimension_{k}",
            styles={"mean": Style("mean performance", MEAN_COLOUR, width=1.1)}, also=[last, *learnt],
            title="(d) learnt model" if k == 1 else "",
            page=False,
        ),
    ]  # fmt: skip


def _spectrum(action: Action) -> pd.DataFrame:
    eigenvalues = action.space.eigenvalues
    share, component = eigenvalues / action.space.total_variance, np.arange(1, len(eigenvalues) + 1)
    columns = {
        "component": component,
        "eigenvalue": eigenvalues,
        "variance_fraction": share,
        "cumulative_fraction": np.cumsum(share),
        "kept": component <= action.space.dimensions,
    }
    return tidy(columns, by=["component"])
