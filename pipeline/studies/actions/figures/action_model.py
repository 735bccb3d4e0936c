"""The training set in the aSpace, raw, synchronized, by key-frames, and the learnt action model: mozerov2006 figure 3.

The columns of the paper: (a) not synchronized, (b) synchronized automatically, (c) by key-frames, (d) mean performance
and three standard deviations on either side of it.  `key_frame_agreement` says how (b) is compared with (c).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from pipeline.charts import Chart, Lines, Reference, Sheet
from pipeline.core import action_model, synchronization
from pipeline.core.posture import PARAMETERS
from pipeline.palette import Style
from pipeline.scenes import Columns, Matrix, Notes, Rows, Space3D
from pipeline.skeleton import POSTURE12, WALKER15
from pipeline.studies.actions.dataset import Postures
from pipeline.studies.actions.figures.alignments import (
    STYLES,
    options_of,
    sequence_rows,
    skeleton,
)
from pipeline.studies.actions.figures.key_frame_agreement import alignments_compared, sequence_differences
from pipeline.studies.actions.figures.new_people import patterns_of_others, space_tables, variance_along_modes
from pipeline.studies.actions.figures.pairs import pairs_table
from pipeline.studies.actions.model import ALIGNMENTS, Action, ActionSpaceModel
from pipeline.studies.actions.timing import Timing, Timings
from pipeline.studies.actions.without_mistiming import without_mistiming
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.presentation import entity_name, interval_words
from pipeline.studies.replicated import interval_over_people
from pipeline.studies.study import Figure, Recorder, Tables
from pipeline.validation import Count

COLUMNS = (
    ("raw", "(a) not synchronized", "frame"),
    ("synchronized", "(b) automatically", "sample"),
    ("keyframe", "(c) by key-frames", "sample"),
    ("model", "(d) learnt model", "sample"),
)

PUBLISHED = Reference(x=16.0, y="mozerov2006_variance_captured", label="published: 16, 95 %")

THIN = Style("a performance", "blue", width=1 / 3, opacity=0.7)
THIN_DASHED = Style("", "blue", line="dashed", width=1 / 3, opacity=0.7)

Inputs = FigureInputs[Postures, Action, Timings]


class ActionModelFigure(Figure):
    """The first dimensions of the aSpace: raw, synchronized, by key-frames, and what is learnt."""

    model = ActionSpaceModel
    sweep = Timing

    dimensions: Count = 4  # of the aSpace that are drawn

    def tables(self, inputs: Inputs) -> Tables:
        """Return ``table``: the drawn sequences; distances, spectrum, performances, alignments, model, posture.

        ``table_pairs``, ``table_space`` and ``table_space_draws`` are what the claims and their intervals rest on;
        ``table_timing`` depends on the machine.
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
            "table_performances": _performances(inputs),
            "table_stages": alignments_compared(action, options_of(inputs)),
            "table_pairs": pairs_table(inputs, baseline),
            "table_space": space,
            "table_space_draws": space_draws,
            "table_model": tidy(model, by=["sample", "component"]),
            "table_timing": pd.DataFrame(vars(inputs.sweep)),
            "table_posture": _posture(inputs),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """A row for each dimension, with the paper's four columns; the spectrum, on the page."""
        bound = options_of(inputs).bound
        charts = [
            chart
            for k in range(1, self._shown(inputs) + 1)
            for chart in _row(k, tables["table_model"], bound)
        ]
        spectrum = Chart(
            table="table_spectrum", x="component", x_label="number of dimensions", y="cumulative_fraction", times=100.0,
            label="cumulative variance", unit="%", picture=False, styles=Style("", "black"), references=[PUBLISHED],
        )  # fmt: skip
        means = Chart(
            table="table_model", x="sample", y="mean", by="component", label="mean performance",
            picture=False, name="mean_performance",
            styles={str(k): Style(f"dimension {k}") for k in range(1, self._shown(inputs) + 1)},
        )  # fmt: skip
        return Sheet(
            charts=[spectrum, means, *charts],
            columns=len(COLUMNS),
            share_y=True,
            letters=False,
            panel_size=(1.83, 1.56),
            caption=f"Of (d): mean performance, {bound:g} standard deviations on either side of it, and the"
            f" performances of"
            " (b). Grey, the bounds learnt without synchronization, by linear normalisation. "
            + interval_words(np.unique(inputs.dataset.person).size, bands="Orange band"),
        )

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Log the mean performance among the others as skeletons; the learnt model over samples; all distances."""
        action, bound, names = inputs.model, options_of(inputs).bound, inputs.samples
        median = action.median
        with begin(
            f"\nOrange: the mean performance, with the limbs of {names[median]}, the median sequence, which is "
            f"silver; beside them all performances, synchronized. Curves: mean "
            f"± 1 standard deviation, bounds at ±{bound:g}. Matrix: synchronization distances of all ordered pairs, "
            "the pattern n downwards, the performance m to the right.\n",
            timeline="sample",
            at=np.arange(len(action.model.mean)),
        ) as rec:
            rec.skeleton(
                "world/mean_performance",
                skeleton(inputs, action.model.mean, median),
                colour="orange",
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
                shown=("world/mean_performance", f"world/performances/{entity_name(names[median])}"),
            )
            everybody = Space3D(name="all performances, synchronized", contents=bodies.contents)
            below = Columns(Matrix(name="distances C(n, m)"), Notes())
            left = Rows(Columns(bodies, everybody), below, shares=(3, 2))
            rec.blueprint(Columns(left, Rows(*rec.plots)), playing=True)

    def _shown(self, inputs: Inputs) -> int:
        """How many dimensions are drawn and tabulated."""
        return min(self.dimensions, inputs.model.space.dimensions)


def _row(k: int, model: pd.DataFrame, bound: float) -> list[Chart]:
    """Return the charts of one dimension: three alignments and the learnt model."""
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
            Style(colour="grey", line="dashed", width=0.75),
        ),
    )
    learnt = [
        Lines(table=columns, y=y, styles={y: replace(style, label=label)})
        for name, label, style in bounds
        for end in ("lower", "upper")
        for y in [f"{end}_{name}"]
    ]
    of_performances: dict[str, Any] = {"x": "sample", "y": "value", "strands": "performance"}
    rows = {name: {"component": k, "stage": name} for name, *_ in COLUMNS[:-1]}
    last = Lines(**of_performances, where=rows["synchronized"], styles=THIN_DASHED)
    return [
        *(
            Chart(**of_performances, where=rows[name], styles=THIN, page=False, x_label=abscissa,
                  title=title if k == 1 else "", label=f"dimension {k}")
            for name, title, abscissa in COLUMNS[:-1]
        ),
        Chart(
            table=columns, x="sample", x_label=COLUMNS[-1][2], y="mean", label=f"dimension {k}", name=f"dimension_{k}",
            styles={"mean": Style("mean performance", "orange", width=1.1)}, also=[last, *learnt],
            title=COLUMNS[-1][1] if k == 1 else "",
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


def _performances(inputs: Inputs) -> pd.DataFrame:
    """Each performance by itself, and as one of a person who was not learnt from."""
    action, data = inputs.model, inputs.dataset
    postures = data.split(data.postures)
    chosen, arbitrary = patterns_of_others(action.distances, data.person)
    along, baseline = variance_along_modes(postures, data.person)
    unseen = np.full((len(data.person), 1), np.nan)
    deviation = action.linear - action.linear.mean(axis=(0, 1))
    of_height, of_cosines = _explained(postures, action)
    columns = {
        "performance": inputs.samples,
        "person": data.person,
        "frames": np.diff(action.first),
        "duration_s": data.duration_s,
        "global_distance": action.distances.sum(axis=1),
        "is_median": np.arange(len(inputs.samples)) == action.median,
        "disparity_max_abs": np.abs(action.disparity).max(axis=1),
        **{f"acceptance_{s}": action.accepted[s].mean(axis=1) for s in ALIGNMENTS[1:]},
        **{
            f"acceptance_person_{s}": action.accepted_person.get(s, unseen).mean(axis=1)
            for s in ALIGNMENTS[1:]
        },
        "distance_from_median_of_others": chosen,
        "distance_from_any_of_others": arbitrary,
        "variance_along_modes_of_others": along,
        "variance_along_numbers_of_others": baseline,
        **{
            f"squared_from_keyframe_{s}": sequence_differences(action, options_of(inputs), s)[0] ** 2
            for s in ("linear", "synchronized")
        },
        "squared_deviation": (deviation**2).mean(axis=(1, 2)),
        "height_explained": of_height,
        "cosines_explained": of_cosines,
        "cosine_change_max": [np.abs(np.diff(_cosines(p), axis=0)).max() for p in postures],
        "angle_change_max": [_angle_change_max(_cosines(p)) for p in postures],
    }
    return tidy(columns, by=["performance"])


def _explained(postures: list[np.ndarray], action: Action) -> list[np.ndarray]:
    """Shares (M,) of the variance of height and of cosines that the mean of the other performances explains."""
    normalised = np.stack([synchronization.normalise(p, action.linear.shape[1]) for p in postures])
    all_in_step = synchronization.warp(normalised, action.disparity)  # (M, P, 37)
    others = (all_in_step.sum(axis=0) - all_in_step) / (len(all_in_step) - 1)
    left = ((all_in_step - others) ** 2).mean(axis=1)
    whole = all_in_step.var(axis=1)
    return [
        1.0 - left[:, numbers].sum(axis=1) / whole[:, numbers].sum(axis=1)
        for numbers in (slice(1), slice(1, None))
    ]


def _cosines(postures: np.ndarray) -> np.ndarray:
    """Direction cosines (F, 12, 3) of postures (F, 37)."""
    return postures[:, 1:].reshape(len(postures), len(POSTURE12.limbs), 3)


def _angle_change_max(cosines: np.ndarray) -> float:
    """Largest change from frame to frame of a limb's azimuth, as a share of half a turn: from 0 to 2 as of cosines."""
    azimuth = np.arctan2(cosines[..., 1], cosines[..., 0])
    return np.abs(np.diff(azimuth, axis=0)).max() / np.pi


def _posture(inputs: Inputs) -> pd.DataFrame:
    """What a posture is made of, how smoothly its cosines run, and how unequal C(n, m) and C(m, n) are."""
    data, distances = inputs.dataset, inputs.model.distances
    cosines = _cosines(data.postures)
    within = np.delete(np.arange(1, len(cosines)), data.first[1:-1] - 1)  # not from one clip to the next
    apart = ~np.eye(len(distances), dtype=bool)
    row = {
        "limbs": len(POSTURE12.limbs),
        "joints": len(WALKER15.joints),
        "numbers": PARAMETERS,
        "numbers_per_limb": cosines.shape[2],
        "asymmetry": np.abs(distances - distances.T)[apart].mean() / distances[apart].mean(),
        "limb_norm_error_max": np.abs(np.linalg.norm(cosines, axis=-1) - 1.0).max(),
        "cosine_change_max": np.abs(cosines[within] - cosines[within - 1]).max(),
    }
    return pd.DataFrame([row])
