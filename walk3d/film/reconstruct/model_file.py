"""Reader and writer of the model of walkers: statistics of walkers, multipliers of error bars, and data sources."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.formats.arrays import load_npz
from pipeline.formats.budget import read_one
from pipeline.formats.contract import read_bytes
from pipeline.storage.publishing import publish
from pipeline.storage.sealed_folders import digest, read_manifest, remove_stale
from pipeline.validation import InvalidInput, require_count, require_finite, require_shape
from walk3d.anatomy.prior import BONES, JOINTS, PAIRS, Prior
from walk3d.anatomy.prior.laboratories import COMMON
from walk3d.anatomy.prior.own_laboratory import Learnt
from walk3d.film.walk import CompactMoments, WalkerModel, expand, model_of
from walk3d.film.walk.calibration import ANYBODY, AS_OURS, CYCLE_KINDS, GROUPS, LEVELS, Calibration
from walk3d.film.walk.sagittal_angles import KINDS
from walk3d.film.walk.training import BLOCKS, SIZE

SHIPPED = Path(__file__).resolve().parent / "walkers"
"""Folder of the model of walkers in this package: ``model.npz``, ``manifest.json``, ``CARD.md``."""
VERSION = 4
ENTRY = "walkers"
"""Key in ``manifest.json`` that identifies the folder of a model of walkers."""


_SHAPES: dict[str, tuple[int | str, ...]] = {
    "mean": (JOINTS, 3, BLOCKS), "components": ("N", SIZE), "eigenvalues": ("N",),
    "within": ((BLOCKS + 1) // 2, 3 * JOINTS, 3 * JOINTS), "bone_variance": (len(BONES),),
    "pair_variance": (len(PAIRS),), "aperiodic_variance": (JOINTS, 3), "log_frequency": (2,),
}  # fmt: skip
"""Shapes of the arrays of `CompactMoments` in the model file."""
_MULTIPLIERS: dict[str, tuple[int, ...]] = {
    "joints": (len(GROUPS), 3, len(LEVELS)), "angles": (len(KINDS), len(LEVELS)),
    "cycle": (len(CYCLE_KINDS), len(LEVELS)), "view": (2, len(LEVELS)),
}  # fmt: skip
"""Shapes of the arrays with multipliers of error bars in the model file.

The file stacks the arrays for `AS_OURS` and `ANYBODY`.
"""


@dataclass(frozen=True)
class TrainedModel:
    """Model of walkers with the multipliers of its error bars.

    Attributes
    ----------
    compact : CompactMoments
    calibrations : dict of str to Calibration
        Multipliers of error bars: `AS_OURS`, and `ANYBODY` if enough people of other laboratories are known.
    about : dict
        Sources, numbers of people and settings, for the manifest.
    """

    compact: CompactMoments
    calibrations: dict[str, Calibration]
    about: dict[str, Any]

    @property
    def model(self) -> WalkerModel:
        """Model of walkers with its full covariance."""
        return model_of(expand(self.compact))

    @property
    def learnt(self) -> Learnt:
        """Anatomical prior that is learnt from the model's training walks, for walkers of the model's height."""
        model = self.model
        covariance = model.covariance.reshape(*model.mean.shape, *model.mean.shape)
        prior = Prior(model.mean, covariance, model.bone_variance, model.pair_variance)
        return Learnt(prior, self.unfamiliar, self.compact.walkers)

    @property
    def concentration(self) -> float:
        """Sum over laboratories of the squared share of each laboratory in the number of training people."""
        people = np.array(list(self.about["people_by_source"].values()), float)
        return float((people**2).sum() / people.sum() ** 2)

    @property
    def unfamiliar(self) -> float:
        """Share of the variance between laboratories that the model does not cover.

        A calibrated model lacks only the part that each person has alone.
        """
        return self.concentration * (1.0 - COMMON if "calibrated_on" in self.about else 1.0)


def save(trained: TrainedModel, folder: Path) -> None:
    """Write a model atomically: its arrays in single precision, and a manifest with the digest of the arrays."""
    content = io.BytesIO()
    arrays = {name: getattr(trained.compact, name) for name in _SHAPES}
    arrays |= {
        f"{name}_multipliers": np.stack(
            [getattr(calibration, name) for calibration in trained.calibrations.values()]
        )
        for name in _MULTIPLIERS
    }
    arrays = {name: np.asarray(array, np.float32) for name, array in arrays.items()}
    np.savez_compressed(content, allow_pickle=False, **arrays)
    data = content.getvalue()
    with publish(folder, having=ENTRY) as publication:
        (publication.folder / "model.npz").write_bytes(data)
        publication.facts = {
            "version": VERSION,
            "sha256": digest(data),
            ENTRY: trained.compact.walkers,
            **trained.about,
        }


def load(folder: Path = SHIPPED) -> TrainedModel:
    """Read a model of walkers.

    Raises
    ------
    InvalidInput
        If files are missing or damaged, the version differs, or the digest is not that of the manifest.
    """
    if not folder.is_dir():  # left by a training that was killed between two renames
        remove_stale(folder.parent)
    for name in ("manifest.json", "model.npz"):
        if not (folder / name).is_file():
            raise InvalidInput("there is no model of walkers", folder / name, "`make model`", code="no_model")
    return read_one(folder, _load)


def _load(folder: Path) -> TrainedModel:
    manifest = read_manifest(folder)
    if manifest.get("version") != VERSION:
        raise InvalidInput(
            "this version of the model is not supported", folder, VERSION, code="wrong_version"
        )
    data = read_bytes(folder / "model.npz")
    if digest(data) != manifest.get("sha256"):
        raise InvalidInput(
            "the digest of the model differs from its manifest", folder / "model.npz", code="wrong_digest"
        )
    stored, _ = load_npz(data, "model.npz")
    arrays = {name: np.asarray(array, float) for name, array in stored.items()}
    for name, shape in (_SHAPES | {f"{k}_multipliers": ("K", *s) for k, s in _MULTIPLIERS.items()}).items():
        where = f"model.npz, {name}"
        require_finite(where, require_shape(where, arrays.get(name), shape))
    require_shape("model.npz, eigenvalues", arrays["eigenvalues"], arrays["components"].shape[:1])
    people = require_count("manifest.json, walkers", manifest["walkers"])
    compact = CompactMoments(walkers=people, **{name: arrays[name] for name in _SHAPES})
    multipliers = [arrays[f"{name}_multipliers"] for name in _MULTIPLIERS]
    for name, array in zip(_MULTIPLIERS, multipliers, strict=True):
        require_count(f"model.npz, {name}: kinds of bars", len(array), at_most=2)
    calibrations = {
        audience: Calibration(*parts)
        for audience, *parts in zip((AS_OURS, ANYBODY), *multipliers)  # noqa: B905
    }
    of_the_file = ("version", "sha256", "bytes", "walkers", "files", "seal")
    about = {k: v for k, v in manifest.items() if k not in of_the_file}
    sources = about.get("people_by_source")
    if not isinstance(sources, dict) or not sources:
        raise InvalidInput(
            "must state the number of training people from each data source",
            "manifest.json, people_by_source",
            code="no_sources",
        )
    for source, count in sources.items():
        require_count(f"manifest.json, people_by_source, {source}", count)
    return TrainedModel(compact, calibrations, about)
