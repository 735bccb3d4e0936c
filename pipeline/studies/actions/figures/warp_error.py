"""Error of the time recovered by synchronization against smoothness, for two penalties of mozerov2006.

[mozerov2006 12] penalises changes of disparity, mu |k|; [mozerov2006 16], as printed, penalises its size, mu |d + k|.
Synthetic performances have a true course, so that the error of the recovered time is known, also for linear
normalisation and key-frames.  The median sequence defines the time and is left out of means and standard deviations.
"""

from __future__ import annotations

import numpy as np

from pipeline.charts import Axis, Chart, Reference, Sheet
from pipeline.core import synchronization
from pipeline.core.action_model import mean_squared_deviation
from pipeline.palette import Style
from pipeline.skeleton import POSTURE12
from pipeline.studies.actions.dataset import Postures, require_true_course
from pipeline.studies.actions.figures.alignments import options_of
from pipeline.studies.actions.model import Action, ActionSpaceModel
from pipeline.studies.actions.smoothness import Smoothness, TimeErrors
from pipeline.studies.experiment import Experiment
from pipeline.studies.figure_inputs import FigureInputs, sd, tidy
from pipeline.studies.replicated import interval_over_people, interval_words
from pipeline.studies.study import Figure, Tables, Traits

PENALTIES = {
    "change": Style("change of the disparity is penalised", "blue"),
    "as_printed": Style("its size is, as printed", "purple", line="dashed"),
}
REFERENCES = {"linear": "linear", "keyframe": "key-frames"}
ERRORS = {"error_moving": "while it moves", "error": "everywhere"}

PORTIONS = {
    "trunk": ("hip", "torso", "shoulder", "neck"),
    "arms": ("left_arm", "right_arm", "left_forearm", "right_forearm"),
    "left leg": ("left_thigh", "left_leg"),
    "right leg": ("right_thigh", "right_leg"),
}
"""Four portions of the body that are synchronized separately.

Earlier work, with which the paper contrasts its method, does so, but its portions are not published.  The height of the
pelvis belongs to the trunk.
"""

Inputs = FigureInputs[Postures, Action, TimeErrors]


class WarpError(Figure):
    """Figure of the error of the time that synchronization recovers, in frames."""

    model = ActionSpaceModel
    sweep = Smoothness
    traits = Traits(timeline="log10_smoothness_per_mille")

    def validate(self, experiment: Experiment) -> None:
        """Raise InvalidInput, with ``data`` as location, if the true phase of the performances is not known."""
        require_true_course(experiment.data.knows_true_course)

    def tables(self, inputs: Inputs) -> Tables:
        """Return errors by alignment and smoothness in ``table``, and by free or fixed start in ``table_starts``.

        ``table_performances`` has the errors of each performance at the model's smoothness and penalty, and the mean
        error of four separately synchronized portions of the body.
        """
        sweep, action = inputs.sweep, inputs.model
        off = {
            alignment: np.abs(action.matched_frames(alignment) - sweep.true_frames)
            for alignment in ("linear", "keyframe", "synchronized")
        }
        off["portions"] = np.abs(_frames_by_portions(inputs) - sweep.true_frames).mean(axis=0)
        moving = {alignment: errors[:, sweep.moving].mean(axis=1) for alignment, errors in off.items()}
        rows: list[dict[str, object]] = [
            {
                "stage": alignment,
                "penalty": "",
                "smoothness": np.nan,
                **_summary(inputs, off[alignment].mean(axis=1), moving[alignment]),
            }
            for alignment in REFERENCES
        ]
        starts = []
        for s, p, mu in np.ndindex(sweep.error_frames.shape[:3]):
            row = {
                "penalty": sweep.penalties[p],
                "smoothness": sweep.smoothness[mu],
                **_summary(inputs, sweep.error_frames[s, p, mu], sweep.error_moving_frames[s, p, mu]),
            }
            starts.append({"start": sweep.starts[s], **row})
            if sweep.starts[s] == options_of(inputs).start:
                rows.append({"stage": "synchronized", **row})
        performances = {
            "performance": inputs.samples,
            "person": inputs.dataset.person,
            "stage": np.array(list(moving))[:, None],
            "error_moving_frames": list(moving.values()),
            "is_median": np.arange(len(inputs.samples)) == action.median,
        }
        return {
            "table": tidy(rows, by=["stage", "penalty", "smoothness"]),
            "table_starts": tidy(starts, by=["start", "penalty", "smoothness"]),
            "table_performances": tidy(performances, by=["performance"]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Charts of the error of the recovered time against smoothness, over the movement and over all samples."""
        table = tables["table"]
        synchronized = table[table["stage"] == "synchronized"]
        top = 1.25 * synchronized[[f"{error}_frames" for error in ERRORS]].max(axis=None)
        charts = []
        for error, label in ERRORS.items():
            column = f"{error}_frames"
            # Both readings of the penalty are equal for mu = 0.
            levels = {"µ = 0": table.loc[table["smoothness"] == 0, column][:1]}
            levels |= {words: table.loc[table["stage"] == name, column] for name, words in REFERENCES.items()}
            charts.append(
                Chart(
                    x="smoothness",
                    abscissa=Axis(label="smoothness µ (mean squared deviations)", log=True),
                    timeline=self.traits.timeline,
                    y=column,
                    by="penalty",
                    styles=PENALTIES,
                    where={"stage": "synchronized"},
                    band=f"{error}_sd_frames",
                    title=label,
                    label="error",
                    limits=(0.0, top),
                    references=[
                        Reference(y=v, label=words) for words, level in levels.items() for v in level
                    ],
                )
            )
        people = np.unique(np.delete(inputs.dataset.person, inputs.model.median)).size
        return Sheet(
            charts=charts,
            columns=len(charts),
            share_y=True,
            caption="Penalty: µ|k|, of the change k of the disparity d, or µ|d + k| as printed."
            " Errors of the frame that is matched with a sample of the median sequence: (a) over the samples at"
            " which that moves, (b) over all. Light bands: ± standard deviation over performances. "
            + interval_words(people, bands="Bands within them"),
        )


def _frames_by_portions(inputs: Inputs) -> np.ndarray:
    """Frames (4, M, P) of each performance that match the pattern, with four body portions synchronized separately."""
    options, data, median = options_of(inputs), inputs.dataset, inputs.model.median
    samples = inputs.model.linear.shape[1]
    normalised = np.stack([synchronization.normalise(x, samples) for x in data.split(data.postures)])
    per_sample = ((np.diff(data.first) - 1) / (samples - 1))[:, None]
    frames = []
    for limbs in PORTIONS.values():
        cosines = [1 + 3 * POSTURE12.limbs.index(limb) + k for limb in limbs for k in range(3)]
        part = normalised[:, :, [0, *cosines] if "hip" in limbs else cosines]
        mu = options.smoothness * mean_squared_deviation(part)
        disparity = [
            synchronization.synchronize(part[median], x, smoothness=mu, **options.path_options).disparity
            for x in part
        ]
        frames.append(synchronization.rate_to_rate(np.stack(disparity)) * per_sample)
    return np.stack(frames)


def _summary(inputs: Inputs, everywhere: np.ndarray, moving: np.ndarray) -> dict[str, float]:
    """Mean, confidence interval over people, and standard deviation of the errors (M,) of performances."""
    summary = {}
    person = np.delete(inputs.dataset.person, inputs.model.median)
    for name, errors in (("error", everywhere), ("error_moving", moving)):
        others = np.delete(errors, inputs.model.median)
        low, high = interval_over_people(person, others)
        summary[f"{name}_frames"] = others.mean()
        summary[f"{name}_sd_frames"] = sd(others)
        summary |= {f"{name}_frames_low": float(low), f"{name}_frames_high": float(high)}
    return summary
