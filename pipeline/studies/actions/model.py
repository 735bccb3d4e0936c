"""The action: aSpace, median sequence, synchronized performances, action model: mozerov2006 sections 2 to 4."""

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
"""How performances are brought to a common time.

``raw``           as recorded, each of its own length
``linear``        one constant rate each [mozerov2006 7]
``keyframe``      the same number of samples between key-frames, the paper's comparison
``synchronized``  to the rate of the median sequence, the paper's proposal [mozerov2006 18]
"""

UNLIKE = 1.5
"""Global distance to the median one, of a performance that bounds learnt without it nowhere accept, from which it may
be of another action."""

UNRELATED = 0.8
"""Share of the variance that synchronization leaves, of bends and squats up to 0.44, of unrelated motion from 0.95."""


class Penalty(StrEnum):
    """What the smoothness mu weighs [mozerov2006 12, 16]."""

    change = "change"
    """The change of the disparity, mu |k|."""
    as_printed = "as_printed"
    """Its size, mu |d + k|."""


class Start(StrEnum):
    """Whether the disparity of the first sample is zero."""

    fixed = "fixed"
    free = "free"


@dataclass(frozen=True)
class Acceptance:
    """Postures that a model learnt without them accepts.

    Attributes
    ----------
    performances : dict of (M, P) bool
        By alignment: whether the model learnt without the performance accepts each posture.
    people : dict of (M, P) bool
        The same without all performances of its person; empty where too few people perform.
    """

    performances: dict[str, np.ndarray]
    people: dict[str, np.ndarray]


@dataclass(frozen=True)
class Action:
    """What performances of an action teach.

    Attributes
    ----------
    space : ASpace
    model : ActionModel
        Of the synchronized performances.
    raw : (sum of F, b)
        Performances in the aSpace, end to end.
    first : (M + 1,) int
        Where each of them starts.
    linear, keyframe, synchronized : (M, P, b)
        See `ALIGNMENTS`.
    keyframe_warp : (M, P)
        Frame of each performance, fractional, that became each sample by key-frames.
    distances : (M, M)
        C(n, m) of all ordered pairs, squared aSpace units.
    disparity : (M, P) int
        Brings each performance to the rate of the median sequence.
    median : int
        The median sequence.
    smoothness : float
        mu, squared aSpace units.
    accepted : Acceptance
    words : str
    remarks : list of str
        What does not look like one action.
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
        """Return every performance in the aSpace: (F, b) if raw, else (P, b)."""
        if alignment == "raw":
            return [self.raw[a:b] for a, b in pairwise(self.first)]
        return list(getattr(self, alignment))

    def matched_frames(self, alignment: str) -> np.ndarray:
        """Return the frame of each performance, fractional, that matches each sample of the median sequence, (M, P)."""
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
        """The performance of largest disparity from the median sequence, the first on ties."""
        return int(np.abs(self.disparity).max(axis=1).argmax())


ActionInputs = SweepInputs[None, Postures, Action]


class ActionSpaceModel(Model):
    """aSpace, median sequence, synchronized performances and action model."""

    dataset = PostureDataset
    published = True

    variance: Annotated[float, bounded(above=0, at_most=1)] = 0.95  # that the fewest eigenvectors hold
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
                "must hold 0 and none above 1", "model.steps", received=self.steps, code="invalid_steps"
            )

    @property
    def path_options(self) -> dict[str, Any]:
        """Which paths synchronization may take: arguments of `synchronization.synchronize`, all but mu."""
        return {
            "max_disparity": self.max_disparity,
            "penalty": self.penalty.value,
            "start": self.start.value,
            "steps": list(self.steps),
        }

    def teach(self, postures: Sequence[np.ndarray]) -> LearntAction:
        """Return what postures (F, 37) of some performances teach, e.g. of all but one."""
        return action_model.learn_action(
            postures,
            samples=self.samples,
            variance=self.variance,
            dimensions=self.dimensions or None,
            smoothness=self.smoothness,
            **self.path_options,
        )

    def learn(self, dataset: Postures, *, workers: int) -> Action:
        """Return the action, with acceptance by models learnt without each performance, and without each person."""
        learnt = self.teach(dataset.split(dataset.postures))
        keyed = action_model.by_key_frames(learnt.raw, samples=self.samples, count=self.key_frames)
        aligned = {"linear": learnt.linear, "keyframe": keyed.sequences, "synchronized": learnt.synchronized}
        performances, people = len(dataset.person), dataset.person
        most = np.unique(people, return_counts=True)[1].max()

        def acceptance(groups: np.ndarray | None) -> dict[str, np.ndarray]:
            return {
                alignment: action_model.acceptance_left_out(x, groups=groups, bound=self.bound)
                for alignment, x in aligned.items()
            }

        accepted, apart = acceptance(None), learnt.distances.sum(axis=1)
        apart = apart / np.median(apart)
        alien = ~accepted["synchronized"].any(axis=1) & (apart > UNLIKE)
        remarks = [
            f"{clip} is unlike the other performances, {times:.1f} times as far from all as is usual, and none of "
            "its postures is within their bounds: another action?"
            for clip, times in zip(dataset.clip[alien], apart[alien], strict=True)
        ]
        left = action_model.variance_left(learnt.synchronized).mean()
        if left > UNRELATED * (whole := action_model.mean_squared_deviation(learnt.synchronized)):
            remarks.append(
                f"synchronized performances differ by {100 * left / whole:.0f} % of the variance of all postures: "
                "is this one action?"
            )
        space = learnt.space
        return Action(
            **(vars(learnt) | {"raw": np.concatenate(learnt.raw)}),
            first=dataset.first,
            keyframe=keyed.sequences,
            keyframe_warp=keyed.warp,
            accepted=Acceptance(
                performances=accepted, people=acceptance(people) if performances - most >= 2 else {}
            ),
            words=f"aSpace of {space.dimensions} dimensions holding {100 * space.variance_held:.1f} % of the variance",
            remarks=remarks,
        )
