"""Functions of the library: read recordings, represent walks, learn eigenwalkers, reconstruct and synthesise motion."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipeline import mappings
from pipeline.clips.walks import walk_in
from pipeline.core import fourier, linear_model, walking
from pipeline.core.fourier import FourierRepresentation
from pipeline.core.linear_model import LinearModel
from pipeline.core.reconstruction.completed import complete_walk
from pipeline.formats import read as read
from pipeline.ingestion.joints import EXCHANGED, joints_of
from pipeline.resources import optional_packages
from pipeline.shortened import shortened
from pipeline.skeleton import WALKER15
from pipeline.skeleton.body import accepted
from pipeline.skeleton.complaint import remarks_of
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import UpAxis
from pipeline.validation import InvalidInput, require_choice, require_finite, require_range, require_shape

if TYPE_CHECKING:
    import pandas as pd
    from xarray import Dataset

SAME_WALK_MM = 1e-3
"""Difference, mm, of Fourier coefficients below which two walks are treated as the same walk."""
_MAX_SIZE_RATIO = 5.0
"""Maximum ratio of the sizes of two people; a larger ratio indicates different units of length."""


@shortened
class WalkersModel(LinearModel):
    """Average walker and eigenwalkers, with the walks from which they were learnt.

    Attributes
    ----------
    samples : (R, D)
        Fourier coefficients of the walks.
    """

    samples: np.ndarray = field(kw_only=True)


def joints(
    motion: MotionCapture, skeleton: str = mappings.AUTO, subject: str = "", *, up: str = UpAxis.auto
) -> tuple[np.ndarray, np.ndarray]:
    """Return joint positions (T, 15, 3) in mm, z up, and the mask (T, 15) of valid positions.

    The function warns about unusual body proportions and about mapping rules that differ between left and right.

    Parameters
    ----------
    motion : MotionCapture
        Recording from `read`.
    skeleton : str
        Name of a shipped mapping, ``auto``, or a YAML file.
    subject : str
        Name of the person, for a file of several people.
    up : str
        Axis that points up, as for `read`; ``auto``: as in the call of `read`.

    Raises
    ------
    InvalidInput
        If `motion` is not from `read`, or `up` is not an axis.  Also if no mapping gives legs and pelvis, `subject` is
        needed, or the joints do not form a human body.
    """
    if not isinstance(motion, MotionCapture):
        raise InvalidInput(
            "must be a recording from read(path)", "motion", received=repr(motion), code="wrong_type"
        )
    if require_choice("up", up, [*UpAxis]) != UpAxis.auto:
        motion = replace(motion, up=UpAxis(up))
    motion, positions, valid = joints_of(motion, mappings.chosen(skeleton), subject)
    remarks = accepted(positions, valid, motion.frame_rate_hz, walk=False, up=motion.up)
    for remark in (*(complaint.sentence for complaint in motion.complaints), *remarks):
        warnings.warn(remark, stacklevel=2)
    return positions, valid


def represent(
    path: str | Path | MotionCapture,
    skeleton: str = mappings.AUTO,
    subject: str = "",
    *,
    frame_rate_hz: float | None = None,
    units: str | None = None,
    up: str = UpAxis.auto,
) -> FourierRepresentation:
    """Return the Fourier representation of the steady walk in a recording, relative to its mean pelvis position.

    Joints above the legs are estimated if the markers do not give them.  The function warns about doubtful walks: an
    unusual stride frequency, left and right points that swap, a badly tracked joint.

    Parameters
    ----------
    path : str, Path or MotionCapture
        File, or the recording that `read` or `motion` returned.
    skeleton : str
        Mapping, as for `joints`.
    subject : str
        Name of the person, for a file of several people.
    frame_rate_hz, units, up
        Values that the file does not state, as for `read`; without effect on a recording that has been read.

    Raises
    ------
    InvalidInput
        If the recording cannot be read or contains no steady walk.
    """
    if isinstance(path, MotionCapture):
        motion, name = path, "motion"
    else:
        motion, name = read(path, frame_rate_hz=frame_rate_hz, units=units, up=up), Path(path).name
    motion, positions, valid = joints_of(motion, mappings.chosen(skeleton), subject)
    walk = walk_in(name, positions, motion.frame_rate_hz, valid, motion.up)
    if walk.positions is None:
        code, values = walk.row["code"], walk.row["values"]
        raise InvalidInput(str(walk.row["reason"]), name, code=code, **values)
    doubts = [complaint.sentence for complaint in motion.complaints]
    doubts += remarks_of(EXCHANGED, motion.notes)
    for doubt in filter(None, (walk.row["reason"], *doubts)):
        warnings.warn(f"{name}: {doubt}", stacklevel=2)
    return fourier.represent(walking.set_origin(walk.positions, origin="pelvis_mean"), motion.frame_rate_hz)


def fit(walks: Sequence[FourierRepresentation], components: int = 30) -> WalkersModel:
    """Return the average walker and the eigenwalkers of several walks [zhang2007 3.3].

    Raises
    ------
    InvalidInput
        If there are fewer than two walks, or a walk does not have two harmonics.
    """
    samples = np.array([sample_of(walk) for walk in walks])
    return WalkersModel(**vars(linear_model.fit(samples, components)), samples=samples)


def sample_of(walk: FourierRepresentation) -> np.ndarray:
    """Return the Fourier coefficients of a walk as a vector (D,).

    Raises InvalidInput if `walk` is not a result of `represent`.
    """
    coefficients = getattr(walk, "coefficients", np.empty(0))
    if coefficients.shape != (5, 15, 3):
        raise InvalidInput(
            "must be a walk from represent(path)", "walk", received=repr(walk), code="wrong_type"
        )
    return coefficients.ravel()


def require_other(model: WalkersModel, walk: FourierRepresentation) -> None:
    """Raise InvalidInput if the walk is one of the walks from which the model was learnt."""
    sample = sample_of(walk)
    if (abs(model.samples - sample).max(axis=1) < SAME_WALK_MM).any():
        raise InvalidInput(
            "must be learnt from walks other than the given walk",
            "model",
            received="a model learnt from this walk",
            code="same_walk",
        )


def from_view(
    model: LinearModel,
    walk: FourierRepresentation,
    view_angle_deg: float,
    *,
    hidden: Sequence[str] = (),
    noise_variance_mm2: float = 70.0,
) -> np.ndarray:
    """Return a walk's Fourier coefficients (5, 15, 3), mm, reconstructed from one view with the model as prior.

    Parameters
    ----------
    model : LinearModel
        Model of other walkers.
    walk : FourierRepresentation
        Walk; only its image at the view angle is used.
    view_angle_deg : float
    hidden : sequence of str
        Joints that are not visible in the image: all three of their coordinates are reconstructed.
    noise_variance_mm2 : float
        Noise variance sigma² of [zhang2007 3.12].

    Raises
    ------
    InvalidInput
        If an argument is out of range, a hidden joint is unknown, or all joints are hidden.  Also if walk and model
        differ in unit, or the model was learnt from this walk.
    """
    for joint in hidden:
        require_choice("hidden", joint, WALKER15.joints)
    visible = np.array([joint not in hidden for joint in WALKER15.joints])
    if not visible.any():
        raise InvalidInput(
            "must leave at least one joint visible", "hidden", received="all joints", code="nothing_seen"
        )
    require_range("noise_variance_mm2", noise_variance_mm2, above=0)
    if not isinstance(model, LinearModel):
        raise InvalidInput(
            "must be a model from fit(walks)", "model", received=repr(model), code="wrong_type"
        )
    sample = sample_of(walk)
    size = np.linalg.norm(sample) / np.linalg.norm(model.mean)
    if not 1 / _MAX_SIZE_RATIO < size < _MAX_SIZE_RATIO:
        raise InvalidInput(
            "must be in mm, like the model",
            "walk",
            received=f"{size:.3g} times the size of the average walker",
            code="wrong_unit",
        )
    angle = np.radians(require_range("view_angle_deg", view_angle_deg))
    if isinstance(model, WalkersModel):
        require_other(model, walk)
    return complete_walk(model, sample, angle, visible, noise_variance=noise_variance_mm2)


def motion(
    coefficients: np.ndarray, frequency_hz: float, n_cycles: float = 3.0, frame_rate_hz: float = 100.0
) -> MotionCapture:
    """Return the motion that a Fourier representation describes: walking on the spot, facing +y, z up.

    Parameters
    ----------
    coefficients : (1 + 2H, 15, 3)
        Result of `from_view`, or ``represent(path).coefficients``, mm.
    frequency_hz : float
        Stride frequency, e.g. ``represent(path).frequency_hz``.
    n_cycles : float
        Number of strides.
    frame_rate_hz : float

    Raises
    ------
    InvalidInput
        If the coefficients have another shape, or there are fewer than two or more than a million frames.
    """
    w = require_finite("coefficients", require_shape("coefficients", coefficients, ("B", 15, 3)))
    require_range("frequency_hz", frequency_hz, above=0)
    require_range("n_cycles", n_cycles, above=0)
    require_range("frame_rate_hz", frame_rate_hz, above=0)
    seconds = n_cycles / frequency_hz
    count = round(require_range("frames of the motion", seconds * frame_rate_hz, at_least=2, at_most=1e6))
    positions = fourier.synthesise(w, frequency_hz, np.arange(count) / frame_rate_hz)
    valid = np.ones(positions.shape[:2], bool)
    return MotionCapture(WALKER15.joints, positions, valid, float(frame_rate_hz), "mm", up=UpAxis.z)


def to_dataframe(
    motion: MotionCapture, skeleton: str = "", *, individual: str = "individual_0"
) -> pd.DataFrame:
    """Return a recording as a tidy pandas table with one row for each frame and point.

    Columns are ``time_s, individual, keypoint, x_mm, y_mm, z_mm``; missing positions are NaN.

    Parameters
    ----------
    motion : MotionCapture
    skeleton : str
        Mapping to the fifteen joints, z up, as for `joints`; empty for the points and axes of the file.
    individual : str
        Name of the person in the table.
    """
    with optional_packages():
        import pandas as pd

    times, names, positions = _points(motion, skeleton)
    columns = {
        "time_s": np.repeat(times, len(names)),
        "individual": individual,
        "keypoint": np.tile(names, len(positions)),
    }
    flat = positions.reshape(-1, 3)
    return pd.DataFrame(columns | {f"{axis}_mm": flat[:, k] for k, axis in enumerate("xyz")})


def to_xarray(motion: MotionCapture, skeleton: str = "", *, individual: str = "individual_0") -> Dataset:
    """Return a recording as an xarray data set in the layout of the package ``movement``.

    ``position`` (time, space, keypoint, individual) is in mm, ``time`` in seconds; ``confidence`` is unknown (NaN).

    Parameters
    ----------
    motion, skeleton, individual
        As for `to_dataframe`.
    """
    with optional_packages():
        import xarray as xr

    times, names, positions = _points(motion, skeleton)
    position = np.swapaxes(positions, 1, 2)[..., None]
    return xr.Dataset(
        {
            "position": (("time", "space", "keypoint", "individual"), position, {"units": "mm"}),
            "confidence": (("time", "keypoint", "individual"), np.full_like(position[:, 0], np.nan)),
        },
        coords={"time": times, "space": list("xyz"), "keypoint": list(names), "individual": [individual]},
        attrs={
            "fps": motion.frame_rate_hz,
            "time_unit": "seconds",
            "source_software": "gait-pipeline",
            "ds_type": "poses",
        },
    )


def _points(motion: MotionCapture, skeleton: str) -> tuple[np.ndarray, Sequence[str], np.ndarray]:
    """Return times (T,), s, names (K), and positions (T, K, 3), mm, of points or joints; NaN where missing."""
    names, positions, valid = motion.names, motion.positions_mm, motion.valid
    if skeleton:
        names, (positions, valid) = WALKER15.joints, joints(motion, skeleton)
    times = np.arange(len(positions)) / motion.frame_rate_hz
    return times, names, np.where(valid[..., None], positions, np.nan)
