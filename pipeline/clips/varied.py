"""Clips of varied motion: recorded, or synthetic with known answers.

Every clip ends in the report, kept or refused, with the reason; nothing is dropped in silence.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.clips.corpus import Clip, read_clip
from pipeline.clips.kinds import Clips, Corpus, Request, packed_clips
from pipeline.clips.options import FolderData, RecordedData, SyntheticClips, SyntheticData
from pipeline.core import walking
from pipeline.seeding import derive_generator
from pipeline.synthetic.bending import bending_performances
from pipeline.synthetic.limbs import synthetic_body
from pipeline.synthetic.walkers import walking_population
from pipeline.threads import map_threads
from pipeline.validation import InvalidInput

REPORT_COLUMNS = (
    "clip", "person", "source", "action", "frames", "first_frame", "last_frame", "seconds", "bridged_values",
    "leg_length_mm", "verdict", "reason",
)  # fmt: skip

LEAST_FRAMES = 8
"""Of a clip: fewer show no motion."""


@dataclass(frozen=True, kw_only=True)
class VariedClips(Clips):
    """Clips of varied motion.

    Attributes
    ----------
    action : (W,) text
    """

    action: np.ndarray


@dataclass(frozen=True)
class VariedClip:
    """A clip, or the row of the report that says why there is none."""

    row: dict[str, Any]
    positions: np.ndarray | None
    frame_rate_hz: float


def synthetic_clips(options: SyntheticClips, seed: int) -> VariedClips:
    """Return synthetic clips: walking, bending and bodies of smooth angles in turn."""
    count = min(options.limit or options.clips, options.clips)
    if count < 1:
        raise InvalidInput("no clips", where="data.clips.clips", expected="1 or more", received=str(count))
    generator = derive_generator(seed, "ingest")
    kinds = ("walking", "bending", "smooth angles")
    of_kind = {kind: len(range(number, count, len(kinds))) for number, kind in enumerate(kinds)}
    frames = round(options.seconds * options.frame_rate_hz) + 1
    bodies: dict[str, list[np.ndarray]] = {"smooth angles": [], "walking": [], "bending": []}
    if of_kind["walking"]:
        male = of_kind["walking"] // 2
        walkers = walking_population(
            generator,
            male=male,
            female=of_kind["walking"] - male,
            duration_s=options.seconds + 1 / options.frame_rate_hz,
            frame_rate_hz=options.frame_rate_hz,
        )
        bodies["walking"] = [np.asarray(p[:frames]) for p in walkers.positions_mm]
    if of_kind["bending"]:
        benders = bending_performances(
            generator,
            performances=of_kind["bending"],
            subjects=of_kind["bending"],
            frames_mean=frames,
            frame_rate_hz=options.frame_rate_hz,
        )
        bodies["bending"] = list(benders.positions_mm)
    bodies["smooth angles"] = [
        synthetic_body(generator, frames, bandwidth=options.bandwidth).positions_mm
        for _ in range(of_kind["smooth angles"])
    ]
    made = []
    for number in range(count):
        kind = kinds[number % len(kinds)]
        positions = bodies[kind][number // len(kinds)]
        row = dict.fromkeys(REPORT_COLUMNS, "") | {
            "clip": f"{kind.replace(' ', '_')}_{number // len(kinds) + 1:03d}",
            "person": f"synthetic_{number + 1:03d}",
            "source": "synthetic",
            "action": kind,
        }
        whole = np.ones(positions.shape[:2], dtype=bool)
        made.append(_clip(row, positions, whole, options.frame_rate_hz, gap_s=0.0))
    return _packed(made, inputs={})


def recorded_clips(clips: Iterable[Clip], gap_s: float, workers: int) -> VariedClips:
    """Return recorded clips: of each the longest stretch that shows all joints."""

    def one(clip: Clip) -> VariedClip:
        row = dict.fromkeys(REPORT_COLUMNS, "") | {
            "clip": clip.name,
            "person": clip.person,
            "source": clip.source,
            "action": clip.action,
        }
        try:
            motion, positions, valid = read_clip(clip)
            return _clip(row, positions, valid, motion.frame_rate_hz, gap_s=gap_s)
        except InvalidInput as refusal:
            # Readers name the file by its path; the report is kept, and shown to others, without it.
            reason = str(refusal).replace(str(clip.path), clip.name)
            return VariedClip(row | {"verdict": "refused", "reason": reason}, None, 0.0)

    clips = list(clips)
    inputs = {clip.name: clip.sha256 for clip in clips if clip.path}
    return _packed(map_threads(one, clips, workers), inputs=inputs)


def _clip(
    row: dict[str, Any], positions: np.ndarray, valid: np.ndarray, frame_rate_hz: float, *, gap_s: float
) -> VariedClip:
    row = row | {"frames": len(positions), "verdict": "refused"}
    try:
        walking.require_millimetres(positions)
        row["leg_length_mm"] = walking.leg_length(positions)
        bridged = walking.bridge_gaps(positions, valid, frame_rate_hz, gap_s=gap_s)
        row["bridged_values"] = bridged.n_filled
        first, stop = _longest(bridged.whole)
        if stop - first < LEAST_FRAMES:
            raise InvalidInput(
                "too short a stretch shows all joints",
                expected=f"{LEAST_FRAMES} frames",
                received=str(stop - first),
            )
    except InvalidInput as refusal:
        return VariedClip(row | {"reason": str(refusal)}, None, frame_rate_hz)
    seconds = (stop - first - 1) / frame_rate_hz
    row |= {"first_frame": first, "last_frame": stop - 1, "seconds": seconds, "verdict": "kept"}
    return VariedClip(row, bridged.positions[first:stop], frame_rate_hz)


def _longest(whole: np.ndarray) -> tuple[int, int]:
    """First frame of the longest run of True, and the frame after its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], whole.astype(int), [0]])))
    if not edges.size:
        return 0, 0
    starts, stops = edges[::2], edges[1::2]
    longest = int(np.argmax(stops - starts))
    return int(starts[longest]), int(stops[longest])


def _packed(made: list[VariedClip], *, inputs: dict[str, str]) -> VariedClips:
    kept = [clip for clip in made if clip.positions is not None]
    rows = [clip.row for clip in made]
    if not kept:
        reasons = "; ".join(f"{row['clip']}: {row['reason']}" for row in rows[:3])
        raise InvalidInput(f"none of the {len(rows)} clips can be used", received=reasons)
    positions = [clip.positions for clip in kept if clip.positions is not None]
    return VariedClips(
        **packed_clips([clip.row for clip in kept], positions, [clip.frame_rate_hz for clip in kept]),
        action=np.array([clip.row["action"] for clip in kept]),
        report=rows,
        report_columns=list(REPORT_COLUMNS),
        inputs=inputs,
    )


class VariedCorpus(Corpus):
    """Clips of varied motion: park2011."""

    name = "clips"
    words = "varied motion"
    sample = "clip_name"
    world = "World: right-handed, metres, z up, as recorded."
    result = VariedClips

    def synthetic(self, data: SyntheticData, seed: int, workers: int) -> Request:
        """Return the request for synthetic clips."""
        chosen = data.clips
        return Request({"clips": chosen, "seed": seed}, lambda: synthetic_clips(chosen, seed))

    def recorded(self, data: RecordedData | FolderData, clips: Sequence[Clip], workers: int) -> Request:
        """Return the request for recorded clips."""
        gap_s = data.steady.gap_s
        options = {"gap_s": gap_s, "clips": [clip.identity for clip in clips]}
        return Request(options, lambda: recorded_clips(clips, gap_s, workers))


VARIED = VariedCorpus()
"""The one corpus of varied motion."""
