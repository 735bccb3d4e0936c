"""Action model with posture space (aSpace), synchronized performances and bounds: mozerov2006 sections 2 to 4."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Annotated, Any

import numpy as np

from pipeline.core import action_model, posture, synchronization
from pipeline.core.action_model import ActionModel, LearntAction
from pipeline.core.aspace import ASpace
from pipeline.studies.actions.dataset import PostureDataset, Postures
from pipeline.studies.study import Model, SweepInputs
from pipeline.validation import Count, InvalidInput, Positive, Several, bounded, require_range

ALIGNMENTS = ("raw", "linear", "keyframe", "synchronized")
"""Methods to align performances in time.

``raw``           as recorded, with different lengths
``linear``        one constant rate for each performance [mozerov2006 7]
``keyframe``      the same number of samples between key-frames, the paper's comparison
``synchronized``  to the rate of the median sequence, the paper's proposal [mozerov2006 18]
"""

MAX_RELATIVE_DISTANCE = 1.5
"""Largest usual ratio of a performance's synchronization distance to the median distance of all performances.

A performance above it may be of another action, if it is also outside the bounds learnt without it at all samples.
"""

MAX_VARIANCE_LEFT = 0.8
"""Largest share of the variance between performances that synchronization of the same action leaves.

Bends and squats leave up to 0.44, unrelated motions 0.95 or more.
"""


class Penalty(StrEnum):
    """Quantity whose absolute value is penalised with the smoothness weight mu [mozerov2006 12, 16]."""

    change = "change"
    """The change k of the disparity from one sample to the next has the penalty mu |k|."""
    as_printed = "as_printed"
    """The new disparity d + k, after a change k, has the penalty mu |d + k|."""


class Start(StrEnum):
    """Disparity at the first sample: ``fixed`` at zero, or ``free``."""

    fixed = "fixed"
    free = "free"


@dataclass(frozen=True)
class Acceptance:
    """Acceptance of recorded postures by action models that are learnt without the tested performance or person.

    Attributes
    ----------
    performances : dict of (M, P) bool
        By alignment: acceptance of each posture by the model learnt without the performance.
    people : dict of (M, P) bool
        The same for models without all performances of the person; empty if there are too few people.
    """

    performances: dict[str, np.ndarray]
    people: dict[str, np.ndarray]


@dataclass(frozen=True)
class Action:
    """Action model with the performances from which it was learnt.

    Attributes
    ----------
    space : ASpace
    model : ActionModel
        Action model of the synchronized performances.
    raw : (sum of F, b)
        Performances in the aSpace, end to end.
    first : (M + 1,) int
        First row of each performance.
    linear, keyframe, synchronized : (M, P, b)
        See `ALIGNMENTS`.
    keyframe_warp : (M, P)
        Fractional frame of each performance at each sample, by key-frames.
    distances : (M, M)
        C(n, m) of all ordered pairs, squared aSpace units.
    disparity : (M, P) int
        Disparity that brings each performance to the rate of the median sequence.
    median : int
        Number of the median sequence.
    smoothness : float
        mu, squared aSpace units.
    accepted : Acceptance
    words : str
    remarks : list of str
        Remarks on performances that may be of another action.
    """

    space: ASpace
    model: ActionModel
    raw: np.ndarray
    first: np.ndarray
    linear: np.ndarray
    keyframe: np.ndarray
    synchronized: np.ndarray
    keyframe_warp: np.ndarray
    distances: np.ndarray
    disparity: np.ndarray
    median: int
    smoothness: float
    accepted: Acceptance
    words: str
    remarks: list[str]

    def sequences(self, alignment: str) -> list[np.ndarray]:
        """Return every performance in the aSpace: (F, b) if the alignment is ``raw``, otherwise resampled to (P, b)."""
        if alignment == "raw":
            return [self.raw[a:b] for a, b in pairwise(self.first)]
        return list(getattr(self, alignment))

    def matched_frames(self, alignment: str) -> np.ndarray:
        """Return the fractional frame (M, P) of each performance that matches each sample of the median sequence."""
        last, samples = (np.diff(self.first) - 1)[:, None], self.linear.shape[1]
        linear = last * np.arange(samples) / (samples - 1)
        if alignment == "keyframe":
            warp = self.keyframe_warp
            return np.stack([np.interp(linear[self.median], warp[self.median], frames) for frames in warp])
        if alignment == "synchronized":
            return last * synchronization.rate_to_rate(self.disparity) / (samples - 1)
        return linear

    @property
    def farthest(self) -> int:
        """Index of the performance with the largest disparity from the median sequence; the first one on ties."""
        return int(np.abs(self.disparity).max(axis=1).argmax())


ActionInputs = SweepInputs[None, Postures, Action]


class ActionSpaceModel(Model):
    """Options of the posture space (aSpace), the synchronization of performances and the action model."""

    dataset = PostureDataset
    published = True

    variance: Annotated[float, bounded(above=0, at_most=1)] = 0.95  # share that the aSpace covers
    dimensions: Annotated[int, bounded(at_least=0, at_most=posture.PARAMETERS)] = 0  # 0: by variance
    samples: Several = 100  # P, postures of a performance after linear normalisation
    max_disparity: Count = 49  # D, in samples
    smoothness: Positive = 0.02  # mu [mozerov2006 12], in mean squared deviations of a frame
    penalty: Penalty = Penalty.change
    start: Start = Start.fixed
    steps: list[int] = [-1, 0, 1]  # changes of disparity [mozerov2006 13]
    key_frames: Count = 5  # number of key frames
    bound: Positive = 3.0  # standard deviations within which a posture is accepted

    def validate(self) -> None:
        """Validate the options.  Raises InvalidInput if one is out of range."""
        super().validate()
        require_range("model.max_disparity", self.max_disparity, below=self.samples)
        if 0 not in self.steps or max(self.steps) > 1:
            raise InvalidInput(
                "must contain 0 and no value above 1",
                "model.steps",
                received=self.steps,
                code="invalid_steps",
            )

    @property
    def path_options(self) -> dict[str, Any]:
        """Keyword arguments of `synchronization.synchronize` that define the admissible paths."""
        return {
            "max_disparity": self.max_disparity,
            "penalty": self.penalty.value,
            "start": self.start.value,
            "steps": list(self.steps),
        }

    def teach(self, postures: Sequence[np.ndarray]) -> LearntAction:
        """Return the action model that is learnt from the postures (F, 37) of some of the performances."""
        return action_model.learn_action(
            postures,
            samples=self.samples,
            variance=self.variance,
            dimensions=self.dimensions or None,
            smoothness=self.smoothness,
            **self.path_options,
        )

    def learn(self, dataset: Postures, *, workers: int) -> Action:
        """Return the action model, and the acceptance of each performance by models learnt without it or its person."""
        learnt = self.teach(dataset.split(dataset.postures))
        keyed = action_model.by_key_frames(learnt.raw, samples=self.samples, count=self.key_frames)
        aligned = {"linear": learnt.linear, "keyframe": keyed.sequences, "synchronized": learnt.synchronized}
        performances, people = len(dataset.person), dataset.person
        largest_group = np.unique(people, return_counts=True)[1].max()

        def acceptance(groups: np.ndarray | None) -> dict[str, np.ndarray]:
            return {
                alignment: action_model.acceptance_left_out(x, groups=groups, bound=self.bound)
                for alignment, x in aligned.items()
            }

        accepted, relative_distance = acceptance(None), learnt.distances.sum(axis=1)
        relative_distance = relative_distance / np.median(relative_distance)
        outliers = ~accepted["synchronized"].any(axis=1) & (relative_distance > MAX_RELATIVE_DISTANCE)
        remarks = [
            f"{clip} may be of another action: its distance from the others is {times:.1f} times the median, and none "
            "of its postures is within their bounds"
            for clip, times in zip(dataset.clip[outliers], relative_distance[outliers], strict=True)
        ]
        left = action_model.variance_left(learnt.synchronized).mean()
        if left > MAX_VARIANCE_LEFT * (total := action_model.mean_squared_deviation(learnt.synchronized)):
            remarks.append(
                "the performances may be of several actions: after synchronization they differ by "
                f"{100 * left / total:.0f} % of the variance of all postures"
            )
        space = learnt.space
        return Action(
            **(vars(learnt) | {"raw": np.concatenate(learnt.raw)}),
            first=dataset.first,
            keyframe=keyed.sequences,
            keyframe_warp=keyed.warp,
            accepted=Acceptance(
                performances=accepted, people=acceptance(people) if performances - largest_group >= 2 else {}
            ),
            words=f"aSpace of {space.dimensions} dimensions holding {100 * space.variance_held:.1f} % of the variance",
            remarks=remarks,
        )
