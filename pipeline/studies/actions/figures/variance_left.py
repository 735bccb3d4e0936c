"""Variance between performances left after each way of synchronizing, over samples; after mozerov2006, ours.

Figure 3 shows bundles of curves that are wide or narrow; this is their width.  Raw performances are compared frame by
frame, as long as two of them last.  Where the true course is known, so is what a perfect synchronization would leave:
people differ in their postures too.  Less than that is left where time bends to hide differences of posture.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.skeleton import WALKER15
from pipeline.studies.actions.figures.synchronizations import (
    STAGE_COLOURS,
    STAGE_NAMES,
    STAGES,
    mean_variance_left,
    skeleton,
    variances_left,
)
from pipeline.studies.figure_inputs import Made, Tables, walker_words


def stages_of(made: Made) -> list[str]:
    """The ways of synchronizing, the true one where the truth is known."""
    return [*STAGES, *(["true_warp"] if "phase" in made.dataset.arrays else [])]


def tables(made: Made) -> Tables:
    """``table``: variance left at each sample; ``table_stages``: over all samples."""
    stages = stages_of(made)
    variances, counts = zip(*(variances_left(made, stage) for stage in stages), strict=True)
    means = np.array([mean_variance_left(made, stage) for stage in stages])
    return {
        "table": (
            {
                "stage": np.repeat(stages, [len(v) for v in variances]),
                "sample": np.concatenate([np.arange(len(v)) for v in variances]),
                "variance_left": np.concatenate(variances),
                "performances": np.concatenate(counts),
            },
            [],
        ),
        "table_stages": (
            {
                "stage": np.array(stages),
                "variance_left": means,
                "variance_left_to_linear": means / means[stages.index("linear")],
            },
            [],
        ),
    }


def _lines(made_tables: Tables) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Samples and variance left of each stage that has the common samples: raw has frames of its own."""
    columns: dict[str, Any] = made_tables["table"][0]
    found = {}
    for stage in dict.fromkeys(map(str, columns["stage"])):
        here = columns["stage"] == stage
        found[stage] = (columns["sample"][here], columns["variance_left"][here])
    return found


def picture(made: Made, made_tables: Tables, stem: Path) -> None:
    """Draw the variance left, raw against frames and the others against samples."""
    from pipeline import pictures

    told = made_tables["table_stages"][0]
    left = dict(zip(map(str, told["stage"]), told["variance_left_to_linear"], strict=True))
    styles = {
        stage: pictures.Style(
            f"{_SHORT[stage]} ({left[stage]:.2f})",
            STAGE_COLOURS[stage],
            line="dashed" if stage == "true_warp" else "solid",
        )
        for stage in left
    }
    panel = partial(pictures.Panel, y="variance_left", from_zero=True)
    others = [stage for stage in styles if stage != "raw"]
    pictures.draw_lines(
        stem,
        [
            panel(where={"stage": "raw"}, title="not synchronized", xlabel="Frame", ylabel="Variance left"),
            panel(where={"stage": others}, title="synchronized", xlabel="Sample"),
        ],
        made_tables["table"][0],
        x="sample",
        by="stage",
        styles=styles,
        columns=2,
        legend="figure",
        share_y="row",
        caption=f"{made.caption} In brackets: mean over samples, relative to linear synchronization.",
    )


_SHORT = {
    "raw": "not synchronized",
    "linear": "linear",
    "keyframe": "key-frames",
    "synchronized": "automatic",
    "true_warp": "true course",
}


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """Variance left over samples; the mean performance of each way of synchronizing at the sample at the cursor."""
    from pipeline import recordings as recording

    lines = _lines(made_tables)
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about
        + "\nSamples are frames for performances that are not synchronized. Drag the cursor: all performances at that "
        "sample, on the spot, linearly synchronized on the left and automatically on the right; the wider the bundle, "
        "the larger the variance.\n",
        timeline="sample",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        for stage, (samples, variance) in lines.items():
            rec.curve(
                f"curves/variance_left/{stage}",
                samples,
                variance,
                label=STAGE_NAMES[stage],
                colour=STAGE_COLOURS[stage],
            )
        median = int(made.model.notes["median"])
        for stage in _COMPARED:
            performances = made.model.arrays[stage]
            for m, name in enumerate(made.walkers):
                # With the limbs of one person, so that what differs is posture.
                rec.skeleton(
                    f"world/{stage}/{walker_words(name)}",
                    skeleton(made, performances[m], median),
                    WALKER15.bones,
                    index={"sample": np.arange(performances.shape[1])},
                    colour=STAGE_COLOURS[stage],
                    thickness_mm=3.0,
                )
        rec.blueprint(
            recording.Rows(
                recording.Columns(
                    *[
                        recording.Space3D(
                            name=STAGE_NAMES[stage],
                            contents=(f"world/{stage}",),
                            eye_mm=(2000.0, 700.0, 1200.0),
                            target_mm=(0.0, 100.0, 800.0),
                        )
                        for stage in _COMPARED
                    ]
                ),
                recording.Columns(
                    recording.Plot(name="variance between performances left", origin="curves/variance_left"),
                    recording.Notes(),
                    shares=(2, 1),
                ),
                shares=(3, 2),
            ),
            playing=True,
        )


_COMPARED = ("linear", "synchronized")
"""Shown as skeletons beside each other."""
