"""Reconstruction error of limbs, with and without the mirror ambiguity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.core.articulated_trajectory import LimbChoice, LimbTree, Reconstruction
from pipeline.core.limb_chain import WALKER14
from pipeline.studies.limbs.trials import LimbTrial

SUCCESS = 0.1
"""Of a limb's length: a mean error below it counts as success."""


@dataclass(frozen=True)
class LimbScore:
    """Error of the choice for one limb, and what is known of the best signs.

    Attributes
    ----------
    limb_error : float
        Mean distance of relative trajectories, as part of the limb's true length.
    relative_error : float
        ||X - X_hat|| / ||X|| of the child in the world's coordinates, as in the paper; depends on their origin.
    error_up_to_mirror : float
        `limb_error` of the signs or of their mirror, whichever is smaller.
    proved : bool
    objective, lower_bound : float
        As `BinarySolution`, square millimetres.
    """

    limb_error: float
    relative_error: float
    error_up_to_mirror: float
    proved: bool
    objective: float
    lower_bound: float


def limb_score(trial: LimbTrial, choice: LimbChoice, *, parent: np.ndarray | None = None) -> LimbScore:
    """Return the error of a choice, beside that of the better one of it and its mirror.

    Parameters
    ----------
    trial : LimbTrial
    choice : LimbChoice
    parent : (F, 3), optional
        Trajectory that was taken for the parent's, mm; the true one by default.
    """
    error, solution = distance(choice.relative, trial.relative) / trial.length, choice.solution
    estimate = choice.relative + (trial.parent if parent is None else parent)
    return LimbScore(
        limb_error=error,
        relative_error=round(float(np.linalg.norm(estimate - trial.child) / np.linalg.norm(trial.child)), 12),
        error_up_to_mirror=min(error, distance(choice.mirror().relative, trial.relative) / trial.length),
        proved=solution.proved,
        objective=solution.objective,
        lower_bound=solution.lower_bound,
    )


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """Return the mean distance of two trajectories (F, …, 3), mm.

    Notes
    -----
    To nine decimals: smaller differences are rounding, and errors are ranked.
    """
    return round(float(np.linalg.norm(a - b, axis=-1).mean()), 9)


def true_signs(choice: LimbChoice, relative: np.ndarray) -> np.ndarray:
    """Return -1 or +1 (F,), the candidate that is nearer to the truth; +1 where there is no choice."""
    along = ((relative - choice.hits.middle) * choice.hits.rays.direction).sum(axis=1)
    return np.where(along < 0, -1, 1)


def better_of_mirrors(truth: np.ndarray, skeleton: Reconstruction) -> np.ndarray:
    """Return positions (F, 15, 3), mm, with of every limb and its mirror the one nearer to the truth, not refined.

    The error that is left does not come from the choice between the two.

    Parameters
    ----------
    truth : (F, 15, 3)
        mm.
    skeleton : Reconstruction
        What is known of it; limbs as they are chosen there.
    """
    tree = LimbTree(WALKER14, skeleton.root)
    for limb, (parent, child) in zip(WALKER14.limbs, WALKER14.ends, strict=True):
        choice = skeleton.choose(tree, limb)
        true = truth[:, child] - truth[:, parent]
        tree = tree.placed(limb, min((choice, choice.mirror()), key=lambda c: distance(c.relative, true)))
    return tree.positions
