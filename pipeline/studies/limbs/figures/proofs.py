"""Share of programmes that are proved to be solved, and what it costs; after park2011, ours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pipeline.core.limb_chain import WALKER14
from pipeline.studies.figure_inputs import Made, Tables
from pipeline.studies.options import ProofSweep

_COLOURS = ("blue", "orange", "green", "purple", "sky", "amber")
_RECORDED = ("blue", "orange", "green", "purple", "yellow", "amber")

_SAME = 1e-6
"""Relative difference of two costs that are one."""


def tables(made: Made) -> Tables:
    """``table``: share proved; ``table_trials``: all; ``table_timing``: seconds of this machine."""
    sweep = made.sweep.arrays
    groups = np.stack([sweep[name] for name in ("frames", "components", "noise_px")], axis=1)
    rows: list[dict[str, Any]] = []
    for group in np.unique(groups, axis=0):
        here = (groups == group).all(axis=1)
        proved, seconds = sweep["proved"][here], sweep["seconds"][here]
        first, last = sweep["first_objective"][here], sweep["objective"][here]
        rows.append(
            {
                "frames": int(group[0]),
                "components": int(group[1]),
                "noise_px": float(group[2]),
                "trials": int(here.sum()),
                "proved_share": proved.mean(),
                "gap_median": np.median(sweep["gap"][here]),
                "first_best_share": (first <= last * (1 + _SAME)).mean(),
                "limb_error_median": np.median(sweep["limb_error"][here]),
                "seconds_median": np.median(seconds),
                "seconds_to_proof_median": np.median(seconds[proved]) if proved.any() else np.nan,
                "seconds_most": seconds.max(),
                "first_seconds_median": np.median(sweep["first_seconds"][here]),
            }
        )
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    keys = ["frames", "components", "noise_px"]
    of_clock = [name for name in columns if "seconds" in name]
    return {
        "table": ({name: v for name, v in columns.items() if name not in of_clock}, keys),
        "table_timing": ({name: columns[name] for name in [*keys, "trials", *of_clock]}, keys),
        "table_trials": (
            {
                **{name: sweep[name] for name in [*keys, "trial"]},
                "clip": np.array(made.walkers)[sweep["stretch"]],
                "limb": np.array(WALKER14.limbs)[sweep["limb"]],
                **{
                    name: sweep[name]
                    for name in (
                        "camera", "proved", "objective", "lower_bound", "gap", "first_objective", "limb_error",
                        "boxes", "steps",
                    )
                },
            },
            [*keys, "trial"],
        ),
    }  # fmt: skip


def _lines(made_tables: Tables) -> list[tuple[str, str, np.ndarray]]:
    """Name for people, name of an entity, and rows by increasing frames, of every K and noise."""
    columns = made_tables["table"][0]
    kinds = sorted(
        {(int(k), float(n)) for k, n in zip(columns["components"], columns["noise_px"], strict=True)}
    )
    found = []
    for components, noise in kinds:
        here = np.flatnonzero((columns["components"] == components) & (columns["noise_px"] == noise))
        found.append(
            (
                f"K = {components}, {noise:g} px",
                f"k{components}_noise_{noise:g}_px".replace(".", "_"),
                here[np.argsort(columns["frames"][here])],
            )
        )
    return found


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """Share proved and seconds against frames, for every K and noise."""
    from pipeline import pictures

    columns = {**made_tables["table"][0], **made_tables["table_timing"][0]}
    panels: list[list[pictures.Series]] = [[], []]
    known: list[int] = []
    for _, _, rows in _lines(made_tables):
        components, noisy = int(columns["components"][rows[0]]), columns["noise_px"][rows[0]] > 0
        label = "" if components in known else f"$K$ = {components}"
        known += [components] if label else []
        x, colour = columns["frames"][rows].astype(float), _COLOURS[(len(known) - 1) % len(_COLOURS)]
        style = "dashed" if noisy else "solid"
        panels[0].append(
            pictures.Series(
                x=x, y=100.0 * columns["proved_share"][rows], label=label, colour=colour, line=style
            )
        )
        panels[1].append(pictures.Series(x=x, y=columns["seconds_median"][rows], colour=colour, line=style))
    frames = np.unique(columns["frames"]).astype(float)
    first = [float(np.median(columns["first_seconds_median"][columns["frames"] == f])) for f in frames]
    panels[1].append(
        pictures.Series(x=frames, y=np.array(first), label="first signs", colour="black", line="dotted")
    )
    notes = made.sweep.notes
    options = made.config.sweep
    assert isinstance(options, ProofSweep)
    fewest, most = int(columns["trials"].min()), int(columns["trials"].max())
    pictures.draw_lines(
        stem,
        [
            pictures.Panel(
                series=panels[0],
                xlabel="Frames",
                ylabel="Programmes proved (%)",
                ylim=(0.0, 105.0),
            ),
            pictures.Panel(
                series=panels[1],
                xlabel="Frames",
                ylabel="Seconds, median",
                yscale="log",
                references=[("y", float(notes["time_limit_s"]), "nominal limit")],
            ),
        ],
        columns=2,
        caption=f"{made.caption.replace(made.model.notes['words'], 'components as named')} {most} limbs at every point"
        + (f", {fewest} where they are longest" if fewest < most else "")
        + f", before still, moving and shaky cameras in turn; limit {notes['time_limit_s']:g} nominal s each, "
        f"{notes['threads']} at a time. Solid: no noise; dashed: noise of "
        f"{', '.join(f'{n:g}' for n in options.noises_px if n)} px. (b) Until proof or the limit; dotted: until the "
        "first signs, which are the best in "
        f"{100 * float(np.average(columns['first_best_share'], weights=columns['trials'])):.0f} % of all programmes.",
    )


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """Share proved and seconds over frames."""
    from pipeline import recordings as recording

    columns = {**made_tables["table"][0], **made_tables["table_timing"][0]}
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about
        + f"\nProgrammes of limbs cut to so many frames; limit {made.sweep.notes['time_limit_s']:g} nominal s each. "
        "Seconds are those of the machine that made this recording, as log10.\n",
        timeline="frames",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        for number, (label, entity, rows) in enumerate(_lines(made_tables)):
            at, colour = columns["frames"][rows], _RECORDED[number % len(_RECORDED)]
            rec.curve(
                f"curves/proved_share/{entity}",
                at,
                columns["proved_share"][rows],
                label=label,
                colour=colour,
            )
            rec.curve(
                f"curves/log10_seconds/{entity}",
                at,
                np.log10(np.maximum(columns["seconds_median"][rows], 1e-6)),
                label=label,
                colour=colour,
            )
        rec.blueprint(
            recording.Columns(
                recording.Plot(
                    name="share proved over frames", origin="curves/proved_share", y_range=(0.0, 1.3)
                ),
                recording.Rows(
                    recording.Plot(
                        name="log10 of seconds over frames",
                        origin="curves/log10_seconds",
                        y_range=(-3.0, 1.0),
                    ),
                    recording.Notes(),
                    shares=(2, 1),
                ),
                shares=(1, 1),
            )
        )
