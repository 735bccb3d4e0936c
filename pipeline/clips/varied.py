"""Clips of varied motion: recorded, or synthetic with a known answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.clips.corpus import Clip
from pipeline.clips.kinds import (
    Clips,
    Corpus,
    PreparedClip,
    RawClip,
    Request,
    collect,
    prepare,
    read_and_prepare,
    report_row,
)  # fmt: skip
from pipeline.clips.options import Recordings, SyntheticClips, SyntheticData
from pipeline.core.walking import BridgedClip
from pipeline.seeding import derive_generator
from pipeline.synthetic.bending import bending_performances
from pipeline.synthetic.limbs import synthetic_body
from pipeline.synthetic.walkers import walking_population
from pipeline.validation import InvalidInput

REPORT_COLUMNS = (
    "clip", "person", "source", "action", "frames", "first_frame", "last_frame", "seconds", "bridged_values",
    "leg_length_mm", "verdict", "reason",
)  # fmt: skip

LEAST_FRAMES = 8
"""Fewest frames of a clip."""

SYNTHETIC_KINDS = ("walking", "bending", "smooth angles")


@dataclass(frozen=True, kw_only=True)
class VariedClips(Clips):
    """Clips of varied motion.

    Attributes
    ----------
    action : (W,) text
    """

    action: np.ndarray


def synthetic_clips(options: SyntheticClips, seed: int) -> VariedClips:
    """Return synthetic clips: walking, bending and bodies of smooth joint angles in turn."""
    count = min(options.limit or options.clips, options.clips)
    of_kind = {kind: len(range(k, count, len(SYNTHETIC_KINDS))) for k, kind in enumerate(SYNTHETIC_KINDS)}
    bodies = _bodies(of_kind, options, derive_generator(seed, "ingest"))
    made = []
    for number in range(count):
        turn, k = divmod(number, len(SYNTHETIC_KINDS))
        kind = SYNTHETIC_KINDS[k]
        row = report_row(
            REPORT_COLUMNS,
            clip=f"{kind.replace(' ', '_')}_{turn + 1:03d}",
            person=f"synthetic_{number + 1:03d}",
            source="synthetic",
            action=kind,
        )
        made.append(_longest_stretch(RawClip(row, bodies[kind][turn], options.frame_rate_hz)))
    return _varied(made)


def _bodies(
    of_kind: Mapping[str, int], options: SyntheticClips, generator: np.random.Generator
) -> dict[str, list[np.ndarray]]:
    """Return as many motions (T, 15, 3), mm, of each kind as are asked for."""
    frames = round(options.seconds * options.frame_rate_hz) + 1
    walking: list[np.ndarray] = []
    bending: list[np.ndarray] = []
    if count := of_kind["walking"]:
        population = walking_population(
            generator,
            male=count // 2,
            female=count - count // 2,
            duration_s=options.seconds + 1 / options.frame_rate_hz,
            frame_rate_hz=options.frame_rate_hz,
        )
        walking = [np.asarray(p[:frames]) for p in population.positions_mm]
    if count := of_kind["bending"]:
        performances = bending_performances(
            generator,
            performances=count,
            subjects=count,
            frames_mean=frames,
            frame_rate_hz=options.frame_rate_hz,
        )
        bending = list(performances.positions_mm)
    smooth = [
        synthetic_body(generator, frames, bandwidth=options.bandwidth).positions_mm
        for _ in range(of_kind["smooth angles"])
    ]
    return {"walking": walking, "bending": bending, "smooth angles": smooth}


def recorded_clips(clips: Sequence[Clip], gap_s: float, workers: int) -> VariedClips:
    """Return the longest stretch of each recording that shows all joints."""
    prepared = read_and_prepare(clips, REPORT_COLUMNS, lambda raw: _longest_stretch(raw, gap_s), workers)
    return _varied(prepared, clips)


def _longest_stretch(raw: RawClip, gap_s: float = 0.0) -> PreparedClip:
    def select(bridged: BridgedClip, row: dict[str, Any]) -> np.ndarray:
        first, stop = _longest_run(bridged.whole)
        if stop - first < LEAST_FRAMES:
            raise InvalidInput(
                "too short a stretch shows all joints",
                expected=f"{LEAST_FRAMES} frames",
                received=str(stop - first),
            )
        seconds = (stop - first - 1) / raw.frame_rate_hz
        row |= {"first_frame": first, "last_frame": stop - 1, "seconds": seconds}
        return bridged.positions[first:stop]

    return prepare(raw, gap_s, select)


def _longest_run(whole: np.ndarray) -> tuple[int, int]:
    """Return the first index of the longest run of True, and the index after its last; 0, 0 if there is none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], whole.astype(int), [0]])))
    if not edges.size:
        return 0, 0
    starts, stops = edges[::2], edges[1::2]
    longest = int(np.argmax(stops - starts))
    return int(starts[longest]), int(stops[longest])


def _varied(made: list[PreparedClip], clips: Sequence[Clip] = ()) -> VariedClips:
    action = np.array([clip.row["action"] for clip in made if clip.positions is not None])
    return VariedClips(**collect(made, REPORT_COLUMNS, clips), action=action)


class VariedCorpus(Corpus):
    """Clips of varied motion (park2011)."""

    name = "clips"
    words = "varied motion"
    sample = "clip_name"
    world = "World: right-handed, metres, z up, as recorded."
    result = VariedClips

    def synthetic(self, data: SyntheticData, seed: int, workers: int) -> Request:
        """Return the request for synthetic clips."""
        chosen = data.clips
        return Request({"clips": chosen, "seed": seed}, lambda: synthetic_clips(chosen, seed))

    def recorded(
        self, data: Recordings, clips: Sequence[Clip], workers: int, missing: str = "estimate"
    ) -> Request:
        """Return the request for recorded clips."""
        gap_s = data.steady.gap_s
        options = {"gap_s": gap_s, "clips": [clip.identity for clip in clips]}
        return Request(options, lambda: recorded_clips(clips, gap_s, workers))


VARIED = VariedCorpus()
"""The corpus of varied motion."""
