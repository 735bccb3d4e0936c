"""The training set in the aSpace, raw, synchronized, by key-frames, and the learnt action model: mozerov2006 figure 3.

The columns of the paper: (a) not synchronized, (b) synchronized automatically, (c) by key-frames, (d) mean performance
and three standard deviations on either side of it.  `pipeline.figures.key_frame_agreement` says how (b) is compared
with (c).
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.core.posture import PARAMETERS
from pipeline.skeleton import POSTURE12, WALKER15
from pipeline.studies.actions.figures.action_model_recording import dimensions_shown, recordings
from pipeline.studies.actions.figures.key_frame_agreement import stages_compared
from pipeline.studies.actions.figures.synchronizations import (
    STAGES,
    durations_s,
    lengths,
    options_of,
    sequences,
)
from pipeline.studies.figure_inputs import Made, Tables
from pipeline.studies.options import TimingSweep
from pipeline.validation import InvalidInput

__all__ = ["picture", "recordings", "tables"]


def tables(made: Made) -> Tables:
    """``table``: the drawn sequences; further tables: distances, spectrum, performances, stages, model, timing."""
    if not isinstance(made.config.sweep, TimingSweep):
        raise InvalidInput(
            "synchronization has not been timed",
            where="sweep",
            expected="sweep=timing",
            received=type(made.config.sweep).__name__,
        )
    distances = made.model.arrays["distances"]
    n, m = np.indices(distances.shape)
    return {
        "table": (_sequences(made), ["performance"]),
        "distances": ({"n": n.ravel(), "m": m.ravel(), "distance": distances.ravel()}, ["n", "m"]),
        "table_spectrum": (_spectrum(made), ["component"]),
        "table_performances": (_performances(made), ["performance"]),
        "table_stages": (stages_compared(made), []),
        "table_model": (_model(made), ["sample", "component"]),
        "table_timing": (_timing(made), []),
        "table_posture": (_posture(made), []),
    }


def _sequences(made: Made) -> dict[str, Any]:
    shown = dimensions_shown(made)
    blocks = []
    for stage in STAGES:
        for name, x in zip(made.walkers, sequences(made, stage), strict=True):
            blocks.append(
                {
                    "performance": np.full(len(x) * shown, name),
                    "stage": np.full(len(x) * shown, stage),
                    "sample": np.tile(np.arange(len(x)), shown),
                    "component": np.repeat(np.arange(1, shown + 1), len(x)),
                    "value": x[:, :shown].T.ravel(),
                }
            )
    return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}


def _spectrum(made: Made) -> dict[str, Any]:
    eigenvalues = made.model.arrays["eigenvalues"]
    share = eigenvalues / made.model.notes["total_variance"]
    return {
        "component": np.arange(1, len(eigenvalues) + 1),
        "eigenvalue": eigenvalues,
        "variance_fraction": share,
        "cumulative_fraction": np.cumsum(share),
        "kept": np.arange(1, len(eigenvalues) + 1) <= made.model.notes["dimensions"],
    }


def _performances(made: Made) -> dict[str, Any]:
    arrays = made.model.arrays
    count = len(made.walkers)
    return {
        "performance": np.array(made.walkers),
        "person": made.dataset.arrays["person"],
        "frames": lengths(made),
        "duration_s": durations_s(made),
        "global_distance": arrays["distances"].sum(axis=1),
        "is_median": np.arange(count) == made.model.notes["median"],
        "disparity_max_abs": np.abs(arrays["disparity"]).max(axis=1),
        **{f"acceptance_{s}": arrays[f"accepted_{s}"].mean(axis=1) for s in STAGES[1:]},
    }


def _model(made: Made) -> dict[str, Any]:
    arrays = made.model.arrays
    sample, component = np.indices(arrays["mean"].shape)
    return {
        "sample": sample.ravel(),
        "component": component.ravel() + 1,
        **{name: arrays[name].ravel() for name in ("mean", "standard_deviation", "floored")},
    }


def _timing(made: Made) -> dict[str, Any]:
    arrays, notes = made.sweep.arrays, made.sweep.notes
    return {
        "what": arrays["what"],
        "performances": arrays["performances"],
        "samples": np.full(len(arrays["what"]), notes["samples"]),
        "dimensions": np.full(len(arrays["what"]), notes["dimensions"]),
        "seconds": arrays["seconds"],
    }


def _posture(made: Made) -> dict[str, Any]:
    """What a posture is made of, how smoothly its cosines run, and how unequal C(n, m) and C(m, n) are."""
    data, distances = made.dataset.arrays, made.model.arrays["distances"]
    cosines = data["postures"][:, 1:].reshape(-1, len(POSTURE12.limbs), 3)
    within = np.delete(np.arange(1, len(cosines)), data["first"][1:-1] - 1)  # not from one clip to the next
    apart = ~np.eye(len(distances), dtype=bool)
    return {
        "limbs": np.array([len(POSTURE12.limbs)]),
        "joints": np.array([len(WALKER15.joints)]),
        "numbers": np.array([PARAMETERS]),
        "numbers_per_limb": np.array([cosines.shape[2]]),
        "asymmetry": np.array([np.abs(distances - distances.T)[apart].mean() / distances[apart].mean()]),
        "limb_norm_error_max": np.abs(np.linalg.norm(cosines, axis=-1) - 1.0).max()[None],
        "cosine_change_max": np.abs(cosines[within] - cosines[within - 1]).max()[None],
    }


_COLUMNS = (
    ("raw", "(a) not synchronized", "Frame"),
    ("synchronized", "(b) automatically", "Sample"),
    ("keyframe", "(c) by key-frames", "Sample"),
    ("model", "(d) learnt model", "Sample"),
)


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """Draw a row to each dimension, the paper's four columns."""
    from pipeline import pictures

    table, model = made_tables["table"][0], made_tables["table_model"][0]
    shown, bound = dimensions_shown(made), options_of(made).bound
    panels = []
    for k in range(1, shown + 1):
        here = model["component"] == k
        samples, mean, reach = (model[name][here] for name in ("sample", "mean", "standard_deviation"))
        edge = partial(pictures.Series, x=samples, colour="black", width=0.75)
        of_model = [
            edge(y=mean - bound * reach, label=f"±{bound:g} standard deviations"),
            edge(y=mean + bound * reach),
            pictures.Series(x=samples, y=mean, label="mean performance", colour="orange", width=1.1),
        ]
        for stage, title, abscissa in _COLUMNS:
            learnt = stage == "model"
            thin = pictures.Style("" if learnt else "a performance", "blue", width=1 / 3, opacity=0.7)
            performances = pictures.series(
                table,
                x="sample",
                y="value",
                units="performance",
                styles=replace(thin, line="dashed" if learnt else "solid"),
                where={"component": k, "stage": "synchronized" if learnt else stage},
            )
            panels.append(
                pictures.Panel(
                    title=title if k == 1 else "",
                    xlabel=abscissa if k == shown else "",
                    ylabel=f"Dimension {k}" if stage == "raw" else "",
                    series=[*performances, *(of_model if learnt else [])],
                )
            )
    pictures.draw_lines(
        stem,
        panels,
        columns=len(_COLUMNS),
        legend="figure",
        share_y="row",
        letters=False,
        panel_size=(1.83, 1.56),
        caption=f"{made.caption} Of (d): mean performance, {bound:g} standard deviations on either side of it, and the"
        " performances of (b).",
    )
