"""Action recognition by the model of bends, tested on bends of a new actor, on squats and on walks; nothing is timed.

For each of five actors of HDM05 an action model is learnt from the bends of the other four.  Motions are brought to the
aSpace of that model and synchronized with its median sequence.  A motion is recognised as a bend if at least half of
its samples lie within three standard deviations.  This rule was written before the values were seen.

action       bend: of the actor left out; squat: of the same actor; walk: middle cycles of steady walks of CMU
postures     samples within three standard deviations, %
recognised   motions with at least half of their samples within them, %
linear       the same without synchronization, in the model and in the motion, %
nearer       bends, or squats, that are nearer to the model of their own action by synchronization distance, %

Needs MOCAP_MIRROR or `make data`.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from pipeline.cli.compose import compose
from pipeline.core import action_model, synchronization
from pipeline.core.action_model import LearntAction
from pipeline.core.synchronization import normalise
from pipeline.studies.actions.dataset import Postures
from pipeline.studies.actions.model import ActionSpaceModel
from pipeline.validation import InvalidInput
from tests.benchmarks.tables import Row

SHARE = 0.5
ACTIONS = {"bend": "hdm05", "squat": "hdm05_squat", "walk": "cmu"}
"""Data preset with the recordings of each action."""


def _postures(preset: str) -> tuple[Postures, ActionSpaceModel]:
    experiment = compose(["experiment=mozerov2006_fig3", f"data={preset}"])
    try:
        clips = experiment.data.request(experiment.dataset.corpus, experiment.skeleton, 1, 1).make()
    except InvalidInput as rejection:
        raise SystemExit(f"recognition: {rejection}") from None
    assert isinstance(experiment.model, ActionSpaceModel)
    return experiment.dataset.build(clips, workers=1), experiment.model


def placed(
    options: ActionSpaceModel, learnt: LearntAction, postures: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Project a motion (F, 37) into an action space; return it normalised and synchronized, (P, b), and its cost.

    The cost is relative to the mean squared deviation of a frame of the action.
    """
    linear = normalise(learnt.space.project(postures), options.samples)
    path = synchronization.synchronize(
        learnt.linear[learnt.median], linear, smoothness=learnt.smoothness, **options.path_options
    )
    cost = path.cost / options.samples / action_model.mean_squared_deviation(learnt.synchronized)
    return linear, synchronization.warp(linear, path.disparity), cost


def run() -> list[Row]:
    """Return a row for each action."""
    data = {action: _postures(preset) for action, preset in ACTIONS.items()}
    sequences = {action: dataset.split(dataset.postures) for action, (dataset, _) in data.items()}
    bends, options = data["bend"]
    within, linear = defaultdict[str, list[np.ndarray]](list), defaultdict[str, list[np.ndarray]](list)
    nearer = defaultdict[str, list[bool]](list)
    for actor in np.unique(bends.person):
        learnt = {
            action: options.teach(
                [p for p, who in zip(sequences[action], data[action][0].person, strict=True) if who != actor]
            )
            for action in ("bend", "squat")
        }
        without = action_model.learn(learnt["bend"].linear)
        for action, (dataset, _) in data.items():
            for motion, who in zip(sequences[action], dataset.person, strict=True):
                if action != "walk" and who != actor:
                    continue
                stretched, synchronized, cost = placed(options, learnt["bend"], motion)
                within[action].append(action_model.accepted(learnt["bend"].model, synchronized))
                linear[action].append(action_model.accepted(without, stretched))
                other = placed(options, learnt["squat"], motion)[2]
                nearer[action].append(cost < other if action == "bend" else other < cost)
    return [
        {
            "action": action,
            "motions": len(within[action]),
            "postures": 100.0 * np.mean(within[action]).item(),
            "recognised": 100.0 * np.mean(np.mean(within[action], axis=1) >= SHARE).item(),
            "linear": 100.0 * np.mean(np.mean(linear[action], axis=1) >= SHARE).item(),
            "nearer": 100.0 * np.mean(nearer[action]).item() if action != "walk" else np.nan,
        }
        for action in ACTIONS
    ]
