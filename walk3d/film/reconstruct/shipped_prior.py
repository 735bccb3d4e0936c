"""Reconstruction method that applies the shipped model of walkers to the user's own data: ``model.prior=shipped``."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from pipeline.palette import Style
from pipeline.studies.eigenwalkers.samples import FourierSamples
from pipeline.studies.walks.methods import Method
from walk3d.anatomy.other_laboratories import OtherLaboratories
from walk3d.film.reconstruct.model_file import SHIPPED, load


def _prepared(data: FourierSamples, folder: Path) -> OtherLaboratories:
    return OtherLaboratories(data, load(folder).learnt)


def prior_method(name: str, folder: Path = SHIPPED) -> Method:
    """Return a method that reconstructs walks with a trained model, calibrated on the other people in the data.

    Parameters
    ----------
    name : str
        Name of the method, for ``model.prior=NAME``.
    folder : Path
        Folder of a model that ``make model`` trained; by default the model of this package.
    """
    return Method(
        name,
        Style(name.replace("_", " "), "amber"),
        lambda fold, walk, views: fold.prepared.reconstruct(fold, walk, views),
        lambda fold, walk, views: fold.prepared.estimate(walk.number, views),
        title=f"{name.replace('_', ' ').capitalize()} model",
        prepare=partial(_prepared, folder=folder),
        files=tuple(folder / part for part in ("manifest.json", "model.npz")),
        of_other_people=True,
    )
