"""The library: films and keypoints to 3D walks, and views of people of a laboratory that the model does not know."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline import api
from pipeline.api import SAME_WALK_MM, WalkersModel, require_other, sample_of
from pipeline.core import linear_model
from pipeline.core.fourier import FourierRepresentation
from pipeline.core.linear_model import LinearModel
from pipeline.shortened import shortened
from pipeline.skeleton import WALKER15
from pipeline.validation import InvalidInput, require_choice, require_range
from walk3d.anatomy import prior as anatomical

if TYPE_CHECKING:
    from walk3d.film.reconstruct.clip import Walk


@shortened
class CalibratedModel(WalkersModel):
    """Average walker and eigenwalkers for people of another laboratory.

    Attributes
    ----------
    laboratory : sequence of (5, 15, 3)
        Mean walks of some of its people, mm.
    """

    laboratory: Sequence[np.ndarray] = field(default=(), kw_only=True)


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
) -> np.ndarray:
    """Return the Fourier coefficients (5, 15, 3), mm, of a walk reconstructed from one view.

    Parameters
    ----------
    model, walk, view_angle_deg, hidden, noise_variance_mm2
        As for `pipeline.from_view`.
    laboratory : {"known", "unknown"}
        Whether the walker was measured as those of the model; ``unknown``: joints may lie elsewhere and people be of
        another size, and bones keep their lengths (the anatomical method, with a noise of its own).  A model that
        was calibrated is for its own laboratory, and always so.

    Raises
    ------
    InvalidInput
        As `pipeline.from_view`, or if an unknown laboratory is asked of a model that is not from `fit`.
    """
    unknown = require_choice("laboratory", laboratory, ("known", "unknown")) == "unknown"
    known = api.from_view(model, walk, view_angle_deg, hidden=hidden, noise_variance_mm2=noise_variance_mm2)
    if not (unknown or isinstance(model, CalibratedModel)):
        return known
    if not isinstance(model, WalkersModel):
        raise InvalidInput(
            "must be what fit(walks) returns", "model", received=repr(model), code="wrong_type"
        )
    own = [linear_model.flatten(each[None])[0] for each in getattr(model, "laboratory", ())]
    if any(abs(each - sample_of(walk)).max() < SAME_WALK_MM for each in own):
        raise InvalidInput(
            "must be learnt from other walks", "model", received="this one among them", code="same_walk"
        )
    angle = np.radians(require_range("view_angle_deg", view_angle_deg))
    return _of_unknown_laboratory(model, walk, angle, np.isin(WALKER15.joints, list(hidden)))


def _of_unknown_laboratory(
    model: WalkersModel, walk: FourierRepresentation, angle: float, hidden: np.ndarray
) -> np.ndarray:
    """Return the coefficients (5, 15, 3) of a walk of another laboratory, of which the model may know people."""
    walkers = linear_model.unflatten(model.samples)
    weights = np.full(len(walkers), 1.0 / len(walkers))
    learnt = anatomical.fit(walkers, weights, anatomical.Shrinkage())
    prior = anatomical.unfamiliar(learnt, anatomical.Differences(), known=getattr(model, "laboratory", ()))
    conditional = anatomical.condition(prior, np.array([angle]), noise=anatomical.Noise(), hidden=hidden)
    axes = anatomical.image_axes(np.array([angle]))[0]
    turned = np.einsum("ij,kjb->kib", axes, anatomical.by_joint(walk.coefficients))
    whole = turned.ravel().copy()
    observed = whole[None, None, ~conditional.unknown]
    found = anatomical.fit_lengths(conditional, observed, anatomical.tolerances(prior))
    whole[conditional.unknown] = found.unknown[0, 0]
    return anatomical.by_block(np.einsum("ij,kib->kjb", axes, whole.reshape(turned.shape)))
