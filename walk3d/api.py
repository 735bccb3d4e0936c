"""The library: films and keypoints to 3D walks, one view of a walk with error bars, motion as files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline import api
from pipeline.api import SAME_WALK_MM, WalkersModel, require_other, sample_of
from pipeline.core.fourier import FourierRepresentation
from pipeline.core.linear_model import LinearModel
from pipeline.shortened import shortened
from pipeline.skeleton import WALKER15
from pipeline.skeleton.recorded import MotionCapture
from pipeline.storage.publishing import new_file
from pipeline.validation import InvalidInput, require_choice, require_count, require_range
from walk3d.anatomy.one_view import (
    NORMAL_95,
    Reconstruction,
    calibrated_multipliers,
    covariance_of_map,
    learnt_prior,
    of_unknown_laboratory,
)
from walk3d.anatomy.prior import Prior, by_block
from walk3d.export.motion import WRITTEN
from walk3d.export.motion import Motion as Points
from walk3d.export.motion import write as write_points
from walk3d.film.walk.training import HEIGHT_MM

if TYPE_CHECKING:
    from walk3d.film.reconstruct.clip import Walk

BLOCKS, SIZE = 5, 225
"""Coefficients of a coordinate, and of a walk of two harmonics."""


@shortened
class CalibratedModel(WalkersModel):
    """Average walker and eigenwalkers for people of another laboratory.

    Attributes
    ----------
    laboratory : sequence of (5, 15, 3)
        Mean walks of some of its people, mm.
    """

    laboratory: Sequence[np.ndarray] = field(default=(), kw_only=True)


@shortened
class ShippedWalkers(LinearModel):
    """Average walker and eigenwalkers of the model that ships.

    Attributes
    ----------
    prior : Prior
        Anatomical prior of the same people.
    share : float
        Share of the differences between laboratories that the model lacks.
    """

    prior: Prior = field(kw_only=True)
    share: float = field(kw_only=True)


def reconstruct(
    path: str | Path, *, model_folder: str | Path | None = None, **known: Any
) -> tuple[Walk, dict[str, Any]]:
    """Reconstruct the 3D walk of a person from a film, or from a file or folder of keypoints.

    Parameters
    ----------
    path : str or Path
    model_folder : str or Path, optional
        Folder of a model of one's own, by ``make model``; by default the model that ships.
    **known
        Facts about the film: the fields of `walk3d.film.reconstruct.clip.Input`, as ``frame_rate_hz=30``.

    Returns
    -------
    walk : Walk
    summary : dict
        Verdict, view angle, cadence, joint angles, as in ``summary.json``.

    Raises
    ------
    InvalidInput
        If the input cannot be used.
    """
    from walk3d.film.reconstruct.clip import Input, reconstruct_clip
    from walk3d.film.reconstruct.model_file import SHIPPED
    from walk3d.film.reconstruct.summary import summarise
    from walk3d.film.reconstruct.video import with_keypoints

    options = Input(path=str(path), **known)
    with with_keypoints(options) as keypoints:
        walk = reconstruct_clip(keypoints, Path(model_folder) if model_folder else SHIPPED)
    return walk, summarise(walk)


def calibrate(
    model: WalkersModel, walks: Sequence[FourierRepresentation], people: Sequence[str] = ()
) -> CalibratedModel:
    """Return the model for people of another laboratory, of whom a few are known in 3D.

    Where that laboratory puts its joints, and how tall its people are, is what these walks differ by from the model's
    average walker, as far as persons do not differ by as much.  `from_view` then reconstructs its other people.

    Parameters
    ----------
    model : WalkersModel
        Of other laboratories.
    walks : sequence of FourierRepresentation
    people : sequence of str
        Whose each walk is; if not given, everybody's own.

    Raises
    ------
    InvalidInput
        If there is no walk, not a name to each, one of the model's own or not as `from_view` needs it, or the model is
        not from `fit`.
    """
    if not isinstance(model, WalkersModel):
        raise InvalidInput(
            "must be what fit(walks) returns", "model", received=repr(model), code="wrong_type"
        )
    if not walks:
        raise InvalidInput("needs a walk or more", "walks", received="none", code="no_walks")
    if isinstance(model, CalibratedModel):
        raise InvalidInput(
            "is calibrated already", "model", "what fit(walks) returns", code="calibrated_already"
        )
    names = np.array([*people] or range(len(walks)))
    if len(names) != len(walks):
        raise InvalidInput(
            "must be a name to each walk", "people", received=len(names), code="wrong_count", count=len(names)
        )
    for walk in walks:
        require_other(model, walk)
    of_person = [
        np.mean([walk.coefficients for walk, who in zip(walks, names, strict=True) if who == name], axis=0)
        for name in dict.fromkeys(names.tolist())
    ]
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
    """Return a walk reconstructed from one view, with error bars.

    Parameters
    ----------
    model, walk, view_angle_deg, hidden, noise_variance_mm2
        As for `pipeline.from_view`.
    laboratory : {"known", "unknown"}
        Whether the walker was measured as those of the model; ``unknown``: joints may lie elsewhere and people be of
        another size, and bones keep their lengths (the anatomical method, with a noise of its own).  A model that
        was calibrated is for its own laboratory, and always so.

    Returns
    -------
    Reconstruction
        Coefficients (5, 15, 3), mm, with covariance and half widths of 95 % bars; see Notes.

    Raises
    ------
    InvalidInput
        As `pipeline.from_view`, or if an unknown laboratory is asked of a model that is not from `fit` or `walkers`.

    Notes
    -----
    Bars are of the Fourier representation of two harmonics.  Of a known laboratory the method is MAP, whose posterior
    is too narrow: of synthetic people its 95 % bars hold 87 % of the truth (zhang2007_coverage).  They are therefore
    widened by what the model's own walkers show, each left out in turn, if the model is from `fit` and has ten walkers
    or more; its walks are taken to be of different people.  Otherwise, and of an unknown or calibrated laboratory,
    bars are as the posterior has them; those of the anatomical method hold 95 to 97 % of the truth of other recorded
    laboratories (zhang2007_sources).
    """
    unknown = require_choice("laboratory", laboratory, ("known", "unknown")) == "unknown"
    known = api.from_view(model, walk, view_angle_deg, hidden=hidden, noise_variance_mm2=noise_variance_mm2)
    angle, unseen = float(np.radians(view_angle_deg)), np.isin(WALKER15.joints, list(hidden))
    if not (unknown or isinstance(model, CalibratedModel)):
        multipliers, walkers_left_out = np.full(len(WALKER15.joints), NORMAL_95), 0
        if isinstance(model, WalkersModel):
            multipliers, walkers_left_out = calibrated_multipliers(
                model.samples, len(model.components), angle, unseen, noise_variance_mm2
            )
        covariance = covariance_of_map(model, angle, unseen, noise_variance_mm2)
        return Reconstruction(known, covariance, multipliers, walkers_left_out)
    if isinstance(model, ShippedWalkers):
        return of_unknown_laboratory(model.prior, walk.coefficients, angle, unseen, share=model.share)
    if not isinstance(model, WalkersModel):
        raise InvalidInput(
            "must be what fit(walks) or walkers() returns", "model", received=repr(model), code="wrong_type"
        )
    theirs = getattr(model, "laboratory", ())
    if any(abs(each.ravel() - sample_of(walk)).max() < SAME_WALK_MM for each in theirs):
        raise InvalidInput(
            "must be learnt from other walks", "model", received="this one among them", code="same_walk"
        )
    return of_unknown_laboratory(learnt_prior(model.samples), walk.coefficients, angle, unseen, known=theirs)


def walkers(
    height_mm: float = HEIGHT_MM, components: int = 30, *, model_folder: str | Path | None = None
) -> ShippedWalkers:
    """Return average walker and eigenwalkers of the model that ships, for `from_view` without walks of one's own.

    They are of two harmonics, about the mean pelvis as `pipeline.represent` has walks.  Its card,
    ``walk3d/film/reconstruct/walkers/CARD.md``, says who is in it.  A walker of another laboratory needs
    ``from_view(…, laboratory="unknown")``.

    Parameters
    ----------
    height_mm : float
        Height of the centre of the head above the ankles to which the walkers are scaled.
    components : int
        Number of eigenwalkers, at most 225.
    model_folder : str or Path, optional
        Folder of a model of one's own, by ``make model``; by default the model that ships.

    Raises
    ------
    InvalidInput
        If the height is not above 0, there is no model in the folder, or the number of eigenwalkers is not from 1 to
        225.

    Examples
    --------
    >>> walkers(height_mm=1450.0, components=20).components.shape
    (20, 225)
    """
    from walk3d.film.reconstruct.model_file import SHIPPED, load

    require_range("height_mm", height_mm, above=0, unit="mm")
    require_count("components", components, at_most=SIZE)
    trained = load(Path(model_folder) if model_folder else SHIPPED)
    model, square = trained.model, (height_mm / HEIGHT_MM) ** 2
    mean = (height_mm / HEIGHT_MM) * model.mean[..., :BLOCKS]  # (15, 3, 5)
    split = model.covariance.reshape(*model.mean.shape, *model.mean.shape)
    covariance = square * split[:, :, :BLOCKS, :, :, :BLOCKS]
    flat = covariance.transpose(2, 0, 1, 5, 3, 4).reshape(SIZE, SIZE)
    eigenvalues, vectors = np.linalg.eigh(flat)
    kept = vectors[:, ::-1].T[:components]
    largest = np.abs(kept).argmax(axis=1)
    return ShippedWalkers(
        mean=by_block(mean).ravel(),
        components=kept * np.sign(kept[np.arange(len(kept)), largest])[:, None],
        eigenvalues=eigenvalues[::-1][:components],
        total_variance=float(eigenvalues.sum()),
        prior=Prior(
            mean=mean,
            covariance=covariance,
            length_variance=square * model.bone_variance,
            pair_variance=square * model.pair_variance,
        ),
        share=trained.unfamiliar,
    )


def write(motion: MotionCapture, path: str | Path, *, skeleton: str = "", replace: bool = False) -> Path:
    """Write a recording in the format that the suffix of the file names, and return the file.

    Parameters
    ----------
    motion : MotionCapture
        As `pipeline.read` returns it.
    path : str or Path
        File to write: ``.c3d``, ``.trc``, ``.bvh``, ``.csv`` (a row for each frame and point) or ``.npz``.
    skeleton : str
        Empty: the points of the recording, in its own axes; otherwise the joints, z up, by a mapping as in
        `pipeline.joints`.  TRC is then y up and x forward, BVH y up and z forward.
    replace : bool
        Whether a file that exists may be replaced.

    Raises
    ------
    InvalidInput
        If this is not a recording, there is no writer of this suffix, the file exists, or its format cannot hold the
        motion, as BVH a missing sample.
    """
    if not isinstance(motion, MotionCapture):
        raise InvalidInput(
            "must be what read(path) returns", "motion", received=repr(motion), code="wrong_type"
        )
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
