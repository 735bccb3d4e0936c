"""The training set in the aSpace, raw, synchronized, by key-frames, and the learnt action model: mozerov2006 figure 3.

The columns of the paper: (a) not synchronized, (b) synchronized automatically, (c) by key-frames, (d) mean performance
and three standard deviations on either side of it.  `key_frame_agreement` says how (b) is compared with (c).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.core import action_model
from pipeline.core.posture import PARAMETERS
from pipeline.palette import Style
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
from pipeline.studies.study import Figure
from pipeline.validation import Count

COLUMNS = (
    ("raw", "(a) not synchronized", "Frame"),
    ("synchronized", "(b) automatically", "Sample"),
    ("keyframe", "(c) by key-frames", "Sample"),
    ("model", "(d) learnt model", "Sample"),
)

THIN = Style("a performance", "blue", width=1 / 3, opacity=0.7)
THIN_DASHED = Style("", "blue", line="dashed", width=1 / 3, opacity=0.7)

Inputs = FigureInputs[Postures, Action, Timings]


@dataclass(kw_only=True)
class ActionModelFigure(Figure):
    """The first dimensions of the aSpace: raw, synchronized, by key-frames, and what is learnt."""

    model = ActionSpaceModel
    sweep = Timing

    dimensions: Count = 4

    def tables(self, inputs: Inputs) -> dict[str, pd.DataFrame]:
        """Return ``table``: the drawn sequences; distances, spectrum, performances, alignments, model, posture.

        ``table_pairs``, ``table_space`` and ``table_space_draws`` are what the claims and their intervals rest on;
        ``table_timing`` depends on the machine.
        """
        action, timings = inputs.model, inputs.sweep
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
        timing = {
            "what": timings.what,
            "performances": timings.performances,
            "samples": timings.samples,
            "dimensions": timings.dimensions,
            "seconds": timings.seconds,
        }
        rows = sequence_rows(inputs, range(1, self._shown(inputs) + 1))
        null = without_mistiming(inputs.dataset, action, options_of(inputs))
        postures = inputs.dataset.split(inputs.dataset.postures)
        space, space_draws = space_tables(postures, inputs.dataset.person)
        columns = ["performance", "stage", "sample", "component", "value"]
        return {
            "table": tidy(rows[columns], by=["performance"]),
            "distances": tidy(distances, by=["n", "m"]),
            "table_spectrum": _spectrum(action),
            "table_performances": _performances(inputs),
            "table_stages": alignments_compared(action, options_of(inputs)),
            "table_pairs": pairs_table(inputs, null),
            "table_space": space,
            "table_space_draws": space_draws,
            "table_model": tidy(model, by=["sample", "component"]),
            "table_timing": pd.DataFrame(timing),
            "table_posture": _posture(inputs),
        }

    def draw(self, inputs: Inputs, tables: dict[str, pd.DataFrame], stem: Path) -> None:
        """Draw a row for each dimension, with the paper's four columns."""
        from pipeline import pictures

        shown, bound = self._shown(inputs), options_of(inputs).bound
        panels = []
        for k in range(1, shown + 1):
            model = tables["table_model"].query("component == @k")
            reach = bound * model["standard_deviation"]
            unsynchronized = bound * model["standard_deviation_linear"]
            edge = partial(pictures.Series, x=model["sample"], colour="black", width=0.75)
            dashed = partial(edge, colour="grey", line="dashed")
            learnt = [
                dashed(
                    y=model["mean_linear"] - unsynchronized,
                    label=f"±{bound:g} standard deviations, unsynchronized",
                ),
                dashed(y=model["mean_linear"] + unsynchronized),
                edge(y=model["mean"] - reach, label=f"±{bound:g} standard deviations"),
                edge(y=model["mean"] + reach),
                edge(
                    y=model["mean"],
                    band=(model["mean_low"], model["mean_high"]),
                    label="mean performance",
                    colour="orange",
                    width=1.1,
                ),
            ]
            for alignment, title, abscissa in COLUMNS:
                of_model = alignment == "model"
                performances = pictures.series(
                    tables["table"],
                    x="sample",
                    y="value",
                    units="performance",
                    styles=THIN_DASHED if of_model else THIN,
                    where={"component": k, "stage": "synchronized" if of_model else alignment},
                )
                panels.append(
                    pictures.Panel(
                        title=title if k == 1 else "",
                        xlabel=abscissa if k == shown else "",
                        ylabel=f"Dimension {k}" if alignment == "raw" else "",
                        series=[*performances, *(learnt if of_model else [])],
                    )
                )
        pictures.draw_lines(
            stem,
            panels,
            columns=len(COLUMNS),
            legend="figure",
            share_y="row",
            letters=False,
            panel_size=(1.83, 1.56),
            caption=f"{inputs.caption} Of (d): mean performance, {bound:g} standard deviations on either side of it, "
            "and the performances of (b). Grey, the bounds learnt without synchronization, by linear normalisation. "
            + interval_words(np.unique(inputs.dataset.person).size, bands="Orange band"),
        )

    def record(self, inputs: Inputs, tables: dict[str, pd.DataFrame], folder: Path) -> None:
        """Log the mean performance among the others as skeletons; the learnt model over samples; all distances."""
        from pipeline import recordings

        action, bound, names = inputs.model, options_of(inputs).bound, inputs.samples
        median, index = action.median, {"sample": np.arange(len(action.model.mean))}
        with inputs.recording(
            folder,
            f"\nOrange: the mean performance, with the limbs of {names[median]}, the median sequence, which is "
            f"silver. Other performances can be switched on in the streams tree, `world/performances/…`. Curves: mean "
            f"± 1 standard deviation, bounds at ±{bound:g}. Matrix: synchronization distances of all ordered pairs, "
            "the pattern n downwards, the performance m to the right.\n",
            timeline="sample",
        ) as rec:
            rec.skeleton(
                "world/mean_performance",
                skeleton(inputs, action.model.mean, median),
                WALKER15.bones,
                index=index,
                colour="orange",
                thickness_mm=12.0,
            )
            for m, name in enumerate(names):
                rec.skeleton(
                    f"world/performances/{entity_name(name)}",
                    skeleton(inputs, action.synchronized[m], m),
                    WALKER15.bones,
                    index=index,
                    colour="original" if m == median else STYLES["synchronized"].colour,
                    thickness_mm=5.0,
                )
            plots = []
            for k in range(1, self._shown(inputs) + 1):
                model = tables["table_model"].query("component == @k")
                samples, mean = model["sample"].to_numpy(), model["mean"].to_numpy()
                sd, where = model["standard_deviation"].to_numpy(), f"curves/dimension_{k}"
                rec.curve(
                    f"{where}/mean",
                    samples,
                    mean,
                    sd=sd,
                    interval=(model["mean_low"], model["mean_high"]),
                    label="mean performance",
                    colour="orange",
                )
                for side, reach in (("lower", -bound), ("upper", bound)):
                    entity = f"{where}/{side}_bound"
                    rec.curve(entity, samples, mean + reach * sd, label=f"{reach:+g} sd", colour="grey")
                plots.append(recordings.Plot(name=f"dimension {k}", origin=where))
            rec.matrix("matrices/distances", action.distances)
            bodies = recordings.Space3D(
                name="mean performance and median sequence",
                contents=("world/mean_performance", "world/performances"),
                shown=("world/mean_performance", f"world/performances/{entity_name(names[median])}"),
            )
            below = recordings.Columns(recordings.Matrix(name="distances C(n, m)"), recordings.Notes())
            left = recordings.Rows(bodies, below, shares=(3, 2))
            rec.blueprint(recordings.Columns(left, recordings.Rows(*plots)), playing=True)

    def _shown(self, inputs: Inputs) -> int:
        """How many dimensions are drawn and tabulated."""
        return min(self.dimensions, inputs.model.space.dimensions)


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
    along, null = variance_along_modes(postures, data.person)
    unseen = np.full((len(data.person), 1), np.nan)
    deviation = action.linear - action.linear.mean(axis=(0, 1))
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
        "variance_along_numbers_of_others": null,
        **{
            f"squared_from_keyframe_{s}": sequence_differences(action, options_of(inputs), s)[0] ** 2
            for s in ("linear", "synchronized")
        },
        "squared_deviation": (deviation**2).mean(axis=(1, 2)),
        "cosine_change_max": [np.abs(np.diff(_cosines(p), axis=0)).max() for p in postures],
        "angle_change_max": [_angle_change_max(_cosines(p)) for p in postures],
    }
    return tidy(columns, by=["performance"])


def _cosines(postures: np.ndarray) -> np.ndarray:
    """Direction cosines (F, 12, 3) of postures (F, 37)."""
    return postures[:, 1:].reshape(len(postures), len(POSTURE12.limbs), 3)


def _angle_change_max(cosines: np.ndarray) -> float:
    """Largest change from frame to frame of a limb's azimuth, as a share of half a turn: from 0 to 2 as of cosines."""
    azimuth = np.arctan2(cosines[..., 1], cosines[..., 0])
    return float(np.abs(np.diff(azimuth, axis=0)).max() / np.pi)


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
