"""Tracking errors with the action model as prior, without a prior, and of the mean performance alone.

The mean error of the prior can fall as the noise grows, because single performances lose the phase, which never runs
back, and few particles decide which.  At full scale on synthetic people, with six draws of 500 particles for each of
12 performances, 7 % of the runs without noise erred by more than 80 mm, 3 % of those at 10 mm and 3 % of those at
30 mm (means 46, 41 and 42 mm; medians 38, 37 and 39 mm).  With 2000 particles no run did (means 36, 36 and 38 mm).
With the likelihood of 30 mm, 1 % of the runs without noise did.  The noise does not help: particles run out.
"""

from __future__ import annotations

from dataclasses import replace

import pandas as pd

from pipeline.charts import Axis, Chart, Lines, Reference, Sheet
from pipeline.palette import Style, name_on_dark
from pipeline.scenes import Columns, Image2D, Notes, Plot, Rows, Space3D
from pipeline.studies.actions.dataset import Postures
from pipeline.studies.actions.model import Action, ActionSpaceModel
from pipeline.studies.actions.tracking import HeldOutTracking, TrackingErrors
from pipeline.studies.figure_inputs import FigureInputs, sd, tidy
from pipeline.studies.replicated import aggregate, interval_words
from pipeline.studies.study import Figure, Recorder, Tables

METHODS = {
    "prior": Style("prior", "blue"),
    "no_prior": Style("no prior", "orange"),
    "no_prior_own_step": Style("no prior, steps as in the data", "purple"),
    "mean_linear_phase": Style("mean, constant rate", "grey", line="dashed", interval=False),
    "mean_best_phase": Style("mean, best phase", "green", line="dashed", interval=False),
}
RECORDED = METHODS | {"mean_linear_phase": replace(METHODS["mean_linear_phase"], colour="yellow")}
"""Styles of the methods in the recording; yellow replaces grey, which resembles the silver of the true motion."""

PANELS = {
    "particles": ("particles", "particles"),
    "noise": ("noise_mm", "noise of the image"),
    "occlusion": ("occluded", "share of joints hidden"),
}
"""Table column and axis label of each quantity that the tracking experiment varies."""

LOST_ABOVE = 2.0
"""Ratio of the tracking error to the error of the projected true postures above which the phase counts as lost.

The aSpace error is the error of the true postures after projection into the aSpace.
"""

CONDITION = ["leave_out", "varied", "particles", "noise_mm", "occluded", "method"]

Inputs = FigureInputs[Postures, Action, TrackingErrors]


class TrackingError(Figure):
    """Figure of the tracking error against the number of particles, noise and occlusion, for every method."""

    model = ActionSpaceModel
    sweep = HeldOutTracking

    def tables(self, inputs: Inputs) -> Tables:
        """Return mean errors by condition and method in ``table``, and each performance in ``table_performances``."""
        columns = [
            "performance",
            "person",
            "leave_out",
            "varied",
            "method",
            "particles",
            "noise_mm",
            "occluded",
        ]
        columns += ["error_mm", "aspace_error_mm", "lost_fraction"]
        each = tidy(inputs.sweep.rows[columns], by=["performance", *CONDITION])
        how = {
            "error_mm": ("error_mm", "mean"),
            "error_sd_mm": ("error_mm", sd),
            "error_median_mm": ("error_mm", "median"),
            "aspace_error_mm": ("aspace_error_mm", "mean"),
            "lost_fraction": ("lost_fraction", "mean"),
            "performances": ("error_mm", "size"),
        }
        table = aggregate(each, CONDITION, how, ["error_mm"], cluster="person", count="")
        return {"table": table, "table_performances": each}

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Charts of the tracking error against the number of particles, image noise and share of hidden joints."""
        table, sweep = tables["table"], inputs.sweep
        top = 1.05 * table[["error_mm", "error_mm_high"]].max(axis=None)
        charts = []
        for way in sweep.leave_out:
            for varied, (column, label) in PANELS.items():
                rows = table[(table["leave_out"] == way) & (table["varied"] == varied)]
                charts.append(
                    Chart(
                        x=column,
                        abscissa=Axis(
                            label=label, log=varied == "particles", ticks=sorted(set(rows[column]))
                        ),
                        y="error_mm",
                        by="method",
                        styles=METHODS,
                        where={"leave_out": str(way), "varied": varied},
                        also=[
                            Lines(
                                y="error_median_mm",
                                where={"leave_out": str(way), "varied": varied, "method": "prior"},
                                styles=Style("prior, median", "blue", line="dotted"),
                            )
                        ],
                        label=f"error, without the {way}",
                        limits=(0.0, top),
                        references=[Reference(y=rows["aspace_error_mm"].mean())],
                        page=way == sweep.leave_out[0],
                    )
                )
        usual = table["particles"][table["varied"] == "noise"].iloc[0]
        noise = table["noise_mm"][table["varied"] == "particles"].iloc[0]
        return Sheet(
            charts=charts,
            columns=len(PANELS),
            share_y=True,
            panel_size=(2.5, 2.2),
            caption="Mean distance of the joints, relative to the pelvis, over"
            f" {len(sweep.tracked)} performances, each by a model learnt without it (or without its person)."
            f" {interval_words(tables['table_performances']['person'].nunique())} Where not varied: {usual} particles,"
            f" noise {noise:g} mm, nothing hidden. Prior: the action model; no prior: a random walk with the same"
            " diffusion, or with steps as large as in the data; mean: the mean performance alone. Dotted line:"
            f" the true postures, projected into the aSpace. {self._lost(inputs, tables['table_performances'])}",
        )

    def _lost(self, inputs: Inputs, each: pd.DataFrame) -> str:
        """Return the caption's sentence on performances in which the filter with the prior loses the phase."""
        way = str(inputs.sweep.leave_out[0])
        prior = each[(each["method"] == "prior") & (each["leave_out"] == way)]
        lost = prior.assign(lost=prior["error_mm"] > LOST_ABOVE * prior["aspace_error_mm"])

        def counts(varied: str, column: str, unit: str) -> str:
            by = lost[lost["varied"] == varied].groupby(column)["lost"].sum()
            return ", ".join(f"{count} at {level:g}{unit}" for level, count in by.items())

        return (
            f"Performances that err by more than {LOST_ABOVE:g} times as much as that line have lost the phase, which"
            f" never runs back, and raise the mean: without the {way}, {counts('noise', 'noise_mm', ' mm of noise')};"
            f" {counts('particles', 'particles', ' particles')}."
        )

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record one performance: the true motion, the tracks of all methods, the image and the errors over time."""
        sweep, methods = inputs.sweep, list(map(str, inputs.sweep.methods))
        with begin(
            f"\nPerformance `{inputs.samples[sweep.shown[0]]}`, by the model learnt without "
            + ("it" if sweep.leave_out[0] == "performance" else "its person")
            + f": {sweep.shown_particles} particles, noise {sweep.shown_noise_mm:g} mm, "
            f"{100 * sweep.shown_occluded:g} % of the joints hidden in runs of frames. Of all tracked ones it is the "
            f"one whose error with the prior is the median. {name_on_dark('original').capitalize()}: recorded. "
            + ", ".join(f"{name_on_dark(RECORDED[m].colour)}: {RECORDED[m].label}" for m in methods)
            + ".\n",
            at=sweep.shown_time_s,
        ) as rec:
            rec.skeleton("world/original", sweep.shown_true)
            for method, joints, error in zip(methods, sweep.shown_joints, sweep.shown_error_mm, strict=True):
                # Moved to the recorded pelvis, as for the error.
                moved = joints - joints[:, [8]] + sweep.shown_true[:, [8]]
                style = RECORDED[method]
                rec.skeleton(f"world/tracked/{method}", moved, colour=style.colour)
                rec.curve(
                    f"curves/error_mm/{method}",
                    sweep.shown_time_s,
                    error,
                    label=style.label,
                    colour=style.colour,
                )
            rec.image_points("image/observed", sweep.shown_image)
            spaces = [
                Space3D(
                    name=METHODS[method].label,
                    contents=("world/original", f"world/tracked/{method}"),
                    eye_mm=(2000.0, 1450.0, 1100.0),
                )
                for method in ("prior", "no_prior_own_step", "mean_best_phase")
            ]
            below = Columns(
                Image2D(name="observed joints", next_to=spaces[0]),
                Plot(name="error (mm) against time (s)", origin="curves/error_mm"),
                Notes(),
                shares=(1, 2, 1),
            )
            layout = Rows(Columns(*spaces), below)
            rec.blueprint(layout, playing=True)
