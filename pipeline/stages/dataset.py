"""Dataset: steady walks to Fourier representations, one sample to a row."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.config import Dataset, FourierDataset
from pipeline.core import fourier, walking
from pipeline.refusal import Refusal
from pipeline.store import Artefact, Store
from pipeline.threads import spread


def run(options: Dataset, ingest: Artefact, workers: int, store: Store) -> Artefact:
    """Artefact with the Fourier representations of the chosen walks.

    Arrays: ``coefficients`` (R, 1 + 2H, 15, 3) mm, ``frequency_hz``, ``phase_rad`` (R,),
    ``variance_fractions`` (R, H), ``residual_fraction`` (R,), ``residual_covariance``,
    ``temporal_covariance`` (R, 15, 3, 3) mm², ``walk`` (R,) index into the ingest artefact, ``origin_mm`` (R, 3)
    what was subtracted from its positions, ``scale`` (R,) the factor that size normalisation then applied,
    ``person``, ``clip``, ``source`` (R,) text.
    """
    match options:
        case FourierDataset():
            return store.artefact("dataset", options, [ingest], lambda: _fourier(options, ingest, workers))
        case _:
            raise TypeError(f"no dataset for {type(options).__name__}")


def _fourier(
    options: FourierDataset, ingest: Artefact, workers: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    arrays = ingest.arrays
    chosen = _choose(arrays["person"], arrays["residual_share"], options.walks)
    if options.size not in ("absolute", "stature"):
        raise Refusal(
            "the size is unknown", where="dataset.size", expected="absolute or stature", received=options.size
        )
    stature = arrays["stature_mm"]
    scale = stature[chosen].mean() / stature if options.size == "stature" else np.ones(len(stature))

    def one(walk: int) -> tuple[fourier.FourierRepresentation, np.ndarray]:
        motion = arrays["positions"][arrays["first"][walk] : arrays["first"][walk + 1]]
        centred = walking.set_origin(motion, origin=options.origin)
        series = fourier.represent(
            scale[walk] * centred,
            float(arrays["frame_rate_hz"][walk]),
            harmonics=options.harmonics,
            frequency_hz=float(arrays["frequency_hz"][walk]) if options.harmonics == 2 else None,
        )
        return series, motion[0, 0] - centred[0, 0]

    series, origins = zip(*spread(one, chosen, workers), strict=True)

    def stack(name: str) -> np.ndarray:
        return np.stack([getattr(s, name) for s in series])

    return {
        **{
            name: stack(name)
            for name in (
                "coefficients", "frequency_hz", "phase_rad", "variance_fractions", "residual_fraction",
                "residual_covariance", "temporal_covariance",
            )
        },
        "walk": np.array(chosen),
        "origin_mm": np.stack(origins),
        "scale": scale[chosen],
        **{name: arrays[name][chosen] for name in ("person", "clip", "source")},
    }, {"walkers": len(set(arrays["person"][chosen])), "walks": len(chosen)}  # fmt: skip


def _choose(person: np.ndarray, residual_share: np.ndarray, walks: str) -> list[int]:
    """Indices of the walks to use: every one, or of each person the one that two harmonics describe best."""
    if walks == "all":
        return list(range(len(person)))
    if walks != "best":
        raise Refusal("the walks are unknown", where="dataset.walks", expected="best or all", received=walks)
    best: dict[str, int] = {}
    for walk, who in enumerate(person):
        if who not in best or residual_share[walk] < residual_share[best[who]]:
            best[who] = walk
    return list(best.values())
