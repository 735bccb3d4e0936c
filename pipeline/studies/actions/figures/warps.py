"""One dimension of the aSpace, raw, linear, by key-frames and synchronized: mozerov2006 figure 1, with our (d)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pipeline.core import synchronization
from pipeline.skeleton import WALKER15
from pipeline.studies.actions.figures.synchronizations import (
    SIDE_BY_SIDE_MM,
    STAGE_COLOURS,
    STAGE_NAMES,
    STAGES,
    durations_s,
    farthest,
    options_of,
    sequences,
    skeleton,
)
from pipeline.studies.figure_inputs import Made, Tables
from pipeline.studies.options import WarpReport
from pipeline.validation import InvalidInput

COLOURS = ("orange", "blue", "green", "purple", "amber", "sky", "grey")
"""Of the performances that are drawn beside the median sequence."""


def _report(made: Made) -> WarpReport:
    report = made.config.report
    if not isinstance(report, WarpReport):
        raise TypeError(f"warps are not made by {type(report).__name__}")
    dimensions = len(made.model.arrays["components"])
    if not 1 <= report.dimension <= dimensions:
        raise InvalidInput(
            "the aSpace has no such dimension",
            where="report.dimension",
            expected=f"1 to {dimensions}",
            received=str(report.dimension),
        )
    if report.performances < 1:
        raise InvalidInput(
            "no performances",
            where="report.performances",
            expected="1 or more",
            received=str(report.performances),
        )
    return report


def times_s(made: Made, stage: str) -> list[np.ndarray]:
    """When each sample of each performance is: its own time when raw, else that of the mean duration."""
    durations = durations_s(made)
    ends = durations if stage == "raw" else np.full(len(durations), durations.mean())
    return [np.linspace(0.0, end, len(x)) for end, x in zip(ends, sequences(made, stage), strict=True)]


def tables(made: Made) -> Tables:
    """``table``: every performance in one dimension; ``table_rates``: how far its rate is from a constant one."""
    dimension = _report(made).dimension
    blocks = []
    for stage in STAGES:
        for name, x, t in zip(made.walkers, sequences(made, stage), times_s(made, stage), strict=True):
            blocks.append(
                {
                    "performance": np.full(len(x), name),
                    "stage": np.full(len(x), stage),
                    "component": np.full(len(x), dimension),
                    "sample": np.arange(len(x)),
                    "time_s": t,
                    "value": x[:, dimension - 1],
                }
            )
    return {
        "table": (
            {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]},
            ["performance"],
        ),
        "table_rates": (_rates(made), ["performance"]),
    }


def _rates(made: Made) -> dict[str, Any]:
    """Of each performance: rates of its rate-to-rate function, relative to the median sequence and a constant rate.

    A sample is at the rate limit if time runs as fast there as the steps of the trellis allow, twice as fast as at a
    constant rate [mozerov2006 13]; where it stands still is the limit of any monotone function.
    """
    arrays, options = made.model.arrays, options_of(made)
    disparity = np.asarray(arrays["disparity"], dtype=int)
    rates = np.diff(synchronization.rate_to_rate(disparity), axis=1)
    limit = rates == 1 - min(options.steps)
    median = made.model.notes["median"]
    misfit = ((arrays["linear"] - arrays["linear"][median]) ** 2).sum(axis=(1, 2))
    return {
        "performance": np.array(made.walkers),
        "duration_s": durations_s(made),
        "disparity_max_abs": np.abs(disparity).max(axis=1),
        "rate_min": rates.min(axis=1),
        "rate_max": rates.max(axis=1),
        "rate_sd": rates.std(axis=1, ddof=1),
        "at_rate_limit_fraction": limit.mean(axis=1),
        "at_rate_limit_longest": np.array([_longest_run(row) for row in limit]),
        "distance": arrays["distances"][median],
        "distance_linear": misfit,
    }


def _longest_run(true: np.ndarray) -> int:
    """The most samples in a row at which something holds."""
    changes = np.flatnonzero(np.diff(np.concatenate([[0], true.astype(int), [0]])))
    return int((changes[1::2] - changes[::2]).max()) if len(changes) else 0


def drawn(made: Made) -> list[int]:
    """The performances to draw: the median sequence, then from the shortest to the longest of the others, evenly."""
    median = int(made.model.notes["median"])
    others = [int(m) for m in np.argsort(durations_s(made), kind="stable") if m != median]
    wanted = min(_report(made).performances - 1, len(others))
    return [median, *(others[i] for i in np.linspace(0, len(others) - 1, wanted).round().astype(int))]


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """Draw some performances, a panel to each way of synchronizing."""
    from pipeline import pictures

    report = _report(made)
    median, *others = (made.walkers[m] for m in drawn(made))
    styles = {
        name: pictures.Style(colour=COLOURS[i % len(COLOURS)], width=0.75) for i, name in enumerate(others)
    }
    styles[median] = pictures.Style("median sequence", "original", width=1.2)
    panels = [
        pictures.Panel(
            y="value",
            where={"stage": stage, "performance": list(styles)},
            title=STAGE_NAMES[stage],
            ylabel="" if i % 2 else f"Dimension {report.dimension} of the aSpace",
        )
        for i, stage in enumerate(STAGES)
    ]
    pictures.draw_lines(
        stem,
        panels,
        made_tables["table"][0],
        x="time_s",
        by="performance",
        styles=styles,
        xlabel="Time (s)",
        columns=2,
        legend="figure",
        share_y="row",
        caption=f"{made.caption} Drawn: {len(others) + 1} performances, from the shortest to the longest, and the"
        " median sequence; in (b) to (d) all have the mean duration.",
    )


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """The median sequence and the performance farthest from it in time, linear above, synchronized below."""
    from pipeline import recordings as recording

    dimension, columns = _report(made).dimension, made_tables["table"][0]
    people = {"pattern": int(made.model.notes["median"]), "performance": farthest(made)}
    colours = {"pattern": "original", "performance": ""}
    shown = {
        "linear": "before: linearly synchronized",
        "synchronized": "after: synchronized automatically",
    }
    samples = np.arange(made.model.arrays["linear"].shape[1])
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about
        + f"\nGrey: {made.walkers[people['pattern']]}, the median sequence, whose rate is the pattern. Coloured: "
        f"{made.walkers[people['performance']]}, the performance farthest from it in time, orange linearly "
        "synchronized, blue synchronized automatically. Below, both do the same at the same sample; above, not yet. "
        "Postures are those of the aSpace.\n",
        timeline="sample",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        for stage in shown:
            for who, m in people.items():
                colour = colours[who] or STAGE_COLOURS[stage]
                side = -1.0 if who == "pattern" else 1.0
                rec.skeleton(
                    f"world/{stage}/{who}",
                    skeleton(made, made.model.arrays[stage][m], m, aside_mm=side * SIDE_BY_SIDE_MM),
                    WALKER15.bones,
                    index={"sample": samples},
                    colour=colour,
                )
                rows = (columns["stage"] == stage) & (columns["performance"] == made.walkers[m])
                rec.curve(
                    f"curves/dimension_{dimension}/{stage}/{who}",
                    samples,
                    columns["value"][rows],
                    label="median sequence" if who == "pattern" else STAGE_NAMES[stage],
                    colour=colour,
                )
        rec.curve(
            "curves/disparity/performance",
            samples,
            made.model.arrays["disparity"][people["performance"]],
            label="disparity",
            colour=STAGE_COLOURS["synchronized"],
        )
        rec.blueprint(
            recording.Columns(
                recording.Rows(
                    *[
                        recording.Space3D(
                            name=words,
                            contents=(f"world/{stage}",),
                            eye_mm=(2500.0, 0.0, 1100.0),
                            target_mm=(0.0, 0.0, 800.0),
                        )
                        for stage, words in shown.items()
                    ]
                ),
                recording.Rows(
                    *(
                        recording.Plot(
                            name=f"dimension {dimension} of the aSpace, {words}",
                            origin=f"curves/dimension_{dimension}/{stage}",
                        )
                        for stage, words in shown.items()
                    ),
                    recording.Plot(name="disparity (samples)", origin="curves/disparity"),
                    recording.Notes(),
                ),
                shares=(1, 1),
            ),
            playing=True,
        )
