"""Dataset: steady walks to Fourier representations, performances to postures, clips to limbs."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.core import fourier, limb_chain, posture, walking
from pipeline.core.resampling import interpolate
from pipeline.storage.store import Artefact, Store
from pipeline.studies.options import Dataset, FourierDataset, LimbDataset, PostureDataset
from pipeline.threads import map_threads
from pipeline.validation import InvalidInput


def run(options: Dataset, ingest: Artefact, workers: int, store: Store) -> Artefact:
    """Artefact with the samples, and in its notes what they are in words.

    Fourier representations of the chosen walks: ``coefficients`` (R, 1 + 2H, 15, 3) mm, ``frequency_hz``,
    ``phase_rad`` (R,),
    ``variance_fractions`` (R, H), ``residual_fraction`` (R,), ``residual_covariance``,
    ``temporal_covariance`` (R, 15, 3, 3) mm², ``walk`` (R,) index into the ingest artefact, ``origin_mm`` (R, 3)
    what was subtracted from its positions, ``scale`` (R,) the factor that size normalisation then applied,
    ``person``, ``clip``, ``source`` (R,) text.
    Postures: ``postures`` (sum of F, 37), ``positions`` (sum of F, 15, 3) mm they were read from, ``first``
    (M + 1,) where each performance starts, ``frame_rate_hz`` (M,); ``limbs_mm`` (M, 12), ``pelvis_mm``,
    ``shoulders_mm`` (M, 3) lengths of limbs; ``floor_mm`` (M,) height from which the pelvis is measured;
    ``phase`` (sum of F,) and ``moving_phase`` (2,) where the truth is known; ``person``, ``clip``, ``source``.
    Limbs: ``positions`` (N, F, 15, 3) mm of each stretch, ``lengths_mm`` (N, 14) and ``length_sd_mm`` of its
    limbs in the order of `limb_chain.WALKER14`, ``start_s`` (N,); ``person``, ``clip``, ``action``, ``source``.
    """
    match options:
        case FourierDataset():
            return store.artefact("dataset", options, [ingest], lambda: _fourier(options, ingest, workers))
        case PostureDataset():
            return store.artefact("dataset", options, [ingest], lambda: _postures(options, ingest, workers))
        case LimbDataset():
            return store.artefact("dataset", options, [ingest], lambda: _limbs(options, ingest))
        case _:
            raise TypeError(f"no dataset for {type(options).__name__}")


def _fourier(
    options: FourierDataset, ingest: Artefact, workers: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    arrays = ingest.arrays
    chosen = _choose(arrays["person"], arrays["residual_share"], options.walks)
    if options.size not in ("absolute", "stature"):
        raise InvalidInput(
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

    series, origins = zip(*map_threads(one, chosen, workers), strict=True)

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
    }, {
        "walkers": len(set(arrays["person"][chosen])), "walks": len(chosen), "frequency": options.frequency,
        "words": words(len(chosen), len(set(arrays["person"][chosen]))),
    }  # fmt: skip


def words(walks: int, people: int) -> str:
    """How many samples there are, for captions."""
    return f"{people} walkers" if walks == people else f"{walks} walks of {people} walkers"


def _postures(
    options: PostureDataset, ingest: Artefact, workers: int
) -> tuple[dict[str, Any], dict[str, Any]]:
    arrays = ingest.arrays
    if options.frame_rate_hz < 0:
        raise InvalidInput(
            "the frame rate is negative",
            where="dataset.frame_rate_hz",
            expected="hertz, or 0 for as recorded",
            received=f"{options.frame_rate_hz:g}",
        )
    truth = "phase" in arrays

    def one(m: int) -> dict[str, np.ndarray]:
        frames = slice(arrays["first"][m], arrays["first"][m + 1])
        rate = float(arrays["frame_rate_hz"][m])
        motion = arrays["positions"][frames]
        at = _frames_at(len(motion), rate, options.frame_rate_hz)
        positions = interpolate(motion, at)
        floor = posture.floor_level(positions)
        lengths = posture.limb_lengths(positions)
        found = {
            "postures": posture.postures(
                positions, frame=options.frame, heading=options.heading, floor_mm=floor
            ),
            "positions": positions,
            "frame_rate_hz": np.array(min(rate, options.frame_rate_hz or rate)),
            "floor_mm": np.array(floor),
            **{name: getattr(lengths, name) for name in ("limbs_mm", "pelvis_mm", "shoulders_mm")},
        }
        if truth:
            found["phase"] = interpolate(arrays["phase"][frames], at)
        return found

    count = len(arrays["first"]) - 1
    made = map_threads(one, range(count), workers)
    end_to_end = ("postures", "positions", *(["phase"] if truth else []))
    frames = [len(m["postures"]) for m in made]
    people = len(set(arrays["person"]))
    return {
        **{name: np.concatenate([m[name] for m in made]) for name in end_to_end},
        **{name: np.stack([m[name] for m in made]) for name in made[0] if name not in end_to_end},
        "first": np.concatenate([[0], np.cumsum(frames)]),
        **({"moving_phase": arrays["moving_phase"]} if truth else {}),
        **{name: arrays[name] for name in ("person", "clip", "source", "leg_length_mm")},
    }, {
        "performances": count,
        "people": people,
        "frame": options.frame,
        "frames_mean": float(np.mean(frames)),
        "words": f"{count} performances of {people} {'person' if people == 1 else 'people'}, "
        f"{np.mean(frames):.0f} frames on average",
    }


def _frames_at(frames: int, rate_hz: float, wanted_hz: float) -> np.ndarray:
    """Frames, fractional, at which a clip is read to have another rate; its own where that is no faster."""
    if wanted_hz == 0 or wanted_hz >= rate_hz:
        return np.arange(frames, dtype=float)
    count = max(2, round((frames - 1) / rate_hz * wanted_hz) + 1)
    return np.linspace(0.0, frames - 1.0, count)


def _choose(person: np.ndarray, residual_share: np.ndarray, walks: str) -> list[int]:
    """Indices of the walks to use: every one, or of each person the one that two harmonics describe best."""
    if walks == "all":
        return list(range(len(person)))
    if walks != "best":
        raise InvalidInput(
            "the walks are unknown", where="dataset.walks", expected="best or all", received=walks
        )
    best: dict[str, int] = {}
    for walk, who in enumerate(person):
        if who not in best or residual_share[walk] < residual_share[best[who]]:
            best[who] = walk
    return list(best.values())


def _limbs(options: LimbDataset, ingest: Artefact) -> tuple[dict[str, Any], dict[str, Any]]:
    arrays = ingest.arrays
    if options.frames < 3 or options.stretches < 1 or options.frame_rate_hz <= 0:
        raise InvalidInput(
            "the stretches are none",
            where="dataset",
            expected="frames 3 or more, stretches 1 or more, frame_rate_hz > 0",
            received=f"{options.frames}, {options.stretches}, {options.frame_rate_hz:g}",
        )
    stretches, clip_of, starts, short = [], [], [], []
    for c in range(len(arrays["first"]) - 1):
        motion = arrays["positions"][arrays["first"][c] : arrays["first"][c + 1]]
        at = _frames_at(len(motion), float(arrays["frame_rate_hz"][c]), options.frame_rate_hz)
        positions = interpolate(motion, at)
        room = len(positions) - options.frames
        if room < 0:
            short.append(str(arrays["clip"][c]))
            continue
        count = min(options.stretches, 1 + room // (options.frames // 2))
        for start in np.unique(np.linspace(0, room, count).round().astype(int)):
            stretches.append(positions[start : start + options.frames])
            clip_of.append(c)
            starts.append(start / options.frame_rate_hz)
    if not stretches:
        raise InvalidInput(
            "no clip is long enough",
            where="dataset.frames",
            expected=f"{options.frames} frames at {options.frame_rate_hz:g} Hz",
        )
    lengths = np.stack(
        [np.linalg.norm(limb_chain.relative_trajectories(limb_chain.WALKER14, p), axis=-1) for p in stretches]
    )
    clips = len(set(clip_of))
    remark = f"{len(short)} clips are shorter than {options.frames} frames (e.g. {short[0]})" if short else ""
    return {
        "positions": np.stack(stretches),
        "lengths_mm": lengths.mean(axis=1),
        "length_sd_mm": lengths.std(axis=1),
        "start_s": np.array(starts),
        **{name: arrays[name][clip_of] for name in ("person", "clip", "source", "action")},
    }, {
        "stretches": len(stretches),
        "clips": clips,
        "words": f"{len(stretches)} stretches of {options.frames} frames out of {clips} clips",
        "remarks": [remark] if remark else [],
    }
