"""Random postures from the action model, and their distances from recorded postures: mozerov2006 figure 4.

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
"""Kinds of recorded and randomly sampled postures that are compared.

``accepted`` postures are sampled within the bounds.  ``outside``: sampled with every coordinate beyond the bounds.
``training``: recorded and synchronized, at the same frame.  ``unsynchronized``: sampled within the bounds of a model
without synchronization.
"""

TAIL_MM, TAIL_SHARE = 100.0, 95.0
"""Distance, mm, between postures that is clearly visible, and the percentile of distances that tables report.

The paper says that "only" plausible postures are accepted, which is a statement about the tail.
"""

TAILS = ("accepted", "together", "unsynchronized")
"""Kinds of sampled postures whose largest distances from recorded postures are reported.

``accepted`` postures are sampled coordinate by coordinate, as the paper accepts postures.  ``together``: from the full
covariance of the frame.  ``unsynchronized``: coordinate by coordinate without synchronization.
"""

RESAMPLED_TAILS = (DRAW, "frame", "kind", "nearest_training_p95_mm", "beyond_100mm_percent")
"""Columns of the table with the largest distances of postures, for bootstrap samples of people."""

RESAMPLED_COLUMNS = (DRAW, "frame", "kind", "nearest_training_mm", "spread_mm")
"""Columns of the table with the median distances of postures, for bootstrap samples of people."""

BEYOND = (1.0, 3.0)
"""Range of the distance of rejected postures beyond the bounds, in standard deviations."""

_STREAM = 20064  # separates these draws from those of other stages with the same seed
_BLOCK = 64
RESAMPLED_POSTURES = 64
"""Number of postures that are sampled at each frame, for each bootstrap sample of people."""
TAIL_POSTURES = 200
"""Number of postures sampled at each frame to estimate the 95th percentile of distances, so that ten exceed it."""


@dataclass(frozen=True)
class SampledPostures:
    """Mean postures, accepted postures, and the distances of sampled postures from recorded postures.

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
    """Options of sampling random postures that the action model accepts."""

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
        """Return joints of postures sampled at each frame, and statistics of their distances from recorded postures."""
        action = _Action(inputs)
        frames = [self._at_frame(action, number) for number in self.frames]
        people, person = np.unique(inputs.dataset.person, return_inverse=True)
        weights = bootstrap.resampling_weights(len(people), derive_generator(0, "people"))
        weights = weights[(weights > 0).sum(axis=1) > 1][: self.resamples]  # a single person may not vary
        between = {frame.number: frame.between for frame in frames}

        def again(draw: int) -> tuple[list[tuple[Any, ...]], list[tuple[Any, ...]]]:
            return action.resampled(draw, np.repeat(np.arange(len(person)), weights[draw, person]), between)

        drawn_again = map_processes(again, range(len(weights)), inputs.workers)
        medians, tails = ([row for part in drawn_again for row in part[k]] for k in (0, 1))
        return SampledPostures(
            rows=pd.DataFrame([row for frame in frames for row in frame.rows]),
            again=pd.DataFrame(medians, columns=RESAMPLED_COLUMNS),
            tails=pd.DataFrame([row for frame in frames for row in frame.tails]),
            tails_again=pd.DataFrame(tails, columns=RESAMPLED_TAILS),
            frames=np.array(self.frames),
            bodies=np.stack([frame.bodies for frame in frames]),
            mean_performance=action.joints(action.learnt.mean),
            bodies_together=np.stack([frame.bodies_together for frame in frames]),
        )

    def _at_frame(self, action: _Action, number: int) -> _Frame:
        """Return sampled postures at one frame of the mean performance, and their distances; frames count from 1."""
        at, inputs = number - 1, action.inputs
        generator = np.random.default_rng([inputs.seed, _STREAM, number])
        drawn = {
            kind: action.draw(kind, (action.learnt, action.unsynchronized), self.measured, generator, at)
            for kind in KINDS
        }
        together_generator = derive_generator(inputs.seed, f"sweep:posture samples together:{number}")
        drawn["together"] = together(drawn["training"], self.measured, together_generator, bound=action.bound)
        bodies = {kind: action.joints(coordinates) for kind, coordinates in drawn.items()}
        distances = {kind: nearest(x, action.training, inputs.workers) for kind, x in bodies.items()}
        # Nearest posture of the other performances: a posture is at distance 0 from itself.
        np.fill_diagonal(distances["training"], np.inf)
        closest = {kind: x.min(axis=1) for kind, x in distances.items()}
        mean = action.joints(action.learnt.mean[[at]])
        return _Frame(
            number=number,
            rows=[action.row(number, kind, drawn[kind], bodies[kind], closest[kind]) for kind in KINDS],
            tails=[{"frame": number, "kind": kind, **tail(closest[kind])} for kind in TAILS],
            between=distances["training"],
            bodies=np.concatenate([mean, bodies["accepted"][: self.samples]]),
            bodies_together=np.concatenate([mean, bodies["together"][: self.samples]]),
        )


@dataclass(frozen=True)
class _Frame:
    """Measurements at one frame: table rows, distances (M, M) between recorded postures, and joints for display."""

    number: int
    rows: list[dict[str, Any]]
    tails: list[dict[str, Any]]
    between: np.ndarray
    bodies: np.ndarray
    bodies_together: np.ndarray


class _Action:
    """Action model from which postures are sampled, with the recorded postures as joints (M, P, 15, 3), mm."""

    def __init__(self, inputs: ActionInputs) -> None:
        self.inputs, self.bound = inputs, inputs.model_options.bound
        self.performances, self.linear = inputs.model.synchronized, inputs.model.linear
        self.learnt, self.unsynchronized = inputs.model.model, action_model.learn(self.linear)
        self.body = inputs.dataset.mean_body()
        self.training = self.joints(self.performances)

    def joints(self, coordinates: np.ndarray) -> np.ndarray:
        """Return the joints (…, 15, 3), mm, of a body of mean limb lengths from aSpace coordinates (…, b)."""
        postures = self.inputs.model.space.postures(coordinates)
        return posture.joints(postures, self.body, frame=self.inputs.dataset.frame)

    def draw(
        self,
        kind: str,
        models: tuple[ActionModel, ActionModel],
        count: int,
        generator: np.random.Generator,
        at: int,
    ) -> np.ndarray:
        """Return postures (count, b) of one kind, from models that are learnt with and without synchronization."""
        if kind == "training":
            return self.performances[:, at]
        draws = beyond if kind == "outside" else action_model.sample
        return draws(models[kind == "unsynchronized"], count, generator, at=at, bound=self.bound)

    def row(
        self, number: int, kind: str, coordinates: np.ndarray, bodies: np.ndarray, closest: np.ndarray
    ) -> dict[str, Any]:
        """Return the table row of postures (S, b) of one kind, from their joints and their distances (S,), mm."""
        at, learnt = number - 1, self.learnt
        cosines = self.inputs.model.space.postures(coordinates)[:, 1:].reshape(len(coordinates), -1, 3)
        norms = np.linalg.norm(cosines, axis=-1)
        within = np.abs(coordinates - learnt.mean[at]) <= self.bound * learnt.standard_deviation[at]
        model = self.unsynchronized if kind == "unsynchronized" else learnt
        return {
            "frame": number,
            "kind": kind,
            "draws": len(coordinates),
            "acceptance": action_model.accepted(learnt, coordinates, at=at, bound=self.bound).mean(),
            "nearest_training_mm": np.median(closest),
            "nearest_training_max_mm": closest.max(),
            "spread_mm": self._spread(bodies, model, at),
            "limb_direction_norm_min": norms.min(),
            "limb_direction_norm_max": norms.max(),
            "bounds_held_fraction": within.mean(),
        }

    def _spread(self, bodies: np.ndarray, model: ActionModel, at: int) -> float:
        """Return the median over postures (S, 15, 3) of the mean joint distance from the mean posture, mm."""
        return np.median(np.linalg.norm(bodies - self.joints(model.mean[at]), axis=-1).mean(axis=-1))

    def resampled(
        self, draw: int, resampled: np.ndarray, between: dict[int, np.ndarray]
    ) -> tuple[list[tuple[Any, ...]], list[tuple[Any, ...]]]:
        """Return median and largest distances of postures sampled from models of resampled performances.

        Parameters
        ----------
        draw : int
            Number of the resample, from 0.
        resampled : (N,) int
            Performances, with repetitions.
        between : dict of int to (M, M)
            Distances between recorded postures at each frame, mm.
        """
        others, seed = np.unique(resampled), self.inputs.seed
        models = (
            action_model.learn(self.performances[resampled]), action_model.learn(self.linear[resampled])
        )  # fmt: skip
        medians, tails = [], []
        for number, distances_between in between.items():
            at, generator = number - 1, np.random.default_rng([seed, _STREAM, number, draw])
            for kind in KINDS:
                if kind == "training":
                    bodies, distances = self.training[resampled, at], distances_between[resampled][:, others]
                else:
                    bodies = self.joints(self.draw(kind, models, RESAMPLED_POSTURES, generator, at))
                    distances = nearest(bodies, self.training[others], 1)
                spread = self._spread(bodies, models[kind == "unsynchronized"], at)
                medians.append((draw + 1, number, kind, np.median(distances.min(axis=1)), spread))
            generator = derive_generator(seed, f"sweep:posture samples together:{number}:{draw}")
            for kind in TAILS:
                drawn = (
                    together(self.performances[resampled, at], TAIL_POSTURES, generator, bound=self.bound)
                    if kind == "together"
                    else self.draw(kind, models, TAIL_POSTURES, generator, at)
                )
                distances = nearest(self.joints(drawn), self.training[others], 1)
                tails.append((draw + 1, number, kind, *tail(distances.min(axis=1)).values()))
        return medians, tails


def together(
    performances: np.ndarray, count: int, generator: np.random.Generator, *, bound: float
) -> np.ndarray:
    """Return postures (count, b) sampled from the full covariance of one frame.

    All principal coordinates are within the bounds.

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
    """Return the 95th percentile, mm, of the distances (S,) of postures, and the percentage above 100 mm."""
    return {
        "nearest_training_p95_mm": float(np.percentile(closest, TAIL_SHARE)),
        "beyond_100mm_percent": 100.0 * float((closest > TAIL_MM).mean()),
    }


def beyond(
    model: ActionModel, count: int, generator: np.random.Generator, *, at: int, bound: float
) -> np.ndarray:
    """Return postures (count, b) that the action model rejects, with every coordinate beyond the bounds.

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
    """Return the mean joint distance (S, M), mm, from each body to the nearest recorded posture of each performance.

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
