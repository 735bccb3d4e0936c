"""The library: read recordings, represent walks, learn eigenwalkers, complete a view, hand motion to other tools."""

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
from pipeline.validation import InvalidInput, require_choice, require_range

if TYPE_CHECKING:
    import pandas as pd
    from xarray import Dataset

SAME_WALK_MM = 1e-3
"""Largest difference of the coefficients of one walk and its copy."""
_LARGEST_RATIO = 5.0
"""Of the sizes of two people: more is another unit."""


@shortened
class WalkersModel(LinearModel):
    """Average walker and eigenwalkers, and whom they were learnt from.

    Attributes
    ----------
    samples : (R, D)
    """

    samples: np.ndarray = field(kw_only=True)


def joints(
    motion: MotionCapture, skeleton: str = mappings.AUTO, subject: str = "", *, up: str = UpAxis.auto
) -> tuple[np.ndarray, np.ndarray]:
    """Return joint positions (T, 15, 3), mm, z up, and where they are valid (T, 15).

    Unusual proportions of the body, and rules of the mapping that differ between the sides, are warnings.

    Parameters
    ----------
    motion : MotionCapture
    skeleton : str
        A mapping that ships, ``auto``, or a YAML file.
    subject : str
        Who, in a file of several people.
    up : str
        As for `read`; ``auto``: as `read` was called.

    Raises
    ------
    InvalidInput
        If this is no recording that was read, no mapping gives its legs and pelvis, nobody of several is chosen, `up`
        is not an axis, or the joints are not a person's.
    """
    if not isinstance(motion, MotionCapture):
        raise InvalidInput(
            "must be what read(path) returns", "motion", received=repr(motion), code="wrong_type"
        )
    if require_choice("up", up, [*UpAxis]) != UpAxis.auto:
        motion = replace(motion, up=UpAxis(up))
    motion, positions, valid = joints_of(motion, mappings.chosen(skeleton), subject)
    remarks = accepted(positions, valid, motion.frame_rate_hz, walk=False, up=motion.up)
    for remark in (*(complaint.sentence for complaint in motion.complaints), *remarks):
        warnings.warn(remark, stacklevel=2)
    return positions, valid


def represent(
    path: str | Path,
    skeleton: str = mappings.AUTO,
    subject: str = "",
    *,
    frame_rate_hz: float | None = None,
    units: str | None = None,
    up: str = UpAxis.auto,
) -> FourierRepresentation:
    """Return the Fourier representation of the steady walk in a recording, about its mean pelvis.

    Joints above the legs that the markers do not give are estimated.  What is doubtful in the walk is a warning: steps
    that are unusual at its frame rate, left and right points that change places, a joint that was badly tracked.

    Parameters
    ----------
    path : str or Path
    skeleton : str
    subject : str
        Who, in a file of several people.
    frame_rate_hz, units, up
        What the file does not state, see `read`.

    Raises
    ------
    InvalidInput
        If the recording cannot be read or holds no steady walk.
    """
    motion = read(path, frame_rate_hz=frame_rate_hz, units=units, up=up)
    motion, positions, valid = joints_of(motion, mappings.chosen(skeleton), subject)
    walk = walk_in(Path(path).name, positions, motion.frame_rate_hz, valid, motion.up)
    if walk.positions is None:
        code, values = walk.row["code"], walk.row["values"]
        raise InvalidInput(str(walk.row["reason"]), Path(path).name, code=code, **values)
    doubts = [complaint.sentence for complaint in motion.complaints]
    doubts += remarks_of(EXCHANGED, motion.notes)
    for doubt in filter(None, (walk.row["reason"], *doubts)):
        warnings.warn(f"{Path(path).name}: {doubt}", stacklevel=2)
    return fourier.represent(walking.set_origin(walk.positions, origin="pelvis_mean"), motion.frame_rate_hz)


def fit(walks: Sequence[FourierRepresentation], components: int = 30) -> WalkersModel:
    """Return average walker and eigenwalkers of several walks [zhang2007 3.3].

    Raises
    ------
    InvalidInput
        If there are fewer than two, or one is not of two harmonics.
    """
    samples = np.array([sample_of(walk) for walk in walks])
    return WalkersModel(**vars(linear_model.fit(samples, components)), samples=samples)


def sample_of(walk: FourierRepresentation) -> np.ndarray:
    """Return a walk as a sample (D,).  Raises InvalidInput if it is not one."""
    coefficients = getattr(walk, "coefficients", np.empty(0))
    if coefficients.shape != (5, 15, 3):
        raise InvalidInput(
            "must be what represent(path) returns", "walk", received=repr(walk), code="wrong_type"
        )
    return coefficients.ravel()


def require_other(model: WalkersModel, walk: FourierRepresentation) -> None:
    """Require a walk that the model was not learnt from.  Raises InvalidInput."""
    sample = sample_of(walk)
    if (abs(model.samples - sample).max(axis=1) < SAME_WALK_MM).any():
        raise InvalidInput(
            "must be learnt from other walks", "model", received="this one among them", code="same_walk"
        )


def from_view(
    model: LinearModel,
    walk: FourierRepresentation,
    view_angle_deg: float,
    *,
    hidden: Sequence[str] = (),
    noise_variance_mm2: float = 70.0,
) -> np.ndarray:
    """Return the Fourier coefficients (5, 15, 3), mm, that one view of a walk tells, by the walkers' prior.

    Parameters
    ----------
    model : LinearModel
        Of other walkers.
    walk : FourierRepresentation
        Only its image at the view angle is used.
    view_angle_deg : float
    hidden : sequence of str
        Joints that the image does not show: all three of their coordinates are reconstructed.
    noise_variance_mm2 : float
        sigma² of [zhang2007 3.12].

    Raises
    ------
    InvalidInput
        If the angle is not finite, the noise variance not above 0, a hidden joint is not one of the fifteen or none is
        seen, walk and model are not in one unit, or `fit` learnt the model from this walk, too.
    """
    for joint in hidden:
        require_choice("hidden", joint, WALKER15.joints)
    seen = np.array([joint not in hidden for joint in WALKER15.joints])
    if not seen.any():
        raise InvalidInput("must leave a joint that is seen", "hidden", received="all", code="nothing_seen")
    require_range("noise_variance_mm2", noise_variance_mm2, above=0)
    if not isinstance(model, LinearModel):
        raise InvalidInput(
            "must be what fit(walks) returns", "model", received=repr(model), code="wrong_type"
        )
    sample = sample_of(walk)
    size = np.linalg.norm(sample) / np.linalg.norm(model.mean)
    if not 1 / _LARGEST_RATIO < size < _LARGEST_RATIO:
        raise InvalidInput(
            "must be in mm, as the model is", "walk", received=f"{size:.3g} of its size", code="wrong_unit"
        )
    angle = np.radians(require_range("view_angle_deg", view_angle_deg))
    if isinstance(model, WalkersModel):
        require_other(model, walk)
    return complete_walk(model, sample, angle, seen, noise_variance=noise_variance_mm2)


def to_dataframe(
    motion: MotionCapture, skeleton: str = "", *, individual: str = "individual_0"
) -> pd.DataFrame:
    """Return a recording as a tidy table, a row for each frame and point; needs pandas.

    Columns are ``time_s, individual, keypoint, x_mm, y_mm, z_mm``; what was not measured is NaN.

    Parameters
    ----------
    motion : MotionCapture
    skeleton : str
        Empty: the points of the file, in its own axes; else the fifteen joints, z up, by a mapping as in `joints`.
    individual : str
        Who it is.
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
    """Return a recording as a data set of xarray, as the package movement has it; needs xarray.

    ``position`` (time, space, keypoint, individual) is in mm, ``time`` in seconds; ``confidence`` is not known: NaN.

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
    """Times (T,), names and positions (T, K, 3) of points or joints; NaN where they were not measured."""
    names, positions, valid = motion.names, motion.positions_mm, motion.valid
    if skeleton:
        names, (positions, valid) = WALKER15.joints, joints(motion, skeleton)
    times = np.arange(len(positions)) / motion.frame_rate_hz
    return times, names, np.where(valid[..., None], positions, np.nan)
