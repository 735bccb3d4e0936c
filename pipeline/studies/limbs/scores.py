"""Errors of reconstructed limbs and skeletons, before and after resolving the mirror ambiguity by the truth."""

from __future__ import annotations

import numpy as np

from pipeline.core.articulated_trajectory import LimbChoice, LimbTree, Reconstruction
from pipeline.core.limb_chain import WALKER14, relative_trajectories
from pipeline.core.reconstructibility import Reconstructibility, reconstructibility
from pipeline.studies.limbs.trials import ROOT, LimbTrial

SUCCESS = 0.1
"""Mean error, relative to the limb's length, below which a reconstruction counts as a success."""

MIN_DRAWN = 1e-3
"""Smallest relative limb error that logarithmic axes show; smaller errors are drawn at this value."""


def limb_errors(
    trial: LimbTrial, choice: LimbChoice, *, parent: np.ndarray | None = None
) -> dict[str, float]:
    """Return the errors of the reconstructed trajectory of one limb.

    Parameters
    ----------
    trial : LimbTrial
    choice : LimbChoice
    parent : (F, 3), optional
        Assumed trajectory of the parent, mm; the true one by default.

    Returns
    -------
    dict
        ``limb_error``: mean distance of relative trajectories, as part of the limb's true length; ``relative_error``:
        ||X - X_hat|| / ||X|| of the child in the world's coordinates, as in the paper, which depends on their origin;
        ``error_up_to_mirror``: `limb_error` of the signs or of their mirror, whichever is smaller.
    """
    error = distance(choice.relative, trial.relative) / trial.length
    estimate = choice.relative + (trial.parent if parent is None else parent)
    return {
        "limb_error": error,
        "relative_error": round(
            float(np.linalg.norm(estimate - trial.child) / np.linalg.norm(trial.child)), 12
        ),
        "error_up_to_mirror": min(error, distance(choice.mirror.relative, trial.relative) / trial.length),
    }


def certificate(choice: LimbChoice) -> dict[str, float]:
    """Return the objective of the selected signs, its lower bound, mm², and True if the signs are proved optimal."""
    return {name: getattr(choice.solution, name) for name in ("proved", "objective", "lower_bound")}


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """Return the mean distance, mm, between the points of two trajectories (F, …, 3).

    Notes
    -----
    The result is rounded to nine decimals, so that rounding errors do not change ranks.
    """
    return round(float(np.linalg.norm(a - b, axis=-1).mean()), 9)


def true_signs(choice: LimbChoice, relative: np.ndarray) -> np.ndarray:
    """Return the signs (F,), -1 or +1, of the ray-sphere intersections that are nearer to the truth; +1 on ties."""
    along = ((relative - choice.hits.middle) * choice.hits.rays.direction).sum(axis=1)
    return np.where(along < 0, -1, 1)


def reconstructibility_of(choice: LimbChoice, relative: np.ndarray) -> Reconstructibility:
    """Return the reconstructibility eta_a of a limb from its true relative trajectory (F, 3), mm [park2011 13]."""
    used, hits = choice.used, choice.hits
    signs = true_signs(choice, relative)[used]
    rows = choice.basis.rows(len(used), used)
    return reconstructibility(rows, hits.middle[used], hits.half_chord[used], signs)


def better_of_mirrors(truth: np.ndarray, skeleton: Reconstruction) -> np.ndarray:
    """Return positions (F, 15, 3), mm, where each limb is its estimate or its mirror image, whichever is nearer.

    The estimates are not refined.

    The remaining error does not come from the choice between the two.

    Parameters
    ----------
    truth : (F, 15, 3)
        mm.
    skeleton : Reconstruction
        Reconstruction whose choices of limbs are used.
    """
    tree = LimbTree(WALKER14, skeleton.root)
    for limb, (parent, child) in zip(WALKER14.limbs, WALKER14.ends, strict=True):
        choice = skeleton.choose(tree, limb)
        true = truth[:, child] - truth[:, parent]
        tree = tree.placed(limb, min((choice, choice.mirror), key=lambda c: distance(c.relative, true)))
    return tree.positions


def acceleration_ratio(positions: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return the ratio (…) of rms accelerations of reconstructions (…, F, 15, 3) to those of the truth (F, 15, 3).

    Positions are relative to the pelvis.
    """
    power = [
        np.square(np.diff(p - p[..., [ROOT], :], n=2, axis=-3)).mean(axis=(-3, -2, -1))
        for p in (positions, truth)
    ]
    return np.sqrt(power[0] / power[1])


def length_changes(positions: np.ndarray) -> np.ndarray:
    """Return the largest deviation of each limb's length from its mean, (14,), relative to the mean.

    The result is rounded to twelve decimals.
    """
    sizes = np.linalg.norm(relative_trajectories(WALKER14, positions), axis=-1)
    return np.abs(sizes / sizes.mean(axis=0) - 1.0).max(axis=0).round(12)


def error_about_root(positions: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return the distance (F, 15), mm, between estimated and true joints after the pelvises are superimposed."""
    difference = positions - positions[:, [ROOT]] - (truth - truth[:, [ROOT]])
    return np.linalg.norm(difference, axis=-1)
