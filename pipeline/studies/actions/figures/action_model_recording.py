"""The recording of the learnt action model: the mean performance among the others, its bounds, all distances."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.skeleton import WALKER15
from pipeline.studies.actions.figures.synchronizations import STAGE_COLOURS, options_of, skeleton
from pipeline.studies.figure_inputs import Made, Tables, walker_words
from pipeline.studies.options import ActionModelReport
from pipeline.validation import InvalidInput


def dimensions_shown(made: Made) -> int:
    """The first so many dimensions of the aSpace are drawn and tabulated."""
    report = made.config.report
    if not isinstance(report, ActionModelReport):
        raise TypeError(f"an action model is not drawn by {type(report).__name__}")
    if report.dimensions < 1:
        raise InvalidInput(
            "no dimensions", where="report.dimensions", expected="1 or more", received=str(report.dimensions)
        )
    return min(report.dimensions, len(made.model.arrays["components"]))


def recordings(made: Made, made_tables: Tables, folder: Path) -> None:
    """The mean performance as a skeleton among the performances; the learnt model over samples; all distances."""
    from pipeline import recordings as recording

    arrays, bound = made.model.arrays, options_of(made).bound
    model = made_tables["table_model"][0]
    median, shown = int(made.model.notes["median"]), dimensions_shown(made)
    samples = np.arange(len(arrays["mean"]))
    index = {"sample": samples}
    with recording.Recording(
        folder / "recording.rrd",
        name=made.config.figure,
        about=made.about
        + f"\nOrange: the mean performance, with the limbs of {made.walkers[median]}, the median sequence, which is "
        f"grey. Other performances can be switched on in the streams tree, `world/performances/…`. Curves: mean "
        f"± 1 standard deviation, bounds at ±{bound:g}. Matrix: synchronization distances of all ordered pairs, the "
        "pattern n downwards, the performance m to the right.\n",
        timeline="sample",
        edition=f"{made.config.data.name} {made.config.scale.name}",
    ) as rec:
        rec.skeleton(
            "world/mean_performance",
            skeleton(made, arrays["mean"], median),
            WALKER15.bones,
            index=index,
            colour="orange",
            thickness_mm=12.0,
        )
        for m in range(len(made.walkers)):
            rec.skeleton(
                f"world/performances/{walker_words(made.walkers[m])}",
                skeleton(made, arrays["synchronized"][m], m),
                WALKER15.bones,
                index=index,
                colour="original" if m == median else STAGE_COLOURS["synchronized"],
                thickness_mm=5.0,
            )
        for k in range(1, shown + 1):
            here = model["component"] == k
            mean, spread = model["mean"][here], model["standard_deviation"][here]
            where = f"curves/dimension_{k}"
            rec.curve(f"{where}/mean", samples, mean, sd=spread, label="mean performance", colour="orange")
            for side, sign in (("lower", -1.0), ("upper", 1.0)):
                edge = mean + sign * bound * spread
                rec.curve(
                    f"{where}/{side}_bound", samples, edge, label=f"{sign * bound:+g} sd", colour="grey"
                )
        rec.matrix("matrices/distances", arrays["distances"])
        rec.blueprint(
            recording.Columns(
                recording.Rows(
                    recording.Space3D(
                        name="mean performance and median sequence",
                        contents=("world/mean_performance", "world/performances"),
                        shown=(
                            "world/mean_performance",
                            f"world/performances/{walker_words(made.walkers[median])}",
                        ),
                    ),
                    recording.Columns(recording.Matrix(name="distances C(n, m)"), recording.Notes()),
                    shares=(3, 2),
                ),
                recording.Rows(
                    *[
                        recording.Plot(name=f"dimension {k}", origin=f"curves/dimension_{k}")
                        for k in range(1, shown + 1)
                    ]
                ),
                shares=(1, 1),
            ),
            playing=True,
        )
