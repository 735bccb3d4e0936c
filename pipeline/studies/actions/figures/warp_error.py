"""Error of the recovered time against smoothness, for both readings of the penalty; after mozerov2006, ours.

[mozerov2006 12] punishes changes of disparity, mu |k|; [mozerov2006 16] as printed its size, mu |d + k|.  Synthetic
performances have a true course, so the time that each recovers can be judged, beside linear normalisation and
key-frames.  The median sequence, whose time is its own, is left out of means and spreads.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pipeline.studies.actions.figures.synchronizations import (
    STAGE_COLOURS,
    key_frame_frames,
    linear_frames,
    options_of,
    synchronized_frames,
)
from pipeline.studies.figure_inputs import Made, Tables, sd

PENALTY_NAMES = {"change": "µ|k|: its change", "as_printed": "µ|d + k|: its size, as printed"}
PENALTY_COLOURS = {"change": "blue", "as_printed": "purple"}
REFERENCES = {"linear": "linear", "keyframe": "key-frames"}


def tables(made: Made) -> Tables:
    """``table``: error of each way and smoothness; ``table_starts``: with free and fixed start; ``table_performances``.

    The last has the errors of each performance at the model's own smoothness and penalty.
    """
    sweep, options = made.sweep.arrays, options_of(made)
    own = int(np.flatnonzero(sweep["starts"] == options.start)[0])
    rows = [
        {"stage": stage, "penalty": "", "smoothness": np.nan, **_summary(made, *_errors(made, frames(made)))}
        for stage, frames in (("linear", linear_frames), ("keyframe", key_frame_frames))
    ]
    starts = []
    for s, p, mu in np.ndindex(sweep["error_frames"].shape[:3]):
        row = {
            "penalty": str(sweep["penalties"][p]),
            "smoothness": float(sweep["smoothness"][mu]),
            **_summary(made, sweep["error_frames"][s, p, mu], sweep["error_moving_frames"][s, p, mu]),
        }
        starts.append({"start": str(sweep["starts"][s]), **row})
        if s == own:
            rows.append({"stage": "synchronized", **row})
    blocks = [
        {
            "performance": np.array(made.walkers),
            "stage": np.full(len(made.walkers), stage),
            "error_moving_frames": _errors(made, frames(made))[1],
        }
        for stage, frames in _WAYS.items()
    ]
    return {
        "table": (_columns(rows), ["stage", "penalty", "smoothness"]),
        "table_starts": (_columns(starts), ["start", "penalty", "smoothness"]),
        "table_performances": (
            {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]},
            ["performance"],
        ),
    }


_WAYS = {"linear": linear_frames, "keyframe": key_frame_frames, "synchronized": synchronized_frames}
"""Frames that each way matches with the samples of the median sequence."""


def _errors(made: Made, matched: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean error (M,) in frames of matched frames (M, P), over all samples and where the pattern moves."""
    off = np.abs(matched - made.sweep.arrays["true_frames"])
    return off.mean(axis=1), off[:, made.sweep.arrays["moving"]].mean(axis=1)


def _summary(made: Made, everywhere: np.ndarray, moving: np.ndarray) -> dict[str, float]:
    """Mean and spread over performances (M,)."""
    told = {}
    for name, errors in (("error", everywhere), ("error_moving", moving)):
        others = np.delete(errors, int(made.model.notes["median"]))
        told[f"{name}_frames"] = float(others.mean())
        told[f"{name}_sd_frames"] = float(sd(others, 0))
    return told


def _columns(rows: list[dict[str, Any]]) -> dict[str, np.ndarray]:
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _lines(made_tables: Tables, penalty: str) -> dict[str, np.ndarray]:
    """Columns of one penalty, by increasing smoothness."""
    columns = made_tables["table"][0]
    here = np.flatnonzero((columns["stage"] == "synchronized") & (columns["penalty"] == penalty))
    here = here[np.argsort(columns["smoothness"][here])]
    return {name: values[here] for name, values in columns.items()}


def _reference(made_tables: Tables, stage: str, column: str) -> float:
    columns = made_tables["table"][0]
    return float(columns[column][columns["stage"] == stage][0])


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """Error where the pattern moves, and everywhere, against smoothness; without a penalty at the left."""
    from pipeline import pictures

    panels = []
    for column, label in (
        ("error_moving", "Error while it moves (frames)"),
        ("error", "Error everywhere (frames)"),
    ):
        series: list[pictures.Series] = []
        references: list[tuple[str, float, str]] = []
        for penalty in map(str, made.sweep.arrays["penalties"]):
            lines = _lines(made_tables, penalty)
            above = lines["smoothness"] > 0
            if above.any():
                series.append(
                    pictures.Series(
                        x=lines["smoothness"][above],
                        y=lines[f"{column}_frames"][above],
                        band=lines[f"{column}_sd_frames"][above],
                        label=PENALTY_NAMES[penalty],
                        colour=PENALTY_COLOURS[penalty],
                        line="solid" if penalty == "change" else "dashed",
                    )
                )
            if not above.all() and not references:
                references.append(("y", float(lines[f"{column}_frames"][~above][0]), "µ = 0"))
        references += [
            ("y", _reference(made_tables, stage, f"{column}_frames"), word)
            for stage, word in REFERENCES.items()
        ]
        panels.append(
            pictures.Panel(
                series=series,
                xlabel="Smoothness µ (mean squared deviations of a frame)",
                ylabel=label,
                xscale="log",
                ylim=(0.0, 1.25 * max(float(s.y.max()) for s in series)),
                references=references,
            )
        )
    pictures.draw_lines(
        stem,
        panels,
        caption=f"{made.caption} Errors of the frame that is matched with a sample of the median sequence: (a) over "
        "the samples at which that moves, (b) over all. Bands: ±1 standard deviation over performances.",
    )


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """Both errors over the values of smoothness, which are numbered: they lie too unevenly for an axis."""
    from pipeline import recordings as recording

    values = np.sort(made.sweep.arrays["smoothness"])
    numbers = np.arange(len(values))
    said = ["", "| number | smoothness µ |", "|---|---|", *(f"| {i} | {v:g} |" for i, v in enumerate(values))]
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about + "\n".join(said) + "\n",
        timeline="smoothness_number",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        for column in ("error_moving", "error"):
            for penalty in map(str, made.sweep.arrays["penalties"]):
                lines = _lines(made_tables, penalty)
                rec.curve(
                    f"curves/{column}_frames/{penalty}",
                    numbers,
                    lines[f"{column}_frames"],
                    sd=lines[f"{column}_sd_frames"],
                    label=PENALTY_NAMES[penalty],
                    colour=PENALTY_COLOURS[penalty],
                )
            for stage, word in REFERENCES.items():
                level = np.full(len(numbers), _reference(made_tables, stage, f"{column}_frames"))
                rec.curve(
                    f"curves/{column}_frames/{stage}",
                    numbers,
                    level,
                    label=word,
                    colour=STAGE_COLOURS[stage],
                )
        rec.blueprint(
            recording.Columns(
                recording.Rows(
                    recording.Plot(
                        name="error while the pattern moves (frames)",
                        origin="curves/error_moving_frames",
                    ),
                    recording.Plot(name="error over all samples (frames)", origin="curves/error_frames"),
                ),
                recording.Notes(),
                shares=(3, 1),
            )
        )
