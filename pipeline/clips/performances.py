"""Performances of one action: whole recordings, cycles cut out of walks, or synthetic bending.

Every clip ends in the report, kept or refused, with the reason; nothing is dropped in silence.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.clips.corpus import Clip, read_clip
from pipeline.clips.kinds import Clips, Corpus, Request, packed_clips
from pipeline.clips.options import (
    Cut,
    FolderData,
    RecordedData,
    RecordedPerformances,
    Steady,
    SyntheticData,
    SyntheticPerformances,
)
from pipeline.clips.walks import REPORT_COLUMNS as WALK_COLUMNS
from pipeline.clips.walks import steady_walk
from pipeline.core import fourier, posture, walking
from pipeline.core.resampling import interpolate
from pipeline.seeding import derive_generator
from pipeline.synthetic.bending import bending_performances
from pipeline.threads import map_threads
from pipeline.validation import InvalidInput

REPORT_COLUMNS = (
    "clip", "person", "source", "frames", "first_frame", "last_frame", "seconds", "bridged_values",
    "leg_length_mm", "verdict", "reason",
)  # fmt: skip

LEAST_FRAMES = 8
"""Of a performance: fewer show no course of an action."""


@dataclass(frozen=True, kw_only=True)
class Performances(Clips):
    """Performances of one action.

    Attributes
    ----------
    phase : (sum of T,), optional
        True course of the action at each frame, where it is known.
    moving_phase : (2,), optional
        The course between which the actor moves.
    """

    phase: np.ndarray | None = None
    moving_phase: np.ndarray | None = None


@dataclass(frozen=True)
class Performance:
    """One performance, or the row of the report that says why there is none."""

    row: dict[str, Any]
    positions: np.ndarray | None
    frame_rate_hz: float


def synthetic_performances(options: SyntheticPerformances, seed: int) -> Performances:
    """Return synthetic bending; its phase is the truth that synchronization is to find."""
    count = min(options.limit or options.performances, options.performances)
    made = bending_performances(
        derive_generator(seed, "ingest"),
        performances=count,
        subjects=min(options.subjects, count),
        frames_mean=options.frames_mean,
        frame_rate_hz=options.frame_rate_hz,
        rate_spread=options.rate_spread,
        marker_noise_mm=options.marker_noise_mm,
    )
    performances = []
    for number, (positions, subject) in enumerate(zip(made.positions_mm, made.subject, strict=True)):
        row = dict.fromkeys(REPORT_COLUMNS, "") | {
            "clip": f"bending_{number + 1:03d}",
            "person": f"subject_{int(subject) + 1}",
            "source": "synthetic",
        }
        whole = np.ones(positions.shape[:2], dtype=bool)
        performances.append(_performance(row, positions, whole, options.frame_rate_hz, gap_s=0.0))
    return dataclasses.replace(
        _packed(performances, inputs={}),
        phase=np.concatenate(made.phase),
        moving_phase=np.array(made.moving_phase),
    )


def recorded_performances(
    clips: Iterable[Clip], options: RecordedPerformances, steady: Steady, workers: int
) -> Performances:
    """Return recorded performances."""

    def one(clip: Clip) -> Performance:
        row = dict.fromkeys(REPORT_COLUMNS, "") | {
            "clip": clip.name,
            "person": clip.person,
            "source": clip.source,
        }
        try:
            motion, positions, valid = read_clip(clip)
            if options.cut is Cut.cycles:
                return _middle_cycle(row, positions, valid, motion.frame_rate_hz, steady)
            return _performance(row, positions, valid, motion.frame_rate_hz, gap_s=steady.gap_s)
        except InvalidInput as refusal:
            # Readers name the file by its path; the report is kept, and shown to others, without it.
            reason = str(refusal).replace(str(clip.path), clip.name)
            return Performance(row | {"verdict": "refused", "reason": reason}, None, 0.0)

    clips = list(clips)
    inputs = {clip.name: clip.sha256 for clip in clips if clip.path}
    return _packed(map_threads(one, clips, workers), inputs=inputs)


def _performance(
    row: dict[str, Any], positions: np.ndarray, valid: np.ndarray, frame_rate_hz: float, *, gap_s: float
) -> Performance:
    """A whole clip as one performance, with its row of the report."""
    row = row | {"frames": len(positions), "verdict": "refused"}
    try:
        walking.require_millimetres(positions)
        row["leg_length_mm"] = walking.leg_length(positions)
        bridged = walking.bridge_gaps(positions, valid, frame_rate_hz, gap_s=gap_s)
        row["bridged_values"] = bridged.n_filled
        frames = np.flatnonzero(bridged.whole)
        first, last = (int(frames[0]), int(frames[-1])) if frames.size else (0, -1)
        if last - first + 1 < LEAST_FRAMES:
            raise InvalidInput(
                "too short for a performance",
                expected=f"{LEAST_FRAMES} frames",
                received=str(last - first + 1),
            )
        if not bridged.whole[first : last + 1].all():
            missing = first + int(np.flatnonzero(~bridged.whole[first : last + 1])[0])
            raise InvalidInput(
                "joints are missing for too long",
                where=f"frame {missing}",
                expected=f"gaps up to {gap_s:g} s",
            )
        kept = bridged.positions[first : last + 1]
        posture.postures(kept)  # refuses what leaves a posture undefined
    except InvalidInput as refusal:
        return Performance(row | {"reason": str(refusal)}, None, frame_rate_hz)
    row |= {"first_frame": first, "last_frame": last, "seconds": (last - first) / frame_rate_hz}
    return Performance(row | {"verdict": "kept"}, kept, frame_rate_hz)


def _middle_cycle(
    row: dict[str, Any], positions: np.ndarray, valid: np.ndarray, frame_rate_hz: float, steady: Steady
) -> Performance:
    """The cycle in the middle of a steady walk, from phase zero to phase zero, as its treadmill equivalent."""
    walk = steady_walk(row | dict.fromkeys(WALK_COLUMNS, "") | row, positions, valid, frame_rate_hz, steady)
    if walk.positions is None:
        kept = {name: walk.row[name] for name in REPORT_COLUMNS if name in walk.row}
        return Performance(row | kept, None, frame_rate_hz)
    series = fourier.represent(walk.positions, frame_rate_hz)
    period = frame_rate_hz / series.frequency_hz
    length = len(walk.positions) - 1
    # Phase zero comes at frames zero + k period; the clip holds at least one whole cycle and a half.
    zero = -series.phase_rad / (2 * np.pi) * period % period
    starts = zero + period * np.arange(max(1, int((length - zero) // period)))
    start = float(starts[np.argmin(np.abs(starts + period / 2 - length / 2))])
    if start + period > length:
        start = max(0.0, length - period)
    count = round(period) + 1
    cycle = interpolate(walk.positions, np.linspace(start, start + period, count))
    offset = int(walk.row["first_frame"])
    made = _performance(row, cycle, np.ones(cycle.shape[:2], dtype=bool), frame_rate_hz, gap_s=0.0)
    if made.positions is None:
        return made
    placed = {"first_frame": offset + round(start), "last_frame": offset + round(start + period)}
    kept = {"frames": len(positions), "bridged_values": walk.row["bridged_values"], **placed}
    return Performance(made.row | kept, made.positions, frame_rate_hz)


def _packed(performances: list[Performance], *, inputs: dict[str, str]) -> Performances:
    kept = [p for p in performances if p.positions is not None]
    rows = [p.row for p in performances]
    if len(kept) < 3:
        reasons = "; ".join(f"{row['clip']}: {row['reason']}" for row in rows if row["reason"])
        raise InvalidInput(
            "too few performances to learn an action from",
            expected="3 or more",
            received=f"{len(kept)} of {len(rows)}" + (f" ({reasons[:300]})" if reasons else ""),
        )
    positions = [p.positions for p in kept if p.positions is not None]
    return Performances(
        **packed_clips([p.row for p in kept], positions, [p.frame_rate_hz for p in kept]),
        report=rows,
        report_columns=list(REPORT_COLUMNS),
        inputs=inputs,
    )


class PerformancesCorpus(Corpus):
    """Performances of one action: mozerov2006."""

    name = "performances"
    words = "performances of one action"
    sample = "performance"
    world = "World: right-handed, metres, z up; actors stand over the origin, facing +y at the first frame."
    result = Performances

    def synthetic(self, data: SyntheticData, seed: int, workers: int) -> Request:
        """Return the request for synthetic bending."""
        chosen = data.performances
        return Request({"performances": chosen, "seed": seed}, lambda: synthetic_performances(chosen, seed))

    def recorded(self, data: RecordedData | FolderData, clips: Sequence[Clip], workers: int) -> Request:
        """Return the request for recorded performances."""
        wanted, steady = data.performances, data.steady
        options = {"performances": wanted, "steady": steady, "clips": [clip.identity for clip in clips]}
        return Request(options, lambda: recorded_performances(clips, wanted, steady, workers))


PERFORMANCES = PerformancesCorpus()
"""The one corpus of performances."""
