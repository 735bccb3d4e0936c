"""Clips of varied motion, recorded or synthetic."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pipeline.clips.kinds import VariedClips
from pipeline.clips.options import SyntheticClips
from pipeline.clips.usable import PreparedClip, RawClip, collect, prepare, report_row, require_action
from pipeline.core.walking import BridgedClip, longest_run
from pipeline.seeding import derive_generator
from pipeline.synthetic.bending import bending_performances
from pipeline.synthetic.limbs import synthetic_body
from pipeline.synthetic.walkers import walking_population
from pipeline.validation import InvalidInput

REPORT_COLUMNS = (
    "clip", "person", "source", "action", "frames", "first_frame", "last_frame", "seconds", "bridged_values",
    "leg_length_mm", "verdict", "reason",
)  # fmt: skip

MIN_FRAMES = 8
"""Smallest number of frames of a clip of varied motion."""

SYNTHETIC_KINDS = ("walking", "bending", "smooth angles")


def synthetic_clips(options: SyntheticClips, seed: int) -> VariedClips:
    """Return synthetic clips of three kinds: walking, bending, and smooth random joint angles."""
    count = min(options.limit or options.clips, options.clips)
    counts = {kind: len(range(k, count, len(SYNTHETIC_KINDS))) for k, kind in enumerate(SYNTHETIC_KINDS)}
    bodies = _bodies(counts, options, derive_generator(seed, "ingest"))
    clips = []
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
        clips.append(longest_stretch(RawClip(row, bodies[kind][turn], options.frame_rate_hz)))
    return varied_of(clips)


def _bodies(
    counts: Mapping[str, int], options: SyntheticClips, generator: np.random.Generator
) -> dict[str, list[np.ndarray]]:
    """Return motions (T, 15, 3), mm, for each kind of motion, in the numbers that `counts` states."""
    frames = round(options.seconds * options.frame_rate_hz) + 1
    walking: list[np.ndarray] = []
    bending: list[np.ndarray] = []
    if count := counts["walking"]:
        population = walking_population(
            generator,
            male=count // 2,
            female=count - count // 2,
            duration_s=options.seconds + 1 / options.frame_rate_hz,
            frame_rate_hz=options.frame_rate_hz,
        )
        walking = [p[:frames] for p in population.positions_mm]
    if count := counts["bending"]:
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
        for _ in range(counts["smooth angles"])
    ]
    return {"walking": walking, "bending": bending, "smooth angles": smooth}


def longest_stretch(raw: RawClip, gap_s: float = 0.0) -> PreparedClip:
    """Return the longest part of a clip in which all joints are measured, or a rejected clip."""

    def select(bridged: BridgedClip, row: dict[str, Any]) -> np.ndarray:
        first, stop = longest_run(bridged.whole)
        if stop - first < MIN_FRAMES:
            raise InvalidInput(
                "the longest part of the clip in which all joints are measured is too short",
                expected=f"{MIN_FRAMES} frames",
                received=stop - first,
                code="too_short",
                needed=MIN_FRAMES,
                frames=int(stop - first),
            )
        require_action(bridged.positions[first:stop], raw.frame_rate_hz, first)
        seconds = (stop - first - 1) / raw.frame_rate_hz
        row |= {"first_frame": first, "last_frame": stop - 1, "seconds": seconds}
        return bridged.positions[first:stop]

    return prepare(raw, gap_s, select)


def varied_of(prepared: list[PreparedClip], inputs: Mapping[str, str] | None = None) -> VariedClips:
    """Return the usable clips of varied motion, collected from prepared clips."""
    action = np.array([clip.row["action"] for clip in prepared if clip.positions is not None])
    return VariedClips(**collect(prepared, REPORT_COLUMNS, inputs), action=action)
