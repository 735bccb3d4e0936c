"""Mean postures and random postures that the action model accepts, as skeletons: mozerov2006 figure 4."""

from __future__ import annotations

import numpy as np

from pipeline.charts import Sheet
from pipeline.core import camera
from pipeline.palette import name_on_dark
from pipeline.scenes import Columns, Notes, Rows, SkeletonRow, Space3D
from pipeline.skeleton import WALKER15
from pipeline.studies.actions.dataset import Postures
from pipeline.studies.actions.model import Action, ActionSpaceModel
from pipeline.studies.actions.posture_samples import PostureSampling, SampledPostures
from pipeline.studies.experiment import Experiment
from pipeline.studies.figure_inputs import FigureInputs, tidy
from pipeline.studies.replicated import DRAW
from pipeline.studies.study import Figure, Picture, Recorder, Tables
from pipeline.validation import require_range

MEAN_COLOUR, SAMPLE_COLOUR = "orange", "blue"
"""Colours of the mean performance and of the accepted sampled postures in the recording."""

SIDE_DEG, VIEW_DEG = -90.0, -55.0
"""Azimuths of the views: from the left in the picture, and from the front left in the recording."""

EXAMPLES = 7
"""Largest number of sampled postures that the picture shows for each frame."""

SPACING_MM = 750.0
"""Distance, mm, between neighbouring skeletons in the recording."""

Inputs = FigureInputs[Postures, Action, SampledPostures]


class PostureSamples(Figure):
    """Figure of mean postures and of random postures that the action model accepts, as skeletons."""

    model = ActionSpaceModel
    sweep = PostureSampling

    def validate(self, experiment: Experiment) -> None:
        """Raise InvalidInput if the sweep names a frame that the mean performance does not have."""
        samples = getattr(experiment.model, "samples")  # noqa: B009 - the model above has it
        for frame in getattr(experiment.sweep, "frames"):  # noqa: B009
            require_range("sweep.frames", frame, at_least=1, at_most=samples)

    def tables(self, inputs: Inputs) -> Tables:
        """Return ``table`` with the joints of displayed postures, and further tables with distances of postures.

        ``table_samples_draws``: distances by models of resampled people.  ``table_tails``: the tail of the distances,
        with each coordinate drawn by itself and from the full covariance; ``table_tails_draws``: by resampled people.
        """
        sweep = inputs.sweep
        joints = {
            "frame": sweep.frames[:, None, None],
            "draw": np.arange(sweep.bodies.shape[1])[:, None] - 1,
            "joint": WALKER15.joints,
            **{f"{axis}_mm": sweep.bodies[..., k] for k, axis in enumerate("xyz")},
        }
        return {
            "table": tidy(joints, by=["frame", "draw"]),
            "table_samples": tidy(sweep.rows, by=["frame", "kind"]),
            "table_samples_draws": tidy(sweep.again, by=[DRAW, "frame", "kind"]),
            "table_tails": tidy(sweep.tails, by=["frame", "kind"]),
            "table_tails_draws": tidy(sweep.tails_again, by=[DRAW, "frame", "kind"]),
        }

    def charts(self, inputs: Inputs, tables: Tables) -> Sheet:
        """Return a sheet without charts, whose caption states how far sampled postures are from recorded postures."""
        accepted = tables["table_samples"].query("kind == 'accepted'")
        measured = "; ".join(
            f"frame {row.frame}: {row.spread_mm:.0f} mm from the mean posture, "
            f"{row.nearest_training_mm:.0f} mm from the nearest recorded one"
            for row in accepted.itertuples()
        )
        return Sheet(
            caption="Frames of the mean performance counted from one; body of mean limb lengths, from its left. Light:"
            f" the mean posture; over it, one by one, those of {inputs.sweep.bodies.shape[1] - 1} accepted postures"
            f" that are farthest from it and from each other. {_tails(tables)}"
            f" Median of {accepted['draws'].iloc[0]} samples, mean"
            f" over joints: {measured}.",
        )

    def draw(self, inputs: Inputs, tables: Tables, picture: Picture) -> None:
        """Draw for each frame the mean posture and the sampled postures that are farthest from it and from each other.

        Each coordinate drawn by itself; and together, from the full covariance of the frame.
        """
        order = np.argsort(inputs.sweep.frames)
        frames = inputs.sweep.frames[order]
        rows = [
            SkeletonRow(
                label=f"({'abcdefgh'[n % 8]}) frame {frame}{words}",
                centre=images[0],
                others=images[1:][farthest_apart(body, EXAMPLES)],
            )
            for n, (frame, words, body) in enumerate(
                (frame, words, bodies[order[m]])
                for m, frame in enumerate(frames)
                for words, bodies in (("", inputs.sweep.bodies), (", together", inputs.sweep.bodies_together))
            )
            for images in [camera.project(body, np.radians(SIDE_DEG))]
        ]
        picture.skeletons(rows, WALKER15.bones, legend=("mean posture", "accepted by the action model"))

    def record(self, inputs: Inputs, tables: Tables, begin: Recorder) -> None:
        """Record the mean performance over time, and the mean posture next to sampled postures for each frame."""
        performance = inputs.sweep.mean_performance
        angle = np.radians(VIEW_DEG)
        # The eye is in front of the row, where the image's horizontal runs to the left.
        to_right = -np.array([np.cos(angle), np.sin(angle), 0.0])
        ahead = np.array([-np.sin(angle), np.cos(angle), 0.0])
        with begin(
            f"\nSide by side, {name_on_dark('original')}: the mean posture; {SAMPLE_COLOUR}: postures drawn at "
            f"random within the learnt bounds. {MEAN_COLOUR.capitalize()}, `world/mean_performance`: plays on "
            "the timeline `frame`, counted from one.\n",
            timeline="frame",
            at=np.arange(1, len(performance) + 1),
        ) as rec:
            rec.skeleton(
                "world/mean_performance",
                performance,
                colour=MEAN_COLOUR,
            )
            rows = []
            for frame, bodies in sorted(
                zip(inputs.sweep.frames, inputs.sweep.bodies, strict=True), key=lambda row: row[0]
            ):
                middle = (len(bodies) - 1) / 2
                reach = 0.5 * len(bodies) * SPACING_MM + 500.0
                for draw, joints in enumerate(bodies):
                    name = f"accepted_{draw}" if draw else "mean"
                    rec.skeleton(
                        f"world/frame_{frame}/{name}",
                        (joints + (draw - middle) * SPACING_MM * to_right)[None],
                        at=[1],
                        colour=SAMPLE_COLOUR if draw else "original",
                    )
                rows.append(
                    Space3D(
                        name=f"frame {frame}: mean posture and accepted samples",
                        contents=(f"world/frame_{frame}",),
                        eye_mm=(reach * ahead[0], reach * ahead[1], 1100.0),
                        aspect=2.5,
                    )
                )
            mean = Space3D(name="mean performance", contents=("world/mean_performance",))
            layout = Columns(Rows(*rows), Rows(mean, Notes()), shares=(7, 3))
            rec.blueprint(layout, playing=True)


def _tails(tables: Tables) -> str:
    """Return the caption's sentence on the distances of sampled from recorded postures, for two sampling methods."""
    means = tables["table_tails"].groupby("kind")[["nearest_training_p95_mm", "beyond_100mm_percent"]].mean()
    by_itself, together = (
        f"95 % are within {row.nearest_training_p95_mm:.0f} mm of a recorded posture, {row.beyond_100mm_percent:.1f} %"
        " are beyond 100 mm"
        for row in (means.loc["accepted"], means.loc["together"])
    )
    return (
        f"Each dimension by itself: {by_itself}; together, from the full covariance of the frame: {together}."
    )


def farthest_apart(bodies: np.ndarray, count: int) -> list[int]:
    """Return the indices of the bodies that lie farthest from a reference body and from each other.

    The first of the bodies (n, J, 3) is the reference; the others are numbered from 0.  Each body is chosen as far as
    possible from the nearest of those chosen before.

    Examples
    --------
    >>> farthest_apart(np.array([0.0, 1.0, 5.0, 4.5, -3.0]).reshape(5, 1, 1), 2)
    [1, 3]
    """
    distances = np.linalg.norm(bodies[:, None] - bodies[None], axis=-1).mean(axis=-1)
    numbers = [0]
    while len(numbers) <= min(count, len(bodies) - 1):
        numbers.append(int(distances[numbers].min(axis=0).argmax()))
    return [number - 1 for number in numbers[1:]]
