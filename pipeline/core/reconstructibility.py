"""Reconstructibility of a limb: how reliably its depth can be chosen from the images of one camera (park2011 section
4).

Symbols
-------
``Theta``    trajectory basis, (F, K); any matrix B with no singular value above one takes its place (a soft basis)
``gamma_X``  the truth in F frames; ``gamma_C`` the impostor: in every frame the other candidate
``b``        1 where a frame is estimated as the impostor, 0 where as the truth
``eta_a``    part of the impostor outside the basis over that of the truth

What gamma is
-------------
Printed, gamma is the angle at the parent between the limb and the line from the camera through the parent
(`viewing_angles`).  That reading is offered, but predicts little: far from the camera gamma_C is pi - gamma_X, whose
part outside the basis is the same, so eta_a tends to one whatever moves.  By default gamma is the relative direction
vector chi, which is what [park2011 12] measures; its three coordinates are summed.

The part of c outside a soft basis is c^T (I - B B^T) c = |c - B z|^2 + z^T (I - B^T B) z with z = B^T c: no matrix of
F x F is formed, and nothing cancels when little is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

import numpy as np

from pipeline.validation import InvalidInput, require_choice, require_range, require_shape


class Reading(StrEnum):
    """Definitions of the limb trajectory gamma from which the reconstructibility is computed [park2011 13]."""

    vector = "vector"
    """Gamma is the trajectory of a limb's child joint relative to its parent joint."""
    angle = "angle"
    """Gamma is the angle between the limb and the line of sight, as in the paper."""


Confidence = Literal["green", "amber", "red"]

GREEN_ABOVE, RED_BELOW = 2.0, 0.95
"""Thresholds of the reconstructibility eta_a: the confidence is green above the first, and red below the second.

In recorded clips, 97 % of the signs are correct above the first, and no sign is below the second.
"""

MARGIN_GREEN_ABOVE, MARGIN_RED_BELOW = 2.0, 1.25
"""Thresholds of the mirror margin: the confidence is green above the first, and red below the second.

95 % of the signs are correct above the first.  At a margin of one the choice is assumed to be random.
"""

_ROUNDING = 1e-12
"""Relative norm of a trajectory's component outside the basis below which it counts as rounding error."""


@dataclass(frozen=True)
class Reconstructibility:
    """Reconstructibility of one limb, or of all limbs of a clip together.

    It compares the impostor (the other candidate in every frame) with the truth.

    Attributes
    ----------
    ratio : float
        eta_a: infinite where the truth lies in the basis and the impostor does not, 1 where both do.
    truth, impostor : float
        Parts outside the basis, root of the sum of squares: mm, or rad for angles.
    """

    ratio: float
    truth: float
    impostor: float

    @property
    def confidence(self) -> Confidence:
        """Confidence from the reconstructibility eta_a: green above 2, red below 0.95, otherwise amber."""
        return _confidence(self.ratio, RED_BELOW, GREEN_ABOVE)


def reconstructibility(
    basis: np.ndarray,
    middle: np.ndarray,
    half_chord: np.ndarray,
    signs_true: np.ndarray,
    *,
    reading: Reading = Reading.vector,
    axis: np.ndarray | None = None,
) -> Reconstructibility:
    """Return the reconstructibility eta_a of one limb in a clip [park2011 13].

    Parameters
    ----------
    basis : (F, K)
        Theta, or a soft basis; restricted, like all else, to the frames in which the limb was seen.
    middle, half_chord : (F, 3)
        m and u of `pipeline.core.articulation.ray_sphere`, mm; the candidates are m + s u.
    signs_true : (F,)
        s of the truth, +1 or -1.
    reading : Reading
        gamma as the relative direction vectors, or as printed.
    axis : (F, 3) or None
        Directions from camera to parent (`RayHits.rays.axis`), for the angle alone.

    Raises
    ------
    InvalidInput
        If shapes do not fit, a number is not finite, there are under three frames, a sign is none, the basis is
        longer than one in some direction or has no room outside, or the axis is not there when it is needed.
    """
    middle, half_chord = np.asarray(middle, float), np.asarray(half_chord, float)
    signs = np.asarray(signs_true, float)
    require_shape("half chord", half_chord, require_shape("middle", middle, ("F", 3)).shape)
    require_shape("signs", signs, middle.shape[:1])
    if not (np.abs(signs) == 1.0).all():
        raise InvalidInput(
            "must be +1 or -1", "signs", received=signs[np.abs(signs) != 1.0][0], code="not_signs"
        )
    truth, impostor = middle + signs[:, None] * half_chord, middle - signs[:, None] * half_chord
    if require_choice("reading", reading, Reading) == Reading.angle:
        across = require_shape("axis", axis, truth.shape)
        truth, impostor = viewing_angles(truth, across), viewing_angles(impostor, across)
    return _compared(outside(basis, truth), outside(basis, impostor), float(np.linalg.norm(truth)))


def of_clip(limbs: Sequence[Reconstructibility]) -> Reconstructibility:
    """Return the reconstructibility of a clip, from the reconstructibility of each limb.

    The squared parts outside the basis are summed over the limbs.
    """
    if not limbs:
        raise InvalidInput(
            "the reconstructibility of a clip needs at least one limb",
            expected="one limb or more",
            code="no_limbs",
        )
    truth, impostor = (np.hypot.reduce([getattr(x, name) for x in limbs]) for name in ("truth", "impostor"))
    return _compared(truth, impostor, 0.0)


def confidence_of_mirror_margin(margin: float) -> Confidence:
    """Return the confidence from the mirror margin J(-s) / J(s): green above 2, red below 1.25, otherwise amber.

    The margin does not need the ground truth.

    Raises
    ------
    InvalidInput
        If the margin is not a number.
    """
    return _confidence(margin, MARGIN_RED_BELOW, MARGIN_GREEN_ABOVE)


def viewing_angles(directions: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the angle gamma (F,), 0 to pi rad, between a limb (F, 3) and the direction (F, 3) from camera to parent
    joint.

    The vectors may have any length.

    Raises
    ------
    InvalidInput
        If the shapes do not fit.
    """
    directions, axis = np.asarray(directions, float), np.asarray(axis, float)
    require_shape("axis", axis, directions.shape)
    across = np.linalg.norm(np.cross(axis, directions), axis=-1)
    return np.arctan2(across, (axis * directions).sum(axis=-1))


def view_from_the_camera(gamma: np.ndarray, distance: float) -> np.ndarray:
    """Return the angle alpha (…), rad, between the two ends of a limb as seen from the camera (park2011 section 4).

    alpha = atan(sin gamma / (l + cos gamma)) is not linear in gamma, so that a basis that spans gamma does not span
    alpha; far away it vanishes.

    Parameters
    ----------
    gamma : (…)
        At the parent, between the limb and the line from the camera through the parent, rad.
    distance : float
        l, of the camera from the parent, in lengths of the limb; above 1, or the limb may reach behind the camera.

    Examples
    --------
    >>> np.degrees(view_from_the_camera(np.array([0.0, np.pi / 2]), 1.0)).round(9).tolist()
    [0.0, 45.0]
    """
    require_range("distance", distance, at_least=1.0, unit="lengths of the limb")
    return np.arctan2(np.sin(gamma), distance + np.cos(gamma))


def outside(basis: np.ndarray, trajectory: np.ndarray) -> float:
    """Return the norm of a trajectory's component outside a basis, for a trajectory (F,) or (F, D).

    Parameters
    ----------
    basis : (F, K)
        Orthonormal, or a soft basis.
    trajectory : (F,) or (F, D)

    Raises
    ------
    InvalidInput
        If shapes do not fit, a number is not finite, there are under three frames, or the basis is none.
    """
    basis, c = _checked(basis, trajectory)
    z = basis.T @ c
    slack = np.eye(basis.shape[1]) - basis.T @ basis
    # Else rounding, times what is inside, drowns a small part outside.
    slack[np.abs(slack) < 10.0 * _ROUNDING] = 0.0
    left = c - basis @ z
    return np.sqrt(max((left * left).sum() + (z * (slack @ z)).sum(), 0.0))


def _checked(basis: np.ndarray, trajectory: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Check a basis (F, K) and a trajectory, and return both, the trajectory with shape (F, D)."""
    basis, c = np.asarray(basis, float), np.asarray(trajectory, float)
    if basis.ndim != 2 or c.ndim not in (1, 2) or len(c) != len(basis):
        raise InvalidInput(
            "basis and trajectory have incompatible shapes",
            expected="a basis (F, K) and a trajectory (F,) or (F, D)",
            received=f"{basis.shape} and {c.shape}",
            code="mismatch",
        )
    if len(c) < 3:
        raise InvalidInput(
            "too few frames to measure the smoothness of a trajectory",
            expected="3 or more",
            received=len(c),
            code="too_few_frames",
            frames=len(c),
        )
    c = c.reshape(len(c), -1)
    bad = ~(np.isfinite(c).all(axis=1) & np.isfinite(basis).all(axis=1))
    if bad.any():
        raise InvalidInput(
            "a trajectory or its basis has a number that is not finite",
            f"frame {bad.argmax()}",
            "finite numbers; pass only the frames in which the limb was observed",
            code="not_finite",
        )
    longest = np.linalg.norm(basis, 2) if basis.size else 0.0
    if longest > 1.0 + 1e-9:
        raise InvalidInput(
            "the basis is not orthonormal",
            expected="no singular value above 1",
            received=f"{longest:g}",
            code="not_orthonormal",
            norm=longest,
        )
    return basis, c


def _compared(truth: float, impostor: float, size: float) -> Reconstructibility:
    truth, impostor = (0.0 if part <= _ROUNDING * size else part for part in (truth, impostor))
    if truth == 0.0:
        return Reconstructibility(np.inf if impostor > 0.0 else 1.0, truth, impostor)
    return Reconstructibility(impostor / truth, truth, impostor)


def _confidence(value: float, red_below: float, green_above: float) -> Confidence:
    if np.isnan(value):
        raise InvalidInput("must be a number", "margin", received="nan", code="not_finite")
    return "red" if value < red_below else "green" if value > green_above else "amber"


@dataclass(frozen=True)
class ChoiceResidual:
    """Residual, outside the basis, of a trajectory that is correct in some frames and mirrored in the other frames.

    Attributes
    ----------
    value : float
        Squared distance of the chosen trajectory and the nearest one in the basis.
    within : (F, D) float64
        Chosen from what truth and impostor have inside the basis; itself not inside it where choices change.
    beyond : (F, D) float64
        Chosen from what they have outside the basis.
    """

    value: float
    within: np.ndarray
    beyond: np.ndarray


def estimated(truth: np.ndarray, impostor: np.ndarray, choices: np.ndarray) -> np.ndarray:
    """Return a mixed trajectory (F, …): the mirrored one in frames with b = 1, the true one elsewhere
    [park2011 14, 15].

    Parameters
    ----------
    truth, impostor : (F, …)
        gamma_X and gamma_C: angles or vectors.
    choices : (F,)
        b, 0 or 1: the diagonal of B.

    Raises
    ------
    InvalidInput
        If shapes do not fit or a choice is neither 0 nor 1.
    """
    truth, impostor, b = (np.asarray(a) for a in (truth, impostor, choices))
    if truth.shape != impostor.shape or b.shape != truth.shape[:1] or not np.isin(b, (0, 1)).all():
        raise InvalidInput(
            "the arrays truth, impostor and choices are incompatible",
            expected="two arrays of equal shape, and 0 or 1 for each frame",
            received=f"{truth.shape}, {impostor.shape} and {b.shape}",
            code="mismatch",
        )
    return np.where(b.reshape(-1, *[1] * (truth.ndim - 1)) == 1, impostor, truth)


def choice_residual(
    basis: np.ndarray, truth: np.ndarray, impostor: np.ndarray, choices: np.ndarray
) -> ChoiceResidual:
    """Return the squared distance between a mixed trajectory and the span of a basis [park2011 16, 17, 18].

    The minimum over a_hat for a given B.  [park2011 16, 17] measure the chosen trajectory as a whole, [park2011 18]
    as the sum of `within` and `beyond`.

    Parameters
    ----------
    basis : (F, K)
        Theta, orthonormal: the split into parts asks for it.
    truth, impostor : (F,) or (F, D)
        gamma_X and gamma_C.
    choices : (F,)
        b, 0 or 1.

    Raises
    ------
    InvalidInput
        If shapes do not fit, a number is not finite, or the basis is not orthonormal.
    """
    basis, x = _checked(basis, truth)
    _, c = _checked(basis, impostor)
    if np.abs(basis.T @ basis - np.eye(basis.shape[1])).max(initial=0.0) > 1e-9:
        raise InvalidInput(
            "the basis is not orthonormal", expected="Theta^T Theta = I", code="not_orthonormal"
        )
    inside_x, inside_c = basis @ (basis.T @ x), basis @ (basis.T @ c)
    within = estimated(inside_x, inside_c, choices)
    beyond = estimated(x - inside_x, c - inside_c, choices)
    return ChoiceResidual(outside(basis, estimated(x, c, choices)) ** 2, within, beyond)
