"""Postures as 37 numbers: the height of the pelvis, and the direction cosines of twelve limbs (mozerov2006 section 2).

Symbols
-------
``u``        height of the pelvis over the floor, in leg lengths
``theta``    direction cosines of a limb: its unit direction in the frame of its parent
``h, t, s``  unit directions of hip, torso and shoulder in the world

The frames, and why they are those, stand in `frames`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from pipeline.core.posture import frames, kernels
from pipeline.core.posture.frames import ARMS, FOREARMS, HIP, LEGS, NECK, SHOULDER, THIGHS, TORSO
from pipeline.skeleton import ANKLES, PELVIS, POSTURE12, WALKER15
from pipeline.validation import InvalidInput, require_choice, require_range, require_shape

PARAMETERS = 1 + 3 * len(POSTURE12.limbs)
FRAMES = ("parent", "hip")
HEADINGS = ("first", "every", "none")

FLOOR_PERCENTILE = 5.0
"""Percentile of the lower ankle's height over a clip that defines the floor; robust to a few wrong frames."""

_STARTS, _ENDS = np.transpose(POSTURE12.ends)
_STERNUM = WALKER15.index("sternum")
_OVER = {**dict(zip(LEGS, THIGHS, strict=True)), **dict(zip(FOREARMS, ARMS, strict=True))}
"""Index of the parent of each lower limb: the thigh for a lower leg, the upper arm for a forearm."""

_LIMB_ENDS = np.array(POSTURE12.ends)
_LIMB_OVER = np.array([_OVER.get(limb, -1) for limb in range(len(POSTURE12.limbs))])
_LIMB_REST = np.array([frames.REST.get(limb, np.zeros(3)) for limb in range(len(POSTURE12.limbs))])
_TREES = {
    frame: (PELVIS, _STERNUM, _LIMB_ENDS, _LIMB_OVER, _LIMB_REST, frame == "parent", frames.LEAST_SINE)
    for frame in FRAMES
}
"""Arrays that describe the tree of limbs for the compiled loops, for each choice of the cosines' frame of reference."""

_UNDEFINED = {
    kernels.NO_STANCE: frames.HIP_UPRIGHT,
    kernels.NO_HIP: frames.TORSO_ALONG_HIP,
    kernels.NO_SHOULDER: frames.SHOULDER_ALONG_TORSO,
    kernels.AGAINST_REST: frames.AGAINST_REST,
}


@dataclass(frozen=True)
class LimbLengths:
    """Limb lengths of a person, and offsets of pelvis and shoulders, which a posture vector does not contain.

    Attributes
    ----------
    limbs_mm : (12,)
        In the order of POSTURE12.
    pelvis_mm : (3,)
        The pelvis from the middle of the hips, in the hip's frame.
    shoulders_mm : (3,)
        The middle of the shoulders from the sternum, in the shoulder's frame.
    """

    limbs_mm: np.ndarray
    pelvis_mm: np.ndarray = field(default_factory=lambda: np.zeros(3))
    shoulders_mm: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @property
    def leg_length_mm(self) -> float:
        """Length of thigh plus lower leg, mm, averaged over left and right."""
        return self.limbs_mm[[*THIGHS, *LEGS]].sum() / 2.0

    @cached_property
    def sizes(self) -> tuple[float, tuple[np.ndarray, ...]]:
        """Leg length, mm, and all other body dimensions as arrays, in the form that the compiled loops need."""
        parts = (self.limbs_mm, self.pelvis_mm, self.shoulders_mm)
        return self.leg_length_mm, tuple(np.ascontiguousarray(part, float) for part in parts)


def postures(
    positions: np.ndarray,
    *,
    frame: str = "parent",
    heading: str = "first",
    floor_mm: float | None = None,
) -> np.ndarray:
    """Return postures (T, 37): pelvis height and the direction cosines of twelve limbs [mozerov2006 1, 2].

    Parameters
    ----------
    positions : (T, 15, 3)
        One person's clip in WALKER15 order, mm, z up.
    frame : {"parent", "hip"}
        What cosines are relative to: the limb's parent, or the hip for all (but for hip and torso themselves,
        which make the hip's frame).
    heading : {"first", "every", "none"}
        Yaw taken out of the hip's cosines: that of the first frame, each frame's own, or nothing.
    floor_mm : float, optional
        Height from which the pelvis is measured.  By default the level of the standing ankle (5th percentile of
        the lower ankle's height over the clip), so that u is about 1 in a person who stands straight.

    Raises
    ------
    InvalidInput
        Positions of another shape or missing (by frame and joint), a limb without length, a posture that leaves a
        frame undefined (vertical hip axis, torso along the hip axis, …), or an unknown choice.

    Notes
    -----
    Nothing but the three numbers of the hip depends on the way the person faces, and those only as `heading`
    says; nothing at all depends on the place.  The paper's "normalized height" is undefined: it is divided by
    the mean leg length of the clip here.
    """
    require_choice("frame", frame, FRAMES)
    require_choice("heading", heading, HEADINGS)
    positions = _checked(positions)
    if floor_mm is None:
        floor_mm = floor_level(positions)
    require_range("floor_mm", floor_mm)
    directions, lengths = _limbs(positions)
    h, t, s = (directions[:, limb] for limb in (HIP, TORSO, SHOULDER))
    stance = frames.stance(h)
    hip, torso = frames.hip_and_torso(h, t)
    shoulder = frames.shoulder(s, t)

    result = np.empty((len(positions), PARAMETERS))
    result[:, 0] = (positions[:, PELVIS, 2] - floor_mm) / LimbLengths(lengths.mean(axis=0)).leg_length_mm
    cosines = result[:, 1:].reshape(-1, len(POSTURE12.limbs), 3)
    cosines[:, HIP] = _without_heading(h, heading)
    cosines[:, TORSO] = frames.components_in(stance, t)
    cosines[:, SHOULDER] = frames.components_in(torso if frame == "parent" else hip, s)
    for limb, parent in _frames_of_limbs(hip, torso, shoulder, frame).items():
        cosines[:, limb] = frames.components_in(parent, directions[:, limb])
    if frame == "parent":
        for limb, over in _OVER.items():
            cosines[:, limb] = frames.components_after(over, cosines[:, over], cosines[:, limb])
    return result


def floor_level(positions: np.ndarray) -> float:
    """Return the height of the ankle of a standing foot, mm, which is the zero of the pelvis height.

    Parameters
    ----------
    positions : (T, 15, 3)
        One person's clip in WALKER15 order, mm, z up.

    Notes
    -----
    The 5th percentile of the lower ankle's height: a foot that is placed, not the lowest noise.
    """
    return np.percentile(positions[:, ANKLES, 2].min(axis=1), FLOOR_PERCENTILE)


def limb_lengths(positions: np.ndarray) -> LimbLengths:
    """Return the mean lengths of the twelve limbs in a clip, and the mean offsets of pelvis and shoulders.

    Parameters
    ----------
    positions : (T, 15, 3)
        One person's clip in WALKER15 order, mm, z up.

    Raises
    ------
    InvalidInput
        As `postures`.
    """
    positions = _checked(positions)
    directions, lengths = _limbs(positions)
    h, t, s = (directions[:, limb] for limb in (HIP, TORSO, SHOULDER))
    hip, _ = frames.hip_and_torso(h, t)
    hips, shoulders = (positions[:, POSTURE12.ends[limb]].mean(axis=1) for limb in (HIP, SHOULDER))
    return LimbLengths(
        lengths.mean(axis=0),
        frames.components_in(hip, positions[:, PELVIS] - hips).mean(axis=0),
        frames.components_in(frames.shoulder(s, t), shoulders - positions[:, _STERNUM]).mean(axis=0),
    )


def joints(postures: np.ndarray, limb_lengths: LimbLengths, *, frame: str = "parent") -> np.ndarray:
    """Return the joint positions (…, 15, 3), mm, of postures (…, 37), the inverse of `postures` [mozerov2006 1].

    Parameters
    ----------
    postures : (…, 37)
        Blended ones too: a blend of directions is none, so each limb's cosines are first scaled to unit length.
    limb_lengths : LimbLengths
    frame : {"parent", "hip"}
        As the postures were made.

    Returns
    -------
    positions : (…, 15, 3)
        The pelvis over the origin, z = 0 at the floor from which u was measured, facing as the hip's cosines say.
        Exact for a body of constant lengths.

    Raises
    ------
    InvalidInput
        Postures of another length, not finite, with a limb whose cosines are all zero, or that leave a frame
        undefined.
    """
    positions, outcome = _placed(postures, limb_lengths, frame)
    wrong = outcome[:, 0] != kernels.DEFINED
    if wrong.any():
        number = int(wrong.argmax())
        why, limb = int(outcome[number, 0]), POSTURE12.limbs[outcome[number, 1]]
        if why == kernels.NOT_FINITE:
            raise InvalidInput(
                "a posture has a number that is not finite", f"frame {number}", code="not_finite"
            )
        if why == kernels.NO_COSINES:
            raise InvalidInput(
                "the cosines of a limb are all zero", f"frame {number}, {limb}", code="zero_length"
            )
        values = {"limb": limb} if why == kernels.AGAINST_REST else {}
        raise frames.undefined(number, _UNDEFINED[why], **values)
    return positions


def joints_where_defined(
    postures: np.ndarray, limb_lengths: LimbLengths, *, frame: str = "parent"
) -> np.ndarray:
    """Return the joint positions (…, 15, 3), mm, of postures (…, 37), with NaN for postures that `joints` rejects.

    Parameters
    ----------
    postures : (…, 37)
    limb_lengths : LimbLengths
    frame : {"parent", "hip"}

    Raises
    ------
    InvalidInput
        Postures of another length.
    """
    return _placed(postures, limb_lengths, frame)[0]


def nearest_of_each(joints: np.ndarray, performances: np.ndarray) -> np.ndarray:
    """Return the distance (S, M) from each of S bodies to the nearest posture of each of M performances, mm.

    The distance is the mean over joints, mm.
    """
    distances = np.empty((len(joints), len(performances)))
    kernels.nearest_of_each(np.ascontiguousarray(joints), performances, distances)
    return distances


def _placed(postures: np.ndarray, limb_lengths: LimbLengths, frame: str) -> tuple[np.ndarray, np.ndarray]:
    """Return joint positions (…, 15, 3), mm, and for each posture an error code and the index of its invalid limb, (S,
    2).
    """
    require_choice("frame", frame, FRAMES)
    array = np.asarray(postures, float)
    if array.ndim < 1 or array.shape[-1] != PARAMETERS:
        raise InvalidInput(
            "the array of postures has the wrong shape",
            expected=f"(…, {PARAMETERS})",
            received=array.shape,
            code="wrong_shape",
            shape=array.shape,
        )
    flat = np.ascontiguousarray(array.reshape(-1, PARAMETERS))
    positions = np.empty((len(flat), len(WALKER15.joints), 3))
    outcome = np.empty((len(flat), 2), np.int64)
    kernels.place_joints(flat, *limb_lengths.sizes, _TREES[frame], positions, outcome)
    return positions.reshape(*array.shape[:-1], len(WALKER15.joints), 3), outcome


def _frames_of_limbs(
    hip: np.ndarray, torso: np.ndarray, shoulder: np.ndarray, frame: str
) -> dict[int, np.ndarray]:
    """Return the frame of reference in which each limb's direction is expressed, except hip, torso and shoulder.

    It is the frame before any rotation from the rest direction.
    """
    if frame == "hip":
        return dict.fromkeys((NECK, *THIGHS, *LEGS, *ARMS, *FOREARMS), hip)
    return {
        NECK: torso,
        **dict.fromkeys((*THIGHS, *LEGS), hip),
        **dict.fromkeys((*ARMS, *FOREARMS), shoulder),
    }


def _without_heading(h: np.ndarray, heading: str) -> np.ndarray:
    """Return the hip axes (T, 3), rotated about the vertical so that the heading is removed."""
    if heading == "none":
        return h
    ahead = np.hypot(h[:, 0], h[:, 1])
    cos, sin = h[:, 0] / ahead, h[:, 1] / ahead
    if heading == "first":
        cos, sin = cos[0], sin[0]
    x, y, z = h.T
    return np.stack([cos * x + sin * y, cos * y - sin * x, z], axis=-1)


def _limbs(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the unit directions (T, 12, 3) and lengths (T, 12), mm, of the limbs."""
    limbs = positions[:, _ENDS] - positions[:, _STARTS]
    lengths = np.linalg.norm(limbs, axis=-1)
    if not lengths.all():
        frame, limb = np.argwhere(lengths == 0.0)[0]
        raise InvalidInput(
            "a limb has zero length", f"frame {frame}, {POSTURE12.limbs[limb]}", code="zero_length"
        )
    return limbs / lengths[..., None], lengths


def _checked(positions: np.ndarray) -> np.ndarray:
    positions = np.asarray(positions, float)
    require_shape("positions", positions, ("T", len(WALKER15.joints), 3))
    require_range("frames", len(positions), at_least=1)
    finite = np.isfinite(positions).all(axis=-1)
    if not finite.all():
        frame, joint = np.argwhere(~finite)[0]
        raise InvalidInput(
            f"the joint {WALKER15.joints[joint]} has no position",
            f"frame {frame}",
            code="missing_joint",
            joint=WALKER15.joints[joint],
        )
    return positions
