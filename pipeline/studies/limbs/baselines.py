"""Baseline positions of limbs, with which the reconstruction errors of the method are compared.

hanging    trunk and head straight up, arms and legs straight down, from the given root and with the given lengths.  No
           image is used.  The heading of the body is unknown too, so hips and shoulders stay in the middle.
random signs  one of the two candidates of each limb and frame at random, about the parent from the same process.
mean pose  the mean of the true motion over the clip, held constant.  It uses the truth, which no method has.
"""

from __future__ import annotations

import numpy as np

from pipeline.core.articulation import ray_sphere
from pipeline.core.limb_chain import WALKER14, forward
from pipeline.core.pinhole import Pinhole
from pipeline.palette import Style
from pipeline.studies.limbs.scores import distance
from pipeline.studies.limbs.trials import ROOT, LimbTrial

STYLES = tuple(
    Style(label, "baseline", line=line, interval=False)
    for label, line in (("hangs straight down", "dotted"), ("mean pose", "dashed"))
)
"""Chart styles of the two baselines: a skeleton that hangs from its root, and the mean pose."""

_UPWARDS = {"sternum": 1.0, "head": 1.0, "elbow": -1.0, "wrist": -1.0, "knee": -1.0, "ankle": -1.0}

HANGING = np.array(
    [
        [0.0, 0.0, _UPWARDS.get(limb.removeprefix("left_").removeprefix("right_"), 0.0)]
        for limb in WALKER14.limbs
    ]
)
"""Unit direction (14, 3) of every limb of a hanging skeleton; zero for the limbs from pelvis to hips and shoulders."""


def hanging(root: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Return the positions (F, 15, 3), mm, of a skeleton that hangs motionless from a moving root (F, 3), mm."""
    return forward(WALKER14, root, np.broadcast_to(lengths[:, None] * HANGING, (len(root), *HANGING.shape)))


def random_signs(
    camera: Pinhole, images: np.ndarray, root: np.ndarray, lengths: np.ndarray, generator: np.random.Generator
) -> np.ndarray:
    """Return positions (F, 15, 3), mm, with each limb's end at a random one of its two ray-sphere intersections.

    The candidates are the intersections of the rays through images (F, 15, 2), px, with the spheres of the limbs.
    """
    positions = np.full((len(root), len(WALKER14.joints), 3), np.nan)
    positions[:, ROOT] = root
    for length, (parent, child) in zip(lengths, WALKER14.ends, strict=True):
        hits = ray_sphere(camera.matrix, images[:, child], positions[:, parent], length).resolved()
        signs = generator.choice([-1.0, 1.0], len(root))
        positions[:, child] = positions[:, parent] + hits.chosen(signs)
    return positions


def mean_pose(root: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return the positions (F, 15, 3), mm, of the mean true pose, moved along with a root (F, 3), mm."""
    about = truth - truth[:, [ROOT]]
    return root[:, None] + about.mean(axis=0)


def limb_errors(trial: LimbTrial, *, moved: np.ndarray | float = 0.0, scale: float = 1.0) -> dict[str, float]:
    """Return, for each baseline, the mean distance of a limb's end from the true end, relative to the limb's length.

    Parameters
    ----------
    trial : LimbTrial
    moved : (F, 3), optional
        Error of the parent's trajectory, mm.
    scale : float
        Assumed length relative to the true one.
    """
    estimates = {
        "hanging_error": scale * trial.length * HANGING[trial.limb],
        "mean_pose_error": scale * trial.relative.mean(axis=0),
    }
    return {name: distance(moved + still, trial.relative) / trial.length for name, still in estimates.items()}
