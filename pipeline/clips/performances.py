"""Performances of an action: complete clips, single gait cycles, and synthetic bending to the floor."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from pipeline.clips.kinds import Performances
from pipeline.clips.options import Steady, SyntheticPerformances
from pipeline.clips.usable import PreparedClip, RawClip, collect, prepare, report_row, require_action
from pipeline.clips.walks import REPORT_COLUMNS as WALK_COLUMNS
from pipeline.clips.walks import steady_walk
from pipeline.core import fourier, posture
from pipeline.core.resampling import interpolate
from pipeline.core.walking import BridgedClip
from pipeline.seeding import derive_generator
from pipeline.synthetic.bending import bending_performances
from pipeline.validation import InvalidInput

REPORT_COLUMNS = (
    "clip", "person", "source", "frames", "first_frame", "last_frame", "seconds", "bridged_values",
    "leg_length_mm", "verdict", "reason",
)  # fmt: skip

MIN_FRAMES = 8
MIN_DURATION_S = 0.25
"""Smallest number of frames and smallest duration, s, of a performance."""

MIN_PERFORMANCES = 3
"""Smallest number of performances from which an action model can be learnt."""


def synthetic_performances(options: SyntheticPerformances, seed: int) -> Performances:
    """Return synthetic performances of bending, with the true phase of each frame."""
    count = min(options.limit or options.performances, options.performances)
    generated = bending_performances(
        derive_generator(seed, "ingest"),
        performances=count,
        subjects=min(options.subjects, count),
        frames_mean=options.frames_mean,
        frame_rate_hz=options.frame_rate_hz,
        rate_spread=options.rate_spread,
        marker_noise_mm=options.marker_noise_mm,
    )
    performances = []
    for number, (positions, subject) in enumerate(
        zip(generated.positions_mm, generated.subject, strict=True)
    ):
        row = report_row(
            REPORT_COLUMNS,
            clip=f"bending_{number + 1:03d}",
            person=f"subject_{int(subject) + 1}",
            source="synthetic",
        )
        performances.append(whole_clip(RawClip(row, positions, options.frame_rate_hz)))
    fields = collect(performances, REPORT_COLUMNS, at_least=MIN_PERFORMANCES)
    return Performances(
        **fields, phase=np.concatenate(generated.phase), moving_phase=np.array(generated.moving_phase)
    )


def whole_clip(raw: RawClip, gap_s: float = 0.0) -> PreparedClip:
    """Return a clip as a performance, cut to the first and the last frame in which all joints are measured."""

    def select(bridged: BridgedClip, row: dict[str, Any]) -> np.ndarray:
        frames = np.flatnonzero(bridged.whole)
        first, last = (int(frames[0]), int(frames[-1])) if frames.size else (0, -1)
        min_frames = max(MIN_FRAMES, math.ceil(MIN_DURATION_S * raw.frame_rate_hz))
        if last - first + 1 < min_frames:
            raise InvalidInput(
                "the clip is too short for a performance",
                expected=f"{min_frames} frames",
                received=last - first + 1,
                code="too_short",
                needed=min_frames,
                frames=last - first + 1,
            )
        if not bridged.whole[first : last + 1].all():
            missing = first + int(np.flatnonzero(~bridged.whole[first : last + 1])[0])
            raise InvalidInput(
                "the clip has a gap that is too long",
                f"frame {missing}",
                f"gaps up to {gap_s:g} s",
                code="long_gap",
                frame=missing,
            )
        usable = bridged.positions[first : last + 1]
        require_action(usable, raw.frame_rate_hz, first)
        posture.postures(usable)  # raises if a posture is undefined
        row |= {"first_frame": first, "last_frame": last, "seconds": (last - first) / raw.frame_rate_hz}
        return usable

    return prepare(raw, gap_s, select)


def middle_cycle(raw: RawClip, steady: Steady) -> PreparedClip:
    """Return the middle gait cycle of a steady walk, from phase zero to phase zero, as treadmill walking."""
    walk = steady_walk(dataclasses.replace(raw, row=report_row(WALK_COLUMNS, **raw.row)), steady)
    if walk.positions is None:
        return PreparedClip({name: walk.row.get(name, value) for name, value in raw.row.items()})
    frame_rate_hz = raw.frame_rate_hz
    series = fourier.represent(walk.positions, frame_rate_hz)
    period = frame_rate_hz / series.frequency_hz
    length = len(walk.positions) - 1
    # Phase zero occurs at the frames zero + k period.
    zero = -series.phase_rad / (2 * np.pi) * period % period
    starts = zero + period * np.arange(max(1, int((length - zero) // period)))
    start = float(starts[np.argmin(np.abs(starts + period / 2 - length / 2))])
    if start + period > length:
        start = max(0.0, length - period)
    count = round(period) + 1
    cycle = interpolate(walk.positions, np.linspace(start, start + period, count))
    clip = whole_clip(RawClip(raw.row, cycle, frame_rate_hz))
    if clip.positions is None:
        return clip
    offset = int(walk.row["first_frame"])
    range_in_file = {"first_frame": offset + round(start), "last_frame": offset + round(start + period)}
    row_of_walk = {
        "frames": len(raw.positions),
        **{name: walk.row[name] for name in ("bridged_values", "reason")},
        **range_in_file,
    }
    return dataclasses.replace(clip, row=clip.row | row_of_walk)
