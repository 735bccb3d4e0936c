"""Functions of the library: 3D walks from films and keypoints, error bars for one view, and motion files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack, cast

import numpy as np

from pipeline import api
from pipeline.api import SAME_WALK_MM, WalkersModel, require_other, sample_of
from pipeline.core.fourier import FourierRepresentation
from pipeline.core.linear_model import LinearModel
from pipeline.shortened import shortened
from pipeline.skeleton import WALKER15
from pipeline.skeleton.recorded import MotionCapture
from pipeline.skeleton.source_mapping import UpAxis
from pipeline.storage.publishing import new_file
from pipeline.validation import InvalidInput, require_choice, require_count, require_range
from walk3d.anatomy.joint_angles import JOINT_ANGLES, SIDES, flexion
from walk3d.anatomy.one_view import (
    NORMAL_95,
    Reconstruction,
    calibrated_multipliers,
    covariance_of_map,
    learnt_prior,
    of_unknown_laboratory,
)
from walk3d.anatomy.prior import by_block
from walk3d.anatomy.prior.own_laboratory import OF_HEIGHT, Learnt, calibrated, scaled, truncated
from walk3d.anatomy.prior.own_laboratory import height_mm as height_of
from walk3d.export.motion import WRITTEN
from walk3d.export.motion import Motion as Points
from walk3d.export.motion import write as write_points
from walk3d.film.walk.training import HEIGHT_MM

if TYPE_CHECKING:
    from walk3d.film.reconstruct.clip import Walk

BLOCKS, SIZE = 5, 225
"""Number of Fourier coefficients of a coordinate, and of a whole walk, with two harmonics."""


@shortened
class CalibratedModel(WalkersModel):
    """Average walker and eigenwalkers, calibrated for people of another laboratory.

    Attributes
    ----------
    laboratory : sequence of (5, 15, 3)
        Mean walk of each person of that laboratory, mm.
    """

    laboratory: Sequence[np.ndarray] = field(default=(), kw_only=True)


@shortened
class ShippedWalkers(LinearModel):
    """Average walker and eigenwalkers of the model that is shipped with this package.

    Attributes
    ----------
    learnt : Learnt
        Anatomical prior of the same people.
    laboratory : sequence of (5, 15, 3)
        Mean walk of each known person of the walker's laboratory, mm; see `calibrate`.
    """

    learnt: Learnt = field(kw_only=True)
    laboratory: Sequence[np.ndarray] = field(default=(), kw_only=True)


class _Known(TypedDict, total=False):
    """Optional facts about a film, as in the fields of `walk3d.film.reconstruct.clip.Input`."""

    frame_rate_hz: float
    layout: str
    frames: str
    person: str
    width: int
    height: int
    focal_px: float
    stature_mm: float
    least_confidence: float
    labels: Literal["both", "as_given"]


def reconstruct(
    path: str | Path, *, model_folder: str | Path | None = None, **known: Unpack[_Known]
) -> tuple[Walk, dict[str, Any]]:
    """Reconstruct the 3D walk of a person from a film, or from a file or folder of keypoints.

    Parameters
    ----------
    path : str or Path
        Film, file of keypoints, or folder of such files.
    model_folder : str or Path, optional
        Folder of a model that ``make model`` trained; by default the model of this package.
    **known
        Facts about the film: fields of `walk3d.film.reconstruct.clip.Input`, e.g. ``frame_rate_hz=30``.

    Returns
    -------
    walk : Walk
    summary : dict
        Verdict, view angle, cadence and joint angles, as in ``summary.json``.

    Raises
    ------
    InvalidInput
        If the input is unusable.
    """
    from walk3d.film.reconstruct.clip import Input, Labels, reconstruct_clip
    from walk3d.film.reconstruct.model_file import SHIPPED
    from walk3d.film.reconstruct.summary import summarise
    from walk3d.film.reconstruct.video import with_keypoints

    options = Input(path=str(path), **cast(dict[str, Any], known))
    options = replace(options, labels=Labels(require_choice("labels", options.labels, [*Labels])))
    with with_keypoints(options) as keypoints:
        walk = reconstruct_clip(keypoints, Path(model_folder) if model_folder else SHIPPED)
    return walk, summarise(walk)


def calibrate(
    model: WalkersModel | ShippedWalkers, walks: Sequence[FourierRepresentation], people: Sequence[str] = ()
) -> CalibratedModel | ShippedWalkers:
    """Calibrate a model for another laboratory, from the 3D walks of a few people recorded there.

    The walks show that laboratory's joint definitions and body sizes: their difference from the model's average walker,
    beyond the differences between people.  `from_view` then reconstructs other people of that laboratory.

    Parameters
    ----------
    model : WalkersModel or ShippedWalkers
        Model of other laboratories, from `fit` or `walkers`.
    walks : sequence of FourierRepresentation
    people : sequence of str
        Person of each walk; by default each walk is of a different person.

    Raises
    ------
    InvalidInput
        If `walks` is empty, the number of names differs, a walk is one of the model's or unfit for `from_view`, or the
        model does not come from `fit` or `walkers`.
    """
    if not isinstance(model, WalkersModel | ShippedWalkers):
        raise InvalidInput(
            "must be a model that fit(walks) or walkers() returned",
            "model",
            received=repr(model),
            code="wrong_type",
        )
    if not walks:
        raise InvalidInput("needs at least one walk", "walks", received="none", code="no_walks")
    if len(getattr(model, "laboratory", ())):
        raise InvalidInput(
            "is calibrated already", "model", "what fit(walks) returns", code="calibrated_already"
        )
    names = np.array([*people] or range(len(walks)))
    if len(names) != len(walks):
        raise InvalidInput(
            "must have one name for each walk",
            "people",
            received=len(names),
            code="wrong_count",
            count=len(names),
        )
    for walk in walks:
        sample_of(walk)
        if isinstance(model, WalkersModel):
            require_other(model, walk)
    of_person = [
        np.mean([walk.coefficients for walk, who in zip(walks, names, strict=True) if who == name], axis=0)
        for name in dict.fromkeys(names.tolist())
    ]
    if isinstance(model, ShippedWalkers):
        return replace(model, laboratory=tuple(of_person))
    return CalibratedModel(**vars(model), laboratory=tuple(of_person))


def from_view(
    model: LinearModel,
    walk: FourierRepresentation,
    view_angle_deg: float,
    *,
    hidden: Sequence[str] = (),
    noise_variance_mm2: float = 70.0,
    laboratory: str = "known",
) -> Reconstruction:
    """Reconstruct a walk from one view, with error bars.

    Parameters
    ----------
    model, walk, view_angle_deg, hidden, noise_variance_mm2
        Arguments of `pipeline.from_view`.
    laboratory : {"known", "unknown"}
        ``known``: the walker was measured like those of the model.  ``unknown``: joint definitions and body size may
        differ, and bones keep their lengths (the anatomical method, with its default noise).  A calibrated model
        ignores this option.

    Returns
    -------
    Reconstruction
        Coefficients (5, 15, 3), mm, with covariance and half widths of 95 % bars; see Notes.

    Raises
    ------
    InvalidInput
        If `pipeline.from_view` raises one, or an unknown laboratory needs a model from `fit` or `walkers`.

    Notes
    -----
    Error bars are of the Fourier representation with two harmonics.

    For a known laboratory the method is MAP, whose posterior is too narrow: its 95 % bars cover 87 % of the truth for
    synthetic people (zhang2007_coverage).  If the model comes from `fit` and has at least ten walkers, the bars are
    widened by leaving out each of its walkers in turn.  This assumes that its walks are of different people.

    In all other cases the bars are those of the posterior.  Bars of the anatomical method cover 95 to 97 % of the truth
    for other recorded laboratories (zhang2007_sources).
    """
    unknown = require_choice("laboratory", laboratory, ("known", "unknown")) == "unknown"
    walk_from_view = api.from_view(
        model, walk, view_angle_deg, hidden=hidden, noise_variance_mm2=noise_variance_mm2
    )
    angle, hidden_joints = float(np.radians(view_angle_deg)), np.isin(WALKER15.joints, list(hidden))
    laboratory_walks = getattr(model, "laboratory", ())
    if not (unknown or len(laboratory_walks)):
        multipliers, walkers_left_out = np.full(len(WALKER15.joints), NORMAL_95), 0
        if isinstance(model, WalkersModel):
            multipliers, walkers_left_out = calibrated_multipliers(
                model.samples, len(model.components), angle, hidden_joints, noise_variance_mm2
            )
        covariance = covariance_of_map(model, angle, hidden_joints, noise_variance_mm2)
        return Reconstruction(walk_from_view, covariance, multipliers, walkers_left_out)
    if not isinstance(model, WalkersModel | ShippedWalkers):
        raise InvalidInput(
            "must be a model that fit(walks) or walkers() returned",
            "model",
            received=repr(model),
            code="wrong_type",
        )
    if any(abs(each.ravel() - sample_of(walk)).max() < SAME_WALK_MM for each in laboratory_walks):
        raise InvalidInput(
            "must not contain the walk to reconstruct",
            "model",
            received="a model that was learnt from or calibrated with this walk",
            code="same_walk",
        )
    if isinstance(model, WalkersModel):
        learnt = learnt_prior(model.samples)
        return of_unknown_laboratory(learnt, walk.coefficients, angle, hidden_joints, known=laboratory_walks)
    prior, share = model.learnt.prior, model.learnt.share
    if len(laboratory_walks):
        heights = [height_of(each) for each in laboratory_walks]
        of_walker = heights if hidden_joints[list(OF_HEIGHT)].any() else [height_of(walk.coefficients)]
        prior = calibrated(model.learnt, float(np.mean(of_walker)), laboratory_walks, heights)
        share = 0.0
    return of_unknown_laboratory(prior, walk.coefficients, angle, hidden_joints, share=share)


def walkers(
    height_mm: float = HEIGHT_MM, components: int = 30, *, model_folder: str | Path | None = None
) -> ShippedWalkers:
    """Return the average walker and the eigenwalkers that are shipped with this package, for use in `from_view`.

    They have two harmonics and the mean pelvis as origin, like walks from `pipeline.represent`.  The model's card,
    ``walk3d/film/reconstruct/walkers/CARD.md``, lists its people.  Walkers of another laboratory need
    ``from_view(…, laboratory="unknown")``.

    Parameters
    ----------
    height_mm : float
        Height of the head's centre above the ankles, to which the walkers are scaled.
    components : int
        Number of eigenwalkers, at most 225.
    model_folder : str or Path, optional
        Folder of a model that ``make model`` trained; by default the model of this package.

    Raises
    ------
    InvalidInput
        If the height is not above 0, the folder has no model, or the number of eigenwalkers is not 1 to 225.

    Examples
    --------
    >>> walkers(height_mm=1450.0, components=20).components.shape
    (20, 225)
    """
    from walk3d.film.reconstruct.model_file import SHIPPED, load

    require_range("height_mm", height_mm, above=0, unit="mm")
    require_count("components", components, at_most=SIZE)
    learnt = load(Path(model_folder) if model_folder else SHIPPED).learnt
    prior = scaled(truncated(learnt.prior, BLOCKS), height_mm / HEIGHT_MM)
    flat = prior.covariance.transpose(2, 0, 1, 5, 3, 4).reshape(SIZE, SIZE)
    eigenvalues, vectors = np.linalg.eigh(flat)
    leading = vectors[:, ::-1].T[:components]
    largest = np.abs(leading).argmax(axis=1)
    return ShippedWalkers(
        mean=by_block(prior.mean).ravel(),
        components=leading * np.sign(leading[np.arange(len(leading)), largest])[:, None],
        eigenvalues=eigenvalues[::-1][:components],
        total_variance=float(eigenvalues.sum()),
        learnt=replace(learnt, prior=prior),
    )


def angles(motion: MotionCapture, skeleton: str = "auto", subject: str = "") -> dict[str, np.ndarray]:
    """Return a dictionary with the flexion (T,) of hips, knees, shoulders and elbows, degrees, and the times, s.

    Names are ``left_knee_deg``, …; a frame in which a joint is missing has no angle (NaN).  `joint_angles` explains
    signs and zeros.  ``pandas.DataFrame(angles(motion))`` is a table.

    Parameters
    ----------
    motion : MotionCapture
        Recording from `pipeline.read`, or result of `pipeline.motion`.
    skeleton, subject
        Mapping to the joints and name of the person, as for `pipeline.joints`.

    Raises
    ------
    InvalidInput
        If `pipeline.joints` raises one.

    Examples
    --------
    >>> [*angles(api.motion(walkers().mean.reshape(5, 15, 3), 0.9, 2))][:3]
    ['time_s', 'left_hip_deg', 'right_hip_deg']
    """
    positions, valid = api.joints(motion, skeleton, subject)
    degrees = np.degrees(flexion(np.where(valid[..., None], positions, np.nan)))
    table = {"time_s": np.arange(len(degrees)) / motion.frame_rate_hz}
    for kind, joint in enumerate(JOINT_ANGLES):
        table |= {f"{side}_{joint}_deg": degrees[:, kind, number] for number, side in enumerate(SIDES)}
    return table


def write(motion: MotionCapture, path: str | Path, *, skeleton: str = "", replace: bool = False) -> Path:
    """Write a recording in the format of the file's suffix, and return the path.

    Parameters
    ----------
    motion : MotionCapture
        Recording from `pipeline.read`, or result of `pipeline.motion`.
    path : str or Path
        File to write: ``.c3d``, ``.trc``, ``.bvh``, ``.csv`` (a row for each frame and point) or ``.npz``.
    skeleton : str
        Empty: the points of the recording, in its axes.  Otherwise a mapping as in `pipeline.joints`: the joints, with
        z up; TRC is then y up and x forward, BVH y up and z forward.  A motion from `pipeline.motion` has these joints.
    replace : bool
        Replace an existing file.

    Raises
    ------
    InvalidInput
        If `motion` is not a recording, the suffix has no writer, the file exists, or the format cannot store the motion
        (BVH has no missing samples).
    """
    if not isinstance(motion, MotionCapture):
        raise InvalidInput(
            "must be a recording that read(path) returned", "motion", received=repr(motion), code="wrong_type"
        )
    if motion.names == WALKER15.joints and motion.up is UpAxis.z:
        skeleton = skeleton or "walker15"
    target = Path(path)
    require_choice("the suffix of a motion file", target.suffix.lower(), WRITTEN)
    names, parents = motion.names, None
    positions, valid = (motion.positions_mm, motion.valid) if not skeleton else api.joints(motion, skeleton)
    if skeleton:
        names, parents = WALKER15.joints, tuple(-1 if p is None else p for p in WALKER15.parents)
    points = np.where(valid[..., None], positions, np.nan)
    with new_file(target, replace=replace) as temporary:
        write_points(temporary, Points(names, points, motion.frame_rate_hz, parents, own_axes=not skeleton))
    return target
