"""Postures sampled from the action model, and their distances from recorded postures: mozerov2006 figure 4.

"For each selected mean posture, only similar and meaningful postures are generated."  Similarity is measured by the
distance from the mean posture, meaning by the distance from the nearest recorded posture.  Both are compared with
recorded postures of the same frame and with postures that the action model rejects.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from pipeline.core import action_model, bootstrap, posture
from pipeline.core.action_model import ActionModel
from pipeline.processes import map_processes
from pipeline.seeding import derive_generator
from pipeline.studies.actions.model import ActionInputs
from pipeline.studies.replicated import DRAW
from pipeline.studies.study import Sweep
from pipeline.validation import Count, Distinct, require_range

KINDS = ("accepted", "outside", "training", "unsynchronized")
"""Kinds of postures: sampled within the bounds; sampled with every coordinate beyond the bounds; recorded and
synchronized, at the same frame; sampled within the bounds of a model without synchronization."""

TAIL_MM, TAIL_SHARE = 100.0, 95.0
"""Distance that is visible, a knee's breadth, and the percentile of the tail: "only" is a statement about the tail."""

TAILS = ("accepted", "together", "unsynchronized")
"""Sampled coordinate by coordinate, as the paper accepts postures; from the full covariance of the frame; and
coordinate by coordinate without synchronization."""

RESAMPLED_TAILS = (DRAW, "frame", "kind", "nearest_training_p95_mm", "beyond_100mm_percent")
"""Columns of the tails with resampled people."""

RESAMPLED_COLUMNS = (DRAW, "frame", "kind", "nearest_training_mm", "spread_mm")
"""Columns of the measurements with resampled people."""

BEYOND = (1.0, 3.0)
"""Range of the distance of rejected postures beyond the bounds, in standard deviations."""

_STREAM = 20064  # separates these draws from those of other stages with the same seed
_BLOCK = 64
RESAMPLED_POSTURES = 64
"""Number of postures sampled at each frame from each model of resampled people."""
TAIL_POSTURES = 200
"""Number of postures sampled for tails, so that ten lie beyond the 95th percentile."""


@dataclass(frozen=True)
class SampledPostures:
    """Mean postures, accepted postures for display, and distances of many postures from recorded ones.

    Attributes
    ----------
    rows : DataFrame
        A row for each frame and kind: share of postures that the model accepts, and of coordinates within the bounds;
        median and largest distance to the nearest recorded posture, and median distance from the mean posture.
    again : DataFrame
        The same medians by models of resampled people, over fewer postures; no rows for a single person.
    tails, tails_again : DataFrame
        A row for each frame and kind of `TAILS`: 95th percentile of the distance to the nearest recorded posture, and
        share beyond 100 mm; the same by models of resampled people.
    frames : (N,) int
        Frames of the mean performance, counted from 1.
    bodies, mean_performance : (N, 1 + S, 15, 3), (P, 15, 3)
        At each frame the mean posture and accepted ones; mm, of a body with the actors' mean limb lengths.
    bodies_together : (N, 1 + S, 15, 3)
        The same with postures from the full covariance of the frame.
    """

    rows: pd.DataFrame
    again: pd.DataFrame
    tails: pd.DataFrame
    tails_again: pd.DataFrame
    frames: np.ndarray
    bodies: np.ndarray
    mean_performance: np.ndarray
    bodies_together: np.ndarray


class PostureSampling(Sweep):
    """Sampling of accepted postures from the action model."""

    draws_random_numbers = True

    frames: Distinct[Count] = [10, 40]  # frames of the mean performance, counted from 1
    samples: Count = 8  # number of samples that are displayed
    measured: Count = 2000  # number of samples at each frame
    resamples: Count = 40  # number of models of resampled people, for intervals

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        require_range("sweep.samples", self.samples, at_most=self.measured)

    def measure(self, inputs: ActionInputs) -> SampledPostures:
        """Return joints of postures sampled at each frame, and statistics of their distances."""
        action, bound = inputs.model, inputs.model_options.bound
        performances, learnt = action.synchronized, action.model
        unsynchronized = action_model.learn(action.linear)
        body = inputs.dataset.mean_body()

        def joints(coordinates: np.ndarray) -> np.ndarray:
            return posture.joints(action.space.postures(coordinates), body, frame=inputs.dataset.frame)

        training, mean_performance = joints(performances), joints(learnt.mean)
        displayed_bodies, rows, between = [], [], {}
        displayed_together, tails = [], []
        for number in self.frames:
            at = number - 1
            generator = np.random.default_rng([inputs.seed, _STREAM, number])
            drawn = {
                "accepted": action_model.sample(learnt, self.measured, generator, at=at, bound=bound),
                "outside": beyond(learnt, self.measured, generator, at=at, bound=bound),
                "training": performances[:, at],
                "unsynchronized": action_model.sample(
                    unsynchronized, self.measured, generator, at=at, bound=bound
                ),
            }
            displayed = np.concatenate([learnt.mean[[at]], drawn["accepted"][: self.samples]])
            displayed_bodies.append(joints(displayed))
            for kind in KINDS:
                coordinates = drawn[kind]
                bodies = joints(coordinates)
                distances = nearest(bodies, training, inputs.workers)
                if kind == "training":
                    # Nearest posture of the other performances: a posture is at distance 0 from itself.
                    np.fill_diagonal(distances, np.inf)
                    between[number] = distances
                closest = distances.min(axis=1)
                about = unsynchronized if kind == "unsynchronized" else learnt
                from_mean = np.linalg.norm(bodies - joints(about.mean[at]), axis=-1).mean(axis=-1)
                cosines = action.space.postures(coordinates)[:, 1:].reshape(len(coordinates), -1, 3)
                norms = np.linalg.norm(cosines, axis=-1)
                within = np.abs(coordinates - learnt.mean[at]) <= bound * learnt.standard_deviation[at]
                row = {
                    "frame": number,
                    "kind": kind,
                    "draws": len(coordinates),
                    "acceptance": action_model.accepted(learnt, coordinates, at=at, bound=bound).mean(),
                    "nearest_training_mm": np.median(closest),
                    "nearest_training_max_mm": closest.max(),
                    "spread_mm": np.median(from_mean),
                    "limb_direction_norm_min": norms.min(),
                    "limb_direction_norm_max": norms.max(),
                    "bounds_held_fraction": within.mean(),
                }
                rows.append(row)
            joint_generator = derive_generator(inputs.seed, f"sweep:posture samples together:{number}")
            drawn["together"] = together(performances[:, at], self.measured, joint_generator, bound=bound)
            displayed_together.append(
                joints(np.concatenate([learnt.mean[[at]], drawn["together"][: self.samples]]))
            )
            for kind in TAILS:
                distances = nearest(joints(drawn[kind]), training, inputs.workers)
                tails.append({"frame": number, "kind": kind, **tail(distances.min(axis=1))})
        people, person = np.unique(inputs.dataset.person, return_inverse=True)
        weights = bootstrap.resampling_weights(len(people), derive_generator(0, "people"))
        weights = weights[(weights > 0).sum(axis=1) > 1][: self.resamples]  # a single person may not vary

        def again(draw: int) -> tuple[list[tuple[Any, ...]], list[tuple[Any, ...]]]:
            """Return the medians of both distances for one resample of people, and the tails."""
            resampled = np.repeat(np.arange(len(performances)), weights[draw, person])
            others = np.unique(resampled)
            models = action_model.learn(performances[resampled]), action_model.learn(action.linear[resampled])
            medians, resampled_tails = [], []
            for number in self.frames:
                at, generator = number - 1, np.random.default_rng([inputs.seed, _STREAM, number, draw])
                for kind in KINDS:
                    model = models[kind == "unsynchronized"]
                    if kind == "training":
                        bodies, distances = training[resampled, at], between[number][resampled][:, others]
                    else:
                        draws = beyond if kind == "outside" else action_model.sample
                        bodies = joints(draws(model, RESAMPLED_POSTURES, generator, at=at, bound=bound))
                        distances = nearest(bodies, training[others], 1)
                    from_mean = np.linalg.norm(bodies - joints(model.mean[at]), axis=-1).mean(axis=-1)
                    closest, spread = np.median(distances.min(axis=1)), np.median(from_mean)
                    medians.append((draw + 1, number, kind, closest, spread))
                joint_generator = derive_generator(
                    inputs.seed, f"sweep:posture samples together:{number}:{draw}"
                )
                of_tails = {
                    "accepted": action_model.sample(
                        models[0], TAIL_POSTURES, joint_generator, at=at, bound=bound
                    ),
                    "together": together(
                        performances[resampled, at], TAIL_POSTURES, joint_generator, bound=bound
                    ),
                    "unsynchronized": action_model.sample(
                        models[1], TAIL_POSTURES, joint_generator, at=at, bound=bound
                    ),
                }
                for kind in TAILS:
                    distances = nearest(joints(of_tails[kind]), training[others], 1)
                    resampled_tails.append((draw + 1, number, kind, *tail(distances.min(axis=1)).values()))
            return medians, resampled_tails

        drawn_again = map_processes(again, range(len(weights)), inputs.workers)
        return SampledPostures(
            rows=pd.DataFrame(rows),
            again=pd.DataFrame([row for rows, _ in drawn_again for row in rows], columns=RESAMPLED_COLUMNS),
            tails=pd.DataFrame(tails),
            tails_again=pd.DataFrame(
                [row for _, rows in drawn_again for row in rows], columns=RESAMPLED_TAILS
            ),
            frames=np.array(self.frames),
            bodies=np.stack(displayed_bodies),
            mean_performance=mean_performance,
            bodies_together=np.stack(displayed_together),
        )


def together(
    performances: np.ndarray, count: int, generator: np.random.Generator, *, bound: float
) -> np.ndarray:
    """Return postures (count, b) from the full covariance of one frame, within the bounds in every principal direction.

    Parameters
    ----------
    performances : (M, b)
        Synchronized, at one frame.
    count : int
    generator : numpy.random.Generator
    bound : float
        Standard deviations.
    """
    mean = performances.mean(axis=0)
    _, spread, axes = np.linalg.svd(performances - mean, full_matrices=False)
    deviation = spread[None] / np.sqrt(len(performances) - 1.0)
    principal = action_model.ActionModel(np.zeros_like(deviation), deviation, np.zeros(deviation.shape, bool))
    return mean + action_model.sample(principal, count, generator, at=0, bound=bound) @ axes


def tail(closest: np.ndarray) -> dict[str, float]:
    """Return the 95th percentile of distances (S,) in mm, and the share beyond 100 mm in per cent."""
    return {
        "nearest_training_p95_mm": float(np.percentile(closest, TAIL_SHARE)),
        "beyond_100mm_percent": 100.0 * float((closest > TAIL_MM).mean()),
    }


def beyond(
    model: ActionModel, count: int, generator: np.random.Generator, *, at: int, bound: float
) -> np.ndarray:
    """Return postures (count, b) that the action model rejects: every coordinate beyond the bounds, on either side.

    Parameters
    ----------
    model : ActionModel
    count : int
    generator : numpy.random.Generator
    at : int
        Sample of the action at which postures are drawn.
    bound : float
        Bound of the model, in standard deviations.
    """
    shape = (count, model.mean.shape[1])
    far = bound + generator.uniform(*BEYOND, shape)
    side = np.where(generator.random(shape) < 0.5, -1.0, 1.0)
    return model.mean[at] + side * far * model.standard_deviation[at]


def nearest(joints: np.ndarray, recorded: np.ndarray, workers: int) -> np.ndarray:
    """Return the mean joint distance (S, M) in mm from each posture to the nearest one of each performance.

    Parameters
    ----------
    joints : (S, J, 3)
        mm.
    recorded : (M, P, J, 3)
        mm.
    workers : int
    """
    recorded = np.ascontiguousarray(recorded)

    def block(first: int) -> np.ndarray:
        return posture.nearest_of_each(joints[first : first + _BLOCK], recorded)

    return np.concatenate(map_processes(block, range(0, len(joints), _BLOCK), workers))
